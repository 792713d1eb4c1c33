#include "cdprcal/frame/poses.hpp"

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/readings/run.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {

LengthOffset parse_length_offset(const std::string& name) {
  for (const LengthOffset offset : {LengthOffset::none, LengthOffset::common, LengthOffset::each}) {
    if (name == to_string(offset)) return offset;
  }
  throw InputError("offset: must be none, common or each, not " + in_quotes(name));
}

const char* to_string(LengthOffset offset) {
  switch (offset) {
    case LengthOffset::none:
      return "none";
    case LengthOffset::common:
      return "common";
    case LengthOffset::each:
      return "each";
  }
  return "unknown";
}

LengthScale parse_length_scale(const std::string& name) {
  if (name == "common") return LengthScale::common;
  if (name == "each") return LengthScale::each;
  throw InputError("scale: must be common or each, not " + in_quotes(name));
}

FramePoses parse_frame_poses(const std::string& name) {
  if (name == "automatic") return FramePoses::automatic;
  if (name == "samples") return FramePoses::samples;
  if (name == "rests") return FramePoses::rests;
  throw InputError("poses: must be automatic, samples or rests, not " + in_quotes(name));
}

const char* to_string(FrameStatus status) {
  switch (status) {
    case FrameStatus::converged:
      return "converged";
    case FrameStatus::not_converged:
      return "not_converged";
    case FrameStatus::unobservable:
      return "unobservable";
  }
  return "unknown";
}

namespace detail {
namespace {

/// Samples closer than this come from a logger that runs by itself; people take a pose at a time.
constexpr double kByItself_s = 0.5;
/// No frame needs more poses than this: samples of a log that never rests are thinned to them.
constexpr Eigen::Index kMostSamples = 400;

bool sampled_by_itself(const Log& log) {
  const Eigen::Index samples = log.sample_count();
  return samples >= 3 && median_step_s(log, {0, samples}) < kByItself_s;
}

std::vector<SampleRange> every_sample(const Log& log) {
  std::vector<SampleRange> out;
  const Eigen::Index step = 1 + (log.sample_count() - 1) / kMostSamples;
  for (Eigen::Index i = 0; i < log.sample_count(); i += step) out.push_back({i, i + 1});
  return out;
}

std::vector<SampleRange> rests(const Robot& robot, const Log& log) {
  Log told = log;  // whole lengths tell a rest as well as relative ones
  if (told.length_m.cols() == 0) told.length_m = log.direct_length_m;
  std::vector<SampleRange> out;
  for (const SampleRange& segment : segments(told)) {
    for (const Equilibrium& rest : detect_equilibria(told, segment, robot.sigma)) {
      out.push_back(inner_part(told, segment, rest, DetectionOptions().window_s));
    }
  }
  return out;
}

template <class Readings>
bool same(const Readings& a, const Readings& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         (a.array() == b.array() || (a.array().isNaN() && b.array().isNaN())).all();
}

bool reads_the_same(const Measurement& a, const Measurement& b) {
  return std::ranges::all_of(kChannelTable, [&](const ChannelRow& row) {
    return same(readings_of(a, channel_of(row)), readings_of(b, channel_of(row)));
  });
}

/// Readings count once: given twice they would make σ smaller, and tell nothing.
void require_distinct(const std::vector<Log>& logs) {
  for (std::size_t i = 0; i < logs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Log &a = logs[i], &b = logs[j];
      if (a.time_s.size() != b.time_s.size() || a.time_s != b.time_s) continue;
      if (!same(a.direct_length_m, b.direct_length_m) || !same(a.length_m, b.length_m)) continue;
      throw InputError(name_of(a) + ": has the same times and lengths as " + name_of(b) +
                       "; give each log once");
    }
  }
}

void require_lengths(const Robot& robot, const Log& log) {
  const Eigen::Index cables = robot.cable_count();
  for (const LogMatrix* lengths : {&log.direct_length_m, &log.length_m}) {
    if (lengths->cols() != 0 && lengths->cols() != cables) {
      throw InputError(name_of(log) + ": has lengths of " + std::to_string(lengths->cols()) +
                       " cables, and the robot has " + std::to_string(cables) +
                       ": give the robot file of this log");
    }
  }
  if (!log.direct_length_m.array().isFinite().any() && !log.length_m.array().isFinite().any()) {
    throw InputError(name_of(log) +
                     ": holds no lengths, neither whole (direct_length_1_m …) nor relative "
                     "(length_1_m …): give logs that have them, a frame is found from lengths");
  }
}

}  // namespace

FramePoseSet frame_poses(const Robot& robot, const std::vector<Log>& logs,
                         const FrameOptions& options) {
  if (logs.empty()) throw InputError("logs: give one or more logs");
  require_distinct(logs);
  FramePoseSet out;
  bool guessed = true;
  for (const Log& read : logs) {
    const std::optional<Log> corrected = correct_readings(robot, read);
    const Log& given = corrected ? *corrected : read;
    require_lengths(robot, given);
    const bool whole = given.direct_length_m.array().isFinite().any();
    const int number = out.logs++;
    if (!whole && row_of(robot.platform.motion).turns == 3) {
      FramePoseSet own = calibrated_poses(robot, read);
      for (FramePose& pose : own.poses) {
        pose.log = number;
        out.poses.push_back(std::move(pose));
      }
      out.guess.insert(out.guess.end(), own.guess.begin(), own.guess.end());
      continue;
    }
    guessed = false;
    const bool by_rests = options.poses == FramePoses::rests ||
                          (options.poses == FramePoses::automatic && sampled_by_itself(given));
    std::vector<SampleRange> ranges = by_rests ? rests(robot, given) : every_sample(given);
    if (ranges.empty()) ranges = every_sample(given);
    for (const SampleRange& range : ranges) {
      FramePose pose{measurement_mean(given, range, PoseKind::static_pose, robot.cable_count()),
                     number, static_cast<int>(range.begin)};
      // What is read again to the last digit is the same reading: a log that hangs, or a copy.
      const bool copied = std::ranges::any_of(out.poses, [&](const FramePose& other) {
        return other.log == number && reads_the_same(other.reading, pose.reading);
      });
      if (!copied) out.poses.push_back(std::move(pose));
    }
  }
  if (!guessed) out.guess.clear();
  if (out.poses.empty())
    throw InputError(name_of(logs[0]) +
                     ": holds no poses; give a log with rests, or a list of them");
  return out;
}

}  // namespace detail
}  // namespace cdprcal
