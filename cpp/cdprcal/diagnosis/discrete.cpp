#include "cdprcal/diagnosis/discrete.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "cdprcal/effects/reading_faults.hpp"

namespace cdprcal {
namespace {

/// A fault must lower the cost by this factor: the small effects never do.
constexpr double kOrdersOfMagnitude = 10.0;
constexpr int kMostFaults = 6;
constexpr int kAllStarts = 8;
/// Rests that the trials look at, or samples where nothing says that the platform rests.
constexpr int kMostRests = 9, kMostSamples = 30;

std::string channel_list(const std::vector<double>& signs) {
  std::string out;
  for (std::size_t i = 0; i < signs.size(); ++i) {
    if (signs[i] < 0.0) out += (out.empty() ? "" : ", ") + std::to_string(i + 1);
  }
  return out;
}

void add_signs(const std::string& name, const std::string& what, int n,
               std::vector<DiscreteFault>& out) {
  for (int mask = 1; mask < 1 << n; ++mask) {
    std::vector<double> signs;
    for (int i = 0; i < n; ++i) signs.push_back((mask >> i) & 1 ? -1.0 : 1.0);
    const std::string list = channel_list(signs);
    out.push_back(
        {name, "sign", std::move(signs), what + " of cable " + list + " counts backwards"});
  }
}

CalibrateOptions options_for(const Log& log) {
  CalibrateOptions options;
  options.method = log.tension_N.cols() > 0 ? Method::statics : Method::kinematic;
  options.noise = NoiseSource::specified;
  options.solve.max_iterations = 50;
  options.solve.explain = false;
  return options;
}

/// What a calibration says of a map of the readings.
struct Trial {
  double cost = std::numeric_limits<double>::infinity();
  bool agrees = false;      ///< a pose is found, and the residuals are within their sigma
  bool says_enough = true;  ///< not when the pose is left open: whatever fits then proves nothing
  bool surprises = true;    ///< residuals that chance would not make
};

Trial try_map(const Robot& robot, const Log& log, const std::vector<double>& at_s,
              int most_starts) {
  constexpr double kChance = 1e-3;
  CalibrateOptions options = options_for(log);
  options.most_starts = most_starts;
  options.at_s = at_s;
  const CalibrationResult result = calibrate(robot, log, options).result;
  Trial out;
  if (std::isfinite(result.cost)) out.cost = result.cost;
  out.agrees = result.status == CalibrationStatus::converged;
  out.says_enough = result.status != CalibrationStatus::unobservable;
  out.surprises = !(result.chi_square_p_value >= kChance);
  return out;
}

/// Root mean square of what readings vary by about each sensor's mean.
double variation(const LogMatrix& readings) {
  double squares = 0.0;
  Eigen::Index count = 0;
  for (Eigen::Index c = 0; c < readings.cols(); ++c) {
    const Eigen::VectorXd column = readings.col(c);
    const auto read = column.array().isFinite();
    const auto number = read.count();
    const double mean = read.select(column.array(), 0.0).sum() / static_cast<double>(number);
    squares += read.select((column.array() - mean).square(), 0.0).sum();
    count += number;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

/// Whether setting a fault right (a unit) shrinks readings until they say nothing: whatever fits
/// then proves nothing.
bool silences(const Robot& robot, const Log& before, const Log& after) {
  const auto silenced = [](const LogMatrix& was, const LogMatrix& is, double sigma) {
    const double left = variation(is);
    return left < 0.5 * variation(was) && !(left > sigma);
  };
  return silenced(before.length_m, after.length_m, robot.sigma.length_m) ||
         silenced(before.swivel_rad, after.swivel_rad, robot.sigma.swivel_rad) ||
         silenced(before.roll_pitch_yaw_rad, after.roll_pitch_yaw_rad, robot.sigma.attitude_rad);
}

/// A log of a few rows, each the mean over a rest, or a sample in motion where there are no load
/// cells, spread over the run; and their times. Nothing when there are too few.
std::optional<Log> few_poses(const Robot& robot, const Log& log, std::vector<double>& at_s) {
  const CalibrateOptions options = options_for(log);
  std::vector<Measurement> poses =
      prepare(without_reading_faults(robot), log, options).problem.measurements;
  const bool at_rest = options.method == Method::statics;
  if (at_rest) {
    std::erase_if(poses, [](const Measurement& m) { return m.kind != PoseKind::static_pose; });
  }
  const auto count = static_cast<int>(poses.size());
  if (count < 2) return std::nullopt;
  const int rows = std::min(count, at_rest ? kMostRests : kMostSamples);
  Log brief;
  brief.source = log.source;
  brief.time_s.resize(rows);
  brief.length_m.resize(rows, log.length_m.cols());
  brief.swivel_rad.resize(rows, log.swivel_rad.cols());
  brief.tension_N.resize(rows, log.tension_N.cols());
  brief.roll_pitch_yaw_rad.resize(rows, log.roll_pitch_yaw_rad.cols());
  brief.tension_setpoint_N.resize(rows, 0);
  for (int row = 0; row < rows; ++row) {
    const Measurement& m = poses[static_cast<std::size_t>(row * (count - 1) / (rows - 1))];
    brief.time_s[row] = row;  // a second apart: one segment
    at_s.push_back(row);
    if (brief.length_m.cols() > 0) brief.length_m.row(row) = m.length_m;
    if (brief.swivel_rad.cols() > 0) brief.swivel_rad.row(row) = m.swivel_rad;
    if (brief.tension_N.cols() > 0) brief.tension_N.row(row) = m.tension_N;
    if (brief.roll_pitch_yaw_rad.cols() > 0)
      brief.roll_pitch_yaw_rad.row(row) = m.roll_pitch_yaw_rad;
  }
  return brief;
}

}  // namespace

AppliedEffect as_listed(const DiscreteFault& fault) {
  AppliedEffect listed{fault.name, "", {{fault.parameter, fault.values}}};
  if (!fault.tension_order.empty()) {
    listed.parameters.push_back({"tension_order", fault.tension_order});
  }
  return listed;
}

void set_right(const DiscreteFault& fault, Robot& robot, Log& log) {
  if (fault.convention) {
    robot.euler_convention = *fault.convention;
  } else {
    set_right(as_listed(fault), log);
  }
}

std::vector<DiscreteFault> discrete_faults(const Robot& robot, const Log& log) {
  const int n = robot.cable_count();
  std::vector<DiscreteFault> out;
  if (log.length_m.cols() > 0) add_signs("length_sign", "the length", n, out);
  if (log.swivel_rad.cols() > 0) add_signs("swivel_sign", "the swivel", n, out);
  std::vector<double> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 1.0);
  // The drives are in another order, or the encoders alone; the load cells sit on the drives.
  const std::vector<double> as_it_is = order;
  const auto add_order = [&](const std::vector<double>& wrong, const std::string& which) {
    out.push_back({"cable_order", "order", wrong, which + " in another order"});
    if (log.tension_N.cols() == 0) return;
    out.push_back(
        {"cable_order", "order", wrong,
         "the length and swivel encoders of " + which + " in another order, the load cells are not",
         as_it_is});
  };
  if (n <= 6) {
    while (std::next_permutation(order.begin(), order.end())) {
      add_order(order, "the cables are read");
    }
  } else {
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        std::vector<double> swapped = order;
        std::swap(swapped[static_cast<std::size_t>(i)], swapped[static_cast<std::size_t>(j)]);
        add_order(swapped, "cables " + std::to_string(i + 1) + " and " + std::to_string(j + 1) +
                               " are read");
      }
    }
  }
  out.push_back({"length_unit", "factor", {1e-3}, "the lengths are in millimetres"});
  // values: factor of swivels, factor of attitude
  out.push_back({"angle_unit", "factor", {kDegree, 1.0}, "the swivel angles are in degrees"});
  out.push_back({"angle_unit", "factor", {1.0, kDegree}, "the attitude is in degrees"});
  out.push_back({"angle_unit", "factor", {kDegree, kDegree}, "all angles are in degrees"});
  for (int c = 0; c < 6; ++c) {
    const auto convention = static_cast<EulerConvention>(c);
    if (convention == robot.euler_convention) continue;
    out.push_back({"euler_convention",
                   "convention",
                   {static_cast<double>(c)},
                   "the attitude's Euler angles are " + to_string(convention),
                   {},
                   convention});
  }
  return out;
}

