// Inverse geometrico-static problem: position → orientation and tensions (eqs A1–A3). From six
// cables on, fewer where guides hold, the orientation is commanded, not found, and tensions alone
// are to be chosen (holds_orientation).
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/equilibria/distribution.hpp"
#include "cdprcal/equilibria/equilibrium.hpp"

namespace cdprcal {

/// Which stiffness must be positive for a pose to count as stable (see Stability).
enum class StabilityNotion { locked_lengths, constant_tensions };

struct InverseOptions {
  TensionDistribution distribution = TensionDistribution::barycentre;
  CableVector lambda_N;  ///< n − 3 values, for given_lambda (see TensionFamily); n − 6 from six on
  /// Commanded, from six cables on; default: held_orientation.
  std::optional<Eigen::Quaterniond> rotation;
  StabilityNotion stability = StabilityNotion::locked_lengths;  ///< the paper's (eq. A4)
  double tolerance = 1e-10;  ///< moment error ÷ (weight · characteristic length)
  int max_newton_steps = 20;
  int max_evaluations = 300;  ///< of NLopt, each start
};

/// An equilibrium with what the inverse problem adds to it.
struct InverseResult : EquilibriumResult {
  CableVector lambda_N;    ///< n − 3 values; n − 6 from six cables on
  double margin_N = kNaN;  ///< tension_margin_N: negative when infeasible
};

/// Solves many positions of one robot. Checks the problem once; what follows does not allocate.
class InverseSolver {
 public:
  /// Throws InputError for n < 3 (a position cannot be chosen freely), fewer cables than a guided
  /// platform has freedoms or over kMostFree more, a rotation of fewer than six
  /// cables, and unless 0 ≤ τ_min < τ_max < ∞ and λ has n − 3 values (n − 6 from six cables on).
  InverseSolver(Robot robot, const InverseOptions& options);

  struct Point {
    EquilibriumStatus status = EquilibriumStatus::not_found;
    Eigen::Quaterniond rotation;  ///< meaningful when balanced
    CableVector tension_N;
    double margin_N = kNaN;
    int steps = 0;  ///< Newton steps taken
  };

  /// Newton on eq. A1 from a rotation that is close (a solved neighbour). Status: found,
  /// obstructed, infeasible (limits, eq. A3), unstable (eq. A4), not_found, invalid_geometry. From
  /// six cables on the rotation is kept: status found where it is wrench-feasible within the
  /// limits.
  [[nodiscard]] Point continue_from(const Vector3& position_m,
                                    const Eigen::Quaterniond& rotation) const;

  /// From nothing: NLopt minimises the squared moment (eq. A1) from several orientations, Newton
  /// polishes. The first found one wins; otherwise the best of the others, by the order of
  /// EquilibriumStatus. `evaluations`, when given, is increased by what it cost. From six cables on
  /// at options().rotation.
  [[nodiscard]] Point solve(const Vector3& position_m, int* evaluations = nullptr) const;

  /// NLopt, then Newton, from one rotation.
  [[nodiscard]] Point search_from(const Vector3& position_m, const Eigen::Quaterniond& rotation,
                                  int* evaluations = nullptr) const;

  /// Everything about a point, for people.
  [[nodiscard]] InverseResult describe(const Vector3& position_m, const Point& point) const;

  [[nodiscard]] const Robot& robot() const { return robot_; }
  /// As given, with the rotation that is commanded from six cables on.
  [[nodiscard]] const InverseOptions& options() const { return options_; }

  /// Left side of eq. A1 [Nm], world axes, about P, and its derivatives (Nm/rad; Nm/m when asked).
  struct Moment {
    bool valid = false;
    Vector3 value;
    Matrix3 by_rotation;
    DistributedTension tension;
  };
  [[nodiscard]] Moment moment(const PlatformState& state) const;

 private:
  void classify(const Pose& pose, const PlatformState& state, Point& point) const;
  [[nodiscard]] Point held(const Vector3& position_m, const Eigen::Quaterniond& rotation) const;

  Robot robot_;
  InverseOptions options_;
  double length_scale_m_;
  double moment_scale_Nm_;
  bool holds_;  ///< holds_orientation(robot_)
};

/// One position. With `start` Newton goes first, NLopt from there if it fails; without, see
/// InverseSolver::solve. Throws InputError like InverseSolver and for a position that is not
/// finite.
InverseResult inverse(const Robot& robot, const Vector3& position_m,
                      const InverseOptions& options = {},
                      const std::optional<Eigen::Quaterniond>& start = std::nullopt);

/// All distinct equilibria at a position that about a dozen starts reach: found ones first, by
/// falling tension margin.
std::vector<InverseResult> all_equilibria_at(const Robot& robot, const Vector3& position_m,
                                             const InverseOptions& options = {});

}  // namespace cdprcal
