#include "cdprcal/evidence/checks.hpp"

#include <algorithm>
#include <numeric>

#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Which share of the rests is at places of its own. Of two at one place the second reads the same
/// once more, which tells the noise and nothing of the model.
double share_of_places(const DiagnosisModel& model) {
  constexpr double kSamePlace = 0.01;  // of the robot's size, and in turns as far at its rim
  const double near_m = kSamePlace * robot_size_m(model.robot);
  double rests = 0.0, places = 0.0;
  for (const DiagnosisRun& run : model.runs) {
    std::vector<Pose> seen;
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      if (is_moving(run.measurements[i])) continue;
      rests += 1.0;
      const auto here = [&](const Pose& other) {
        const Vector6 apart = minus(run.poses[i], other);
        return apart.head<3>().norm() < near_m && apart.tail<3>().norm() < kSamePlace;
      };
      if (!std::ranges::any_of(seen, here)) seen.push_back(run.poses[i]);
    }
    places += static_cast<double>(seen.size());
  }
  return rests > 0.0 ? places / rests : 1.0;
}

double correlation_in_motion(const DiagnosisModel& model, const DiagnosisSystem& system) {
  double products = 0.0, squares = 0.0;
  Eigen::VectorXd last;
  if (!system.valid) return 0.0;
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const Measurement& m = model.runs[pose.run].measurements[pose.pose];
    if (!is_moving(m)) {
      last.resize(0);
      continue;
    }
    const Eigen::VectorXd rows = system.free_residual.segment(pose.begin, pose.size);
    if (rows.size() == last.size()) {
      products += rows.dot(last);
      squares += 0.5 * (rows.squaredNorm() + last.squaredNorm());
    }
    last = rows;
  }
  return squares > 0.0 ? products / squares : 0.0;
}

}  // namespace

double motion_correlation(const DiagnosisModel& model) {
  return correlation_in_motion(model, linearise(model));
}

Checks checks_of(const DiagnosisModel& model) {
  Checks out;
  const DiagnosisSystem system = linearise(model);
  for (int o = 0; o < system.layout.offsets; ++o) {
    if (system.by_common.col(o).norm() > 0.0) ++out.constants;
  }
  // Of the rests, or of the samples in motion where nothing rested: a sample beside one rest reads
  // the same once more.
  const NoiseLevels freedom = channel_sums(model).freedom;
  const auto moving = freedom.begin() + kRestGroups;
  out.readings = std::max(share_of_places(model) * std::accumulate(freedom.begin(), moving, 0.0),
                          std::accumulate(moving, freedom.end(), 0.0));
  const auto by_samples = [](const DiagnosisRun& run) {
    return std::ranges::all_of(run.measurements,
                               [](const Measurement& m) { return is_moving(m) && !m.moves(); });
  };
  if (std::ranges::any_of(model.runs, by_samples))
    out.shared = correlation_in_motion(model, system);
  return out;
}

DiagnosisModel with_uncertain_noise(DiagnosisModel model) {
  constexpr double kLeastFreedom = 3.0;  // below, t has no variance
  const ChannelSums sums = channel_sums(model);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (sums.freedom[c] < 1.0 || !(model.noise[c] > model.floor[c])) continue;
    const double freedom = std::max(kLeastFreedom, sums.freedom[c]);
    model.noise[c] *= std::sqrt(freedom / (freedom - 2.0));
  }
  return model;
}

std::string too_little(const Checks& checks) {
  if (checks.shared > kMostShared) {
    return "too little to say: what rests there are leave the pose open, and samples in motion "
           "share their errors with their neighbours; measure at more rests, more varied";
  }
  return printed(
      "too little to say: once the poses are fitted, %.0f readings are left to check the model by, "
      "and %d constants of the sensors to tell; measure at more rests, or rest longer where "
      "cdprcal check finds fewer than there were",
      checks.readings, checks.constants);
}

}  // namespace cdprcal