DiscreteSearch find_discrete_faults(Robot& robot, Log& log) {
  DiscreteSearch search;
  const Trial as_given = try_map(robot, log, {}, kAllStarts);
  search.cost_before = search.cost_after = as_given.cost;
  if (as_given.agrees || !as_given.surprises) return search;
  // Hundreds of trials: a few of the poses tell a wrong map as well as all of them do.
  std::vector<double> at_s;
  std::optional<Log> brief = few_poses(robot, log, at_s);
  Log& tried = brief ? *brief : log;
  double cost = try_map(robot, tried, at_s, kAllStarts).cost;
  while (static_cast<int>(search.faults.size()) < kMostFaults) {
    std::optional<DiscreteFault> best;
    double best_cost = cost;
    bool best_agrees = false;
    for (const DiscreteFault& fault : discrete_faults(robot, log)) {
      Robot trial_robot = robot;
      Log trial_log = tried;
      set_right(fault, trial_robot, trial_log);
      if (silences(robot, tried, trial_log)) continue;
      // The right one comes down from the first start in a few steps.
      const Trial trial = try_map(trial_robot, trial_log, at_s, 1);
      if (trial.says_enough && trial.cost < best_cost) {
        best = fault;
        best_cost = trial.cost;
        best_agrees = trial.agrees;
      }
    }
    // The last of several faults must make the log agree; one on the way must help a great deal.
    if (!best || !(best_cost * kOrdersOfMagnitude < cost)) break;
    set_right(*best, robot, log);
    if (brief) {
      Robot scratch = robot;
      set_right(*best, scratch, *brief);
    }
    search.faults.push_back(*best);
    cost = best_cost;
    if (best_agrees) break;
  }
  if (!search.faults.empty()) search.cost_after = try_map(robot, log, {}, 1).cost;
  return search;
}

}  // namespace cdprcal
