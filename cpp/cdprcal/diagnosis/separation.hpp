// Which poses to measure next, so that two effects that explain a log alike come apart.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// A pose to add to the log.
struct SeparatingPose {
  Vector3 position_m = Vector3::Zero();
  CableVector tension_N;    ///< set-points that hold it
  bool from_above = false;  ///< approached by paying out, else from below by hauling in
  double nats = 0.0;        ///< expected evidence between the two with it and those before it
};

struct Separation {
  double nats = 0.0;                  ///< expected evidence between the two by the log as it is
  std::vector<SeparatingPose> poses;  ///< the best, the next given the best …
};

/// The effect `k` of a fitted model is taken to be true at its values; what `rival` in its place
/// (with offsets and all other effects free under their priors) cannot imitate of it is evidence.
/// Poses come from a grid of equilibria in the robot's workspace, visited after the log's last
/// pose. No poses for robots whose inverse problem is not solved (fewer than 3 or more than 5
/// cables).
Separation separating_poses(const DiagnosisModel& model, std::size_t k,
                            const std::shared_ptr<const Effect>& rival, int most = 2);

}  // namespace cdprcal
