// What the ideal robot would do on the way between two tension set-points.
//
// The winches are blind at start-up, but the ideal equilibrium of every set-point is known from the
// direct problem. It says how fast each cable will run, how long a transition must take, and how
// the platform answers the winches: that is all the controller is tuned by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// The ideal robot in equilibrium at one point of the way.
struct PathNode {
  Pose pose;
  /// −∂l/∂τ of the equilibrium, J (K+Q)⁻¹ Jᵀ [m/N]: how much cable a lower tension lets out.
  CableMatrix flexibility_m_N;
  /// J M⁻¹ Jᵀ [1/kg]: how the free platform would accelerate the cables.
  CableMatrix mobility_1_kg;
  double slowest_rad_s = 0.0;  ///< lowest natural frequency under constant tensions
  double mean_length_m = 0.0;
};

struct PathLeg {
  std::vector<PathNode> nodes;  ///< evenly spaced in s
  CableVector change_N;         ///< τ_b − τ_a
  /// Interpolated between the nodes; s is clamped to [0, 1].
  [[nodiscard]] CableMatrix flexibility_m_N(double s) const;
  [[nodiscard]] CableMatrix mobility_1_kg(double s) const;
  /// dl/ds, s in [0, 1]: how the cables run along the leg.
  [[nodiscard]] CableVector length_by_fraction_m(double s) const {
    return -(flexibility_m_N(s) * change_N);
  }
  [[nodiscard]] double slowest_rad_s() const;
  [[nodiscard]] double mean_length_m() const;
};

/// Follows the equilibrium from tensions a to b [N] from the one closest to `start` (the first
/// found without). On failure the reason is set and the leg ends where the equilibrium was lost.
struct PathResult {
  bool found = false;
  std::string reason;
  PathLeg leg;
};
PathResult follow_equilibrium(const Robot& robot, const CableVector& a_N, const CableVector& b_N,
                              const std::optional<Pose>& start = std::nullopt, int nodes = 9);

/// Shortest time [s] of a fifth-degree transition along a leg: no cable is expected to run faster
/// than `velocity_m_s`, and the slowest mode of the platform has time for one period and a half,
/// below which the transition itself would excite it.
double transition_time_s(const PathLeg& leg, double velocity_m_s);

}  // namespace cdprcal
