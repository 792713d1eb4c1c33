// Set-points: where the platform is to rest, and the tensions that hold it there (paper §3.2.1).
// Up to five cables the tensions are commanded and lead it there; from six on its pose is, by
// lengths, and the tensions are those it is held with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/equilibria/inverse.hpp"

namespace cdprcal {

/// An equilibrium. Up to five cables of constant tensions: command them and the platform settles at
/// the pose.
struct SetPoint {
  Pose pose;
  CableVector tension_N;  ///< n values
};

struct SetPointOptions {
  TensionDistribution distribution = TensionDistribution::barycentre;
  CableVector lambda_N;  ///< n − 3 values, for given_lambda (see InverseOptions)
  std::optional<Eigen::Quaterniond> rotation;  ///< commanded, from six cables on
  /// Least distance of every tension from the robot's limits [N]; default: one σ of the load
  /// cells, so that a cable stays within its limits when its load cell is wrong by that much.
  std::optional<double> tension_margin_N;
};

/// The margin [N] that these options ask for. Throws InputError when it is negative or not finite,
/// or leaves nothing between the robot's limits.
double tension_margin_N(const Robot& robot, const SetPointOptions& options);

/// Throws InputError, "plan: the start has 3 tensions; …", unless `reading_N` of `what` has one
/// for each cable of this robot.
void require_tensions_of(const Robot& robot, const CableVector& reading_N, const std::string& what);
/// The least distance of tensions of `what` from the robot's limits [N]; throws InputError where
/// one is beyond them.
double margin_within_limits_N(const Robot& robot, const CableVector& tension_N,
                              const std::string& what);

/// Set-points of one robot: inverse geometrico-static problem (eqs A1–A3) plus a margin to the
/// limits and, up to five cables, what force control asks for: stability at constant tensions.
class SetPointSolver {
 public:
  /// Throws InputError as InverseSolver and tension_margin_N do.
  explicit SetPointSolver(const Robot& robot, const SetPointOptions& options = {});

  struct Result {
    std::optional<SetPoint> set_point;
    std::string reason;  ///< one sentence for people; empty when there is a set-point
  };
  /// The set-point at a position [m]; throws InputError when that is not finite.
  [[nodiscard]] Result at(const Vector3& position_m) const;

  /// Whether a position is inside the static workspace of appendix A, judged as force control
  /// does: some orientation is in balance there, within the limits (eq. A3) and stable at constant
  /// tensions. `rotation` is where the search starts; from six cables on it is kept.
  [[nodiscard]] bool in_workspace(const Vector3& position_m,
                                  const Eigen::Quaterniond& rotation) const;

  [[nodiscard]] const Robot& robot() const { return solver_.robot(); }
  [[nodiscard]] double margin_N() const { return margin_N_; }

 private:
  InverseSolver solver_;
  double margin_N_;
};

/// Standard deviation of the pose (position [m], world-frame rotation vector [rad]) at which the
/// platform settles when every tension is wrong by one σ of the load cells, to first order:
/// δζ = −(K + Q)⁻¹ Ξᵀ δτ. A platform on constant tensions is soft: centimetres for newtons. From
/// six cables on, when every length is wrong by one σ of the encoders: δζ = (∂l/∂ζ)⁺ δl.
Vector6 settling_deviation(const Robot& robot, const SetPoint& set_point);

/// Whether the platform stays inside the workspace when it settles one such deviation away, up or
/// down each axis: what makes a set-point safe to command before anything is calibrated.
bool survives_tension_error(const SetPointSolver& solver, const SetPoint& set_point);

}  // namespace cdprcal
