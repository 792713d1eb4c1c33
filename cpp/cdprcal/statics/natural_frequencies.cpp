#include "cdprcal/statics/natural_frequencies.hpp"

#include <Eigen/LU>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {
namespace {

/// Modes of the motions in the span of `basis` (6×m).
Modes modes_in(const ModeShapes& basis, const Matrix6& stiffness, const Matrix6& mass) {
  Modes modes;
  modes.natural_frequency_hz.resize(basis.cols());
  modes.shape.resize(6, basis.cols());
  if (basis.cols() == 0) return modes;
  const SmallSquare k = basis.transpose() * stiffness * basis;
  const SmallSquare m = basis.transpose() * mass * basis;
  const SymmetricEigen<SmallSquare> eigen =
      symmetric_eigen<SmallSquare>(0.5 * (k + k.transpose()), m);
  modes.natural_frequency_hz = eigen.eigenvalues().unaryExpr(
      [](double square) { return square >= 0.0 ? std::sqrt(square) / (2.0 * kPi) : kNaN; });
  modes.shape = basis * eigen.eigenvectors();
  return modes;
}

/// Motions that neither a cable's length nor a guide prevents.
ModeShapes free_basis(const Robot& robot, const PlatformState& state) {
  if (!is_guided(robot)) return free_motion_basis(state);
  const TwistBasis motion = motion_basis(robot);
  const Eigen::FullPivLU<Eigen::MatrixXd> lengths(length_jacobian(state) * motion);
  if (lengths.dimensionOfKernel() == 0) return ModeShapes(6, 0);
  return motion * lengths.kernel();
}

}  // namespace

Modes constant_tension_modes(const Robot& robot, const PlatformState& state,
                             const CableVector& tension_N) {
  return modes_in(motion_basis(robot), stiffness(robot, state, tension_N),
                  mass_matrix(robot, state));
}

Modes free_motion_modes(const Robot& robot, const PlatformState& state,
                        const CableVector& tension_N) {
  return modes_in(free_basis(robot, state), stiffness(robot, state, tension_N),
                  mass_matrix(robot, state));
}

}  // namespace cdprcal
