#include "cdprcal/equilibria/equilibrium.hpp"

#include <Eigen/Cholesky>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

/// A cable row that adds less than this (relative) to the others' span adds no constraint.
constexpr double kRankTolerance = 1e-10;

/// Square of at most six rows: motions that remain free.

/// diag(1, 1/scale): turns twists measured in metres into twists (m, rad).
Vector6 twist_scale(double length_scale_m) {
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(1.0 / length_scale_m);
  return scale;
}

/// Orthonormal complement of the cables' rows: Gram–Schmidt with reorthogonalisation, first over
/// the rows (of ∂l/∂δ, and what guides prevent), then over the axes, always taking the axis that is
/// farthest from the span.
template <typename Rows>
SmallSquare free_basis(const Rows& rows) {
  Eigen::Matrix<double, 6, 6> basis;
  int count = 0;
  const auto project = [&](Vector6 v) {
    for (int pass = 0; pass < 2; ++pass) {
      for (int k = 0; k < count; ++k) v -= basis.col(k).dot(v) * basis.col(k);
    }
    return v;
  };
  for (Eigen::Index i = 0; i < rows.rows() && count < 6; ++i) {
    const Vector6 row = rows.row(i).transpose();
    const Vector6 rest = project(row);
    if (rest.norm() > kRankTolerance * row.norm()) basis.col(count++) = rest.normalized();
  }
  const int rank = count;
  while (count < 6) {
    // What is left of a unit axis is 1 − Σ b², squared.
    Eigen::Index farthest = 0;
    basis.leftCols(count).rowwise().squaredNorm().minCoeff(&farthest);
    basis.col(count++) = project(Vector6::Unit(farthest)).normalized();
  }
  return basis.rightCols(6 - rank);
}

/// K_f of eq. A4 in scaled coordinates, symmetrised (at an equilibrium it is symmetric already).
SmallSquare scaled_free_stiffness(const PlatformState& state, const Matrix6& stiffness,
                                  const Vector6& scale, const TwistBasis& guided) {
  const CableJacobian rows = length_jacobian(state) * scale.asDiagonal();
  SmallSquare basis;
  if (guided.cols() == 0) {
    basis = free_basis(rows);
  } else {
    Eigen::Matrix<double, Eigen::Dynamic, 6, 0, kMaxCables + 6, 6> all(rows.rows() + guided.cols(),
                                                                       6);
    all << guided.transpose(), rows;
    basis = free_basis(all);
  }
  const Matrix6 scaled = scale.asDiagonal() * stiffness * scale.asDiagonal();
  // lazyProduct: these are too small for blocking to pay.
  const SmallSquare turned = scaled.lazyProduct(basis);
  const SmallSquare k = basis.transpose().lazyProduct(turned);
  return 0.5 * (k + k.transpose());
}

double least_eigenvalue(const SmallSquare& k) {
  if (k.rows() == 1) return k(0, 0);
  if (k.rows() == 2) {
    return 0.5 * (k(0, 0) + k(1, 1)) - std::hypot(0.5 * (k(0, 0) - k(1, 1)), k(1, 0));
  }
  return symmetric_eigenvalues(k)[0];
}

/// Cholesky in place on the lower half: positive definite exactly when every pivot is positive.
bool positive_definite(SmallSquare k) {
  if (k.rows() == 0) return true;  // no motion is left
  const double floor = 1e-12 * k.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < k.rows(); ++i) {
    if (!(k(i, i) > floor)) return false;
    for (Eigen::Index r = i + 1; r < k.rows(); ++r) {
      const double factor = k(r, i) / k(i, i);
      for (Eigen::Index c = i + 1; c <= r; ++c) k(r, c) -= factor * k(c, i);
    }
  }
  return true;
}

}  // namespace

bool stable_with_locked_lengths(const PlatformState& state, const Matrix6& stiffness,
                                double length_scale_m) {
  return positive_definite(
      scaled_free_stiffness(state, stiffness, twist_scale(length_scale_m), TwistBasis(6, 0)));
}

bool stable_with_constant_tensions(const Matrix6& stiffness, double length_scale_m) {
  const Vector6 scale = twist_scale(length_scale_m);
  return positive_definite(scale.asDiagonal() * stiffness * scale.asDiagonal());
}

Stability stability(const Robot& robot, const PlatformState& state, const CableVector& tension_N) {
  const Vector6 scale = twist_scale(characteristic_length_m(robot));
  const Matrix6 hessian = stiffness(robot, state, tension_N);
  Stability result;
  const SmallSquare free = scaled_free_stiffness(state, hessian, scale, guided_basis(robot));
  result.locked_lengths_N_m =
      free.rows() == 0 ? std::numeric_limits<double>::infinity() : least_eigenvalue(free);
  const Matrix6 scaled = scale.asDiagonal() * hessian * scale.asDiagonal();
  if (is_guided(robot)) {
    const TwistBasis basis = motion_basis(robot);
    const SmallSquare k = basis.transpose() * scaled * basis;
    result.constant_tensions_N_m = least_eigenvalue(0.5 * (k + k.transpose()));
    return result;
  }
  const Matrix6 symmetric = 0.5 * (scaled + scaled.transpose());
  result.constant_tensions_N_m = symmetric_eigenvalues(symmetric)[0];
  return result;
}

double balance_error_N(const Vector6& wrench_residual, double length_scale_m) {
  return std::sqrt(wrench_residual.head<3>().squaredNorm() +
                   wrench_residual.tail<3>().squaredNorm() / (length_scale_m * length_scale_m));
}

double unbalanced_N(const Robot& robot, const PlatformState& state, const CableVector& tension_N) {
  const Vector6 residual = wrench_residual(robot, state, tension_N);
  return balance_error_N(FreeMotion(robot).of(residual), characteristic_length_m(robot));
}

const char* to_string(EquilibriumStatus status) {
  switch (status) {
    case EquilibriumStatus::found:
      return "found";
    case EquilibriumStatus::obstructed:
      return "obstructed";
    case EquilibriumStatus::unstable:
      return "unstable";
    case EquilibriumStatus::infeasible:
      return "infeasible";
    case EquilibriumStatus::slack:
      return "slack";
    case EquilibriumStatus::not_found:
      return "not_found";
    case EquilibriumStatus::invalid_geometry:
      return "invalid_geometry";
  }
  return "unknown";
}

}  // namespace cdprcal
