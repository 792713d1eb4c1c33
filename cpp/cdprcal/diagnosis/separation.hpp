// Which poses to measure next, so that two effects that explain a log alike come apart.
#pragma once

#include <optional>

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

/// Imitating this share of a signature is doing the same: then the prior alone tells them apart.
inline constexpr double kSame = 0.98;
/// Within so much evidence [nat] two effects cannot be told apart; nor within three times as much
/// where one imitates so large a share of what the other does.
inline constexpr double kRivalNats = 3.0, kRivalShare = 0.8;
/// Whether an effect is told from another by `nats` of evidence (nothing: that could not be
/// fitted), which imitates `share` of its signature.
inline bool told_apart(std::optional<double> nats, double share, double rival_nats = kRivalNats,
                       double rival_share = kRivalShare) {
  if (share > kSame || (nats && *nats < rival_nats)) return false;
  return share <= rival_share || (nats && *nats > 3.0 * rival_nats);
}

/// A rest that a run may still have.
struct OfferedRest {
  Pose pose;
  CableVector tension_N;
};

/// Expected evidence between an effect and its rival [nat]: by the log so far, with each of some
/// stops, and with all of them.
struct StopSeparation {
  double nats = 0.0;
  std::vector<double> nats_with;
  double nats_with_all = 0.0;
  bool apart_with_all = false;  ///< told_apart, then
};
/// As separating_poses, of stops to go to from the last pose of the first run: cables turn as they
/// must on the straight way there.
StopSeparation separation_by_stops(const DiagnosisModel& model, std::size_t k,
                                   const std::shared_ptr<const Effect>& rival,
                                   const std::vector<OfferedRest>& stops);

}  // namespace cdprcal
