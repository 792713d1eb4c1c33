// Direct geometrico-static problem: where does the platform hang, given the cables? (paper §3.3)
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/equilibria/equilibrium.hpp"

namespace cdprcal {

struct DirectOptions {
  double tolerance = 1e-10;  ///< balance error ÷ weight at which a pose counts as found
  int max_newton_steps = 40;
  int max_evaluations = 200;  ///< of NLopt, each start
};

/// The stable pose of a force-controlled robot: minimum of V = Σ τ l + m g z_G at constant
/// tensions. tension_N: n values ≥ 0. With `start`, Newton's method on the six balance equations
/// (eq. 6) goes first; if it fails or ends on an unstable pose, and always without `start`, NLopt
/// searches the minimum and Newton polishes it. Without `start` the poses of start_rotations are
/// tried. stable/unstable: Stability::constant_tensions_N_m. Status: found; unstable (no minimum
/// was reached, only a saddle); not_found (with the reason, e.g. tensions too weak, or one so
/// strong that it draws the platform into its pulley); invalid_geometry. Neutral counts as
/// unstable. Throws InputError for a wrong number of tensions, negative or not finite ones.
EquilibriumResult direct_from_tensions(const Robot& robot, const CableVector& tension_N,
                                       const std::optional<Pose>& start = std::nullopt,
                                       const DirectOptions& options = {});

/// The pose of a length-controlled robot: lowest centre of mass with no cable longer than
/// length_m (n values > 0, arc on the pulley included). Tensions are the multipliers. A cable that
/// would have to push hangs loose: status slack, its tension 0 and length_m its taut length.
/// As above: Newton on the Karush–Kuhn–Tucker system from `start`, else NLopt, then Newton.
/// stable/unstable: Stability::locked_lengths_N_m.
/// Status: found, slack, unstable, not_found, invalid_geometry. Throws InputError for n > 6
/// (lengths over-determine the pose), a wrong number of lengths, or lengths ≤ 0.
EquilibriumResult direct_from_lengths(const Robot& robot, const CableVector& length_m,
                                      const std::optional<Pose>& start = std::nullopt,
                                      const DirectOptions& options = {});

/// All equilibria that NLopt and Newton reach from about a dozen deterministic starts, distinct,
/// stable ones first and by rising potential (tensions) or centre of mass (lengths) within each.
/// There is no guarantee that the list is complete. Empty when none was reached.
std::vector<EquilibriumResult> all_equilibria_from_tensions(const Robot& robot,
                                                            const CableVector& tension_N,
                                                            const DirectOptions& options = {});
std::vector<EquilibriumResult> all_equilibria_from_lengths(const Robot& robot,
                                                           const CableVector& length_m,
                                                           const DirectOptions& options = {});

}  // namespace cdprcal
