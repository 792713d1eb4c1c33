#include "cdprcal/statics/tension.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// Reciprocal condition number below which a solve would return noise.
constexpr double kSingular = 1e-12;

/// A⁻¹ by LU with pivoting; false where A is singular. Of fixed size: several times as fast.
template <int n>
bool invert_sized(const CableMatrix& a, CableMatrix& inverse) {
  using Square = Eigen::Matrix<double, n, n>;
  const Square system = a;
  const Square inverted = Eigen::PartialPivLU<Square>(system).inverse();
  const auto norm = [](const Square& m) { return m.cwiseAbs().colwise().sum().maxCoeff(); };
  inverse = inverted;
  return norm(system) * norm(inverted) < 1.0 / kSingular;
}

bool invert(const CableMatrix& a, CableMatrix& inverse) {
  switch (a.rows()) {
    case 1:
      return invert_sized<1>(a, inverse);
    case 2:
      return invert_sized<2>(a, inverse);
    case 3:
      return invert_sized<3>(a, inverse);
    case 4:
      return invert_sized<4>(a, inverse);
    case 5:
      return invert_sized<5>(a, inverse);
    case 6:
      return invert_sized<6>(a, inverse);
    default:
      return false;
  }
}

}  // namespace

std::vector<WrenchRow> left_inverse_rows(int cable_count) {
  using R = WrenchRow;
  // Gravity first, then the directions that a suspended platform balances by tension differences.
  constexpr std::array<R, 6> order{R::force_z,    R::force_x,     R::force_y,
                                   R::moment_yaw, R::moment_roll, R::moment_pitch};
  if (cable_count < 1 || cable_count > 6) {
    throw InputError("the left inverse of eq. 12 needs 1 to 6 cables, not " +
                     std::to_string(cable_count) + "; use least-squares tensions");
  }
  std::vector<R> rows(order.begin(), order.begin() + cable_count);
  std::sort(rows.begin(), rows.end());
  return rows;
}

TensionModel tensions_left_inverse(const Robot& robot, const PlatformState& state,
                                   const std::vector<WrenchRow>& rows) {
  const int n = state.cable_count;
  if (static_cast<int>(rows.size()) != n) {
    throw InputError("the left inverse needs as many wrench rows as cables");
  }
  TensionModel model;
  if (!state.valid) return model;
  const Vector3 angles = euler_from_rotation(state.rotation, robot.euler_convention);
  const EulerRateDerivative rates = euler_rate_derivative(angles, robot.euler_convention);
  const WrenchMatrix structure = structure_matrix(state);
  const Vector6 gravity = gravity_wrench(robot, state);

  // Dᵀ applied to wrenches: the force rows stay, moment row a becomes (column a of H)·moment.
  CableMatrix system(n, n);
  CableVector load(n);
  for (int r = 0; r < n; ++r) {
    const int row = static_cast<int>(rows[r]);
    if (row < 3) {
      system.row(r) = structure.row(row);
      load[r] = gravity[row];
    } else {
      const Vector3 axis = rates.rate_matrix.col(row - 3);
      system.row(r) = axis.transpose() * structure.bottomRows<3>();
      load[r] = axis.dot(gravity.tail<3>());
    }
  }
  CableMatrix inverse;
  if (!invert(system, inverse)) return model;
  model.tension_N = inverse.lazyProduct(load);

  // A τ = b  ⇒  A ∂τ = ∂b − ∂A τ = −∂(rows of Dᵀ(Ξᵀτ − f)) at constant τ.
  const Matrix6 balance_by_twist = stiffness(robot, state, model.tension_N);
  const Vector3 moment = (structure * model.tension_N - gravity).tail<3>();
  CableJacobian right(n, 6);
  for (int r = 0; r < n; ++r) {
    const int row = static_cast<int>(rows[r]);
    if (row < 3) {
      right.row(r) = -balance_by_twist.row(row);
    } else {
      const Vector3 axis = rates.rate_matrix.col(row - 3);
      right.row(r) = -axis.transpose() * balance_by_twist.bottomRows<3>();
      right.row(r).tail<3>() -= moment.transpose() * rates.column_derivative[row - 3];
    }
  }
  model.by_twist = inverse.lazyProduct(right);
  model.valid = model.tension_N.allFinite() && model.by_twist.allFinite();
  return model;
}

TensionModel tensions_least_squares(const Robot& robot, const PlatformState& state) {
  const int n = state.cable_count;
  TensionModel model;
  if (n > 6 || !state.valid) return model;
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(1.0 / characteristic_length_m(robot));
  const WrenchMatrix a = scale.asDiagonal() * structure_matrix(state);
  const Vector6 b = scale.asDiagonal() * gravity_wrench(robot, state);
  Eigen::ColPivHouseholderQR<WrenchMatrix> qr;
  qr.setThreshold(kSingular).compute(a);
  if (qr.rank() < n) return model;
  model.tension_N = qr.solve(b);

  // τ = A⁺b: ∂τ = −A⁺ (∂A τ − ∂b) − (AᵀA)⁻¹ ∂Aᵀ (A τ − b)   (Golub & Pereyra 1973)
  const Vector6 residual = a * model.tension_N - b;
  const Matrix6 balance_by_twist = scale.asDiagonal() * stiffness(robot, state, model.tension_N);
  CableJacobian normal_part(n, 6);
  // Row i of ∂Aᵀ r: the derivative of column ξ_i dotted with the (scaled) residual.
  const Vector6 dual = scale.cwiseProduct(residual);
  for (int i = 0; i < n; ++i) {
    CableVector unit = CableVector::Zero(n);
    unit[i] = 1.0;
    normal_part.row(i) = dual.transpose() * tension_stiffness(state, unit);
  }
  // (AᵀA)⁻¹ = P R⁻¹ R⁻ᵀ Pᵀ from the factors of A P = Q R, without squaring the condition number.
  const CableMatrix upper = qr.matrixR().topLeftCorner(n, n);
  const auto triangle = upper.triangularView<Eigen::Upper>();
  const CableJacobian permuted = qr.colsPermutation().transpose() * normal_part;
  const CableJacobian forward = triangle.transpose().solve(permuted);
  const CableJacobian back = triangle.solve(forward);
  const CableJacobian curvature_part = qr.colsPermutation() * back;
  model.by_twist = -(qr.solve(balance_by_twist) + curvature_part);
  model.valid = model.tension_N.allFinite() && model.by_twist.allFinite();
  return model;
}

}  // namespace cdprcal
