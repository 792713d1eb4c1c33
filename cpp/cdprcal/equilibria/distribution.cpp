#include "cdprcal/equilibria/distribution.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "cdprcal/equilibria/polytope.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/statics/one_a_cable.hpp"

namespace cdprcal {
namespace {

/// Below this (relative to well-spread directions) the force rows do not span space.
constexpr double kSingular = 1e-10;

using Directions = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 5>;

/// A, its right inverse and the null-space basis.
struct ForceRows {
  bool valid = false;
  Directions a;              ///< A (3×n): cable directions
  Matrix3 gram_inverse;      ///< (A Aᵀ)⁻¹
  CableRows3 right_inverse;  ///< A⁺ = Aᵀ (A Aᵀ)⁻¹
  NullBasis basis;           ///< N
};

ForceRows force_rows(const PlatformState& state) {
  ForceRows rows;
  const int n = state.cable_count;
  const int k = n - 3;
  rows.a.resize(3, n);
  for (int i = 0; i < n; ++i) rows.a.col(i) = state.cable[i].direction;
  Matrix3 gram = Matrix3::Zero();
  for (int i = 0; i < n; ++i) gram += rows.a.col(i) * rows.a.col(i).transpose();
  const double determinant = gram.determinant();
  if (!(determinant > kSingular)) return rows;
  rows.gram_inverse = gram.inverse();
  rows.right_inverse = rows.a.transpose() * rows.gram_inverse;
  // N = P E L⁻ᵀ with P = I − A⁺A, E the last n−3 unit vectors and L Lᵀ = Eᵀ P E.
  rows.basis.resize(n, k);
  for (int c = 0; c < k; ++c) {
    rows.basis.col(c) = -rows.right_inverse * rows.a.col(3 + c);
    rows.basis(3 + c, c) += 1.0;
  }
  for (int c = 0; c < k; ++c) {
    // Cholesky from the right order: column c must vanish in the rows of the columns before it.
    for (int before = 0; before < c; ++before) {
      rows.basis.col(c) -= rows.basis.col(before).dot(rows.basis.col(c)) * rows.basis.col(before);
    }
    const double norm = rows.basis.col(c).norm();
    if (!(norm > std::sqrt(kSingular))) return rows;
    rows.basis.col(c) /= norm;
  }
  rows.valid = true;
  return rows;
}

/// ∂t of every cable along a turn about each axis.
struct DirectionMotion {
  std::array<Matrix3, 5> by;

  /// ∂A v.
  [[nodiscard]] Matrix3 times(const double* v, int n) const {
    Matrix3 sum = v[0] * by[0];
    for (int i = 1; i < n; ++i) sum += v[i] * by[i];
    return sum;
  }
};

DirectionMotion direction_motion(const PlatformState& state) {
  DirectionMotion motion;
  for (int i = 0; i < state.cable_count; ++i) {
    const Matrix3 t_by_q = direction_by_q(state.cable[i]);
    for (int c = 0; c < 3; ++c) {  // T (e_c × a′)
      motion.by[i].col(c) = t_by_q * Vector3::Unit(c).cross(state.anchor_arm_m[i]);
    }
  }
  return motion;
}

/// τ = w + Aᵀy, A τ = g: the tensions closest to w, and ∂τ.
CableVector closest_to(const Robot& robot, const ForceRows& rows, const CableVector& w,
                       const DirectionMotion& motion, CableRows3& by) {
  const int n = static_cast<int>(rows.a.cols());
  const Vector3 y = rows.gram_inverse * (robot.gravity_force_N() - rows.a * w);
  const CableVector tension = w + rows.a.transpose() * y;
  // ∂τ = ∂Aᵀy + Aᵀ∂y and A∂τ = −∂A τ.
  by.resize(n, 3);
  for (int i = 0; i < n; ++i) by.row(i) = y.transpose() * motion.by[i];
  const Matrix3 lack = motion.times(tension.data(), n) + rows.a * by;
  by -= rows.right_inverse * lack;
  return tension;
}

/// ∂N_c = −A⁺∂A N_c plus the turn within the null space that keeps the rule of TensionFamily.
std::array<CableRows3, 2> basis_motion(const ForceRows& rows, const DirectionMotion& motion) {
  const int n = static_cast<int>(rows.a.cols());
  std::array<CableRows3, 2> by;
  for (int c = 0; c < n - 3; ++c) {
    by[c] = -rows.right_inverse * motion.times(rows.basis.col(c).data(), n);
  }
  if (n == 5) {  // row of cable 4 stays zero in column 2
    const Eigen::RowVector3d turn = -by[1].row(3) / rows.basis(3, 0);
    by[1] += rows.basis.col(0) * turn;
    by[0] -= rows.basis.col(1) * turn;
  }
  return by;
}

}  // namespace

TensionFamily force_family(const Robot& robot, const PlatformState& state) {
  TensionFamily family;
  if (!state.valid || state.cable_count < 3 || state.cable_count > 5) return family;
  const ForceRows rows = force_rows(state);
  if (!rows.valid) return family;
  family.valid = true;
  family.minimum_norm_N = rows.right_inverse * robot.gravity_force_N();
  family.basis = rows.basis;
  return family;
}

CableVector lambda_of(const Robot& robot, const PlatformState& state,
                      const CableVector& tension_N) {
  require_one_a_cable(tension_N, state.cable_count);
  const TensionFamily family =
      holds_orientation(robot) ? wrench_family(robot, state) : force_family(robot, state);
  return family.valid ? CableVector(family.basis.transpose() * tension_N) : CableVector();
}

DistributedTension distribute(const Robot& robot, const PlatformState& state,
                              TensionDistribution distribution, const CableVector& given_lambda_N) {
  DistributedTension result;
  const ForceRows rows = force_rows(state);
  if (!rows.valid) return result;
  const int n = state.cable_count;
  const int k = n - 3;
  const DirectionMotion motion = direction_motion(state);
  CableVector reference = CableVector::Zero(n);
  if (distribution == TensionDistribution::mid_range) {
    reference.setConstant(0.5 * (robot.tension_min_N + robot.tension_max_N));
  }
  CableRows3 by;
  CableVector tension = closest_to(robot, rows, reference, motion, by);
  if (k > 0 && (distribution == TensionDistribution::barycentre ||
                distribution == TensionDistribution::given_lambda)) {
    const std::array<CableRows3, 2> basis_by = basis_motion(rows, motion);
    Eigen::Vector2d lambda = Eigen::Vector2d::Zero();
    std::array<Eigen::Vector2d, 3> lambda_by;
    lambda_by.fill(Eigen::Vector2d::Zero());
    if (distribution == TensionDistribution::given_lambda) {
      lambda.head(k) = given_lambda_N;
    } else {
      MovingFamily family;
      family.cable_count = n;
      family.freedom = k;
      family.directions = 3;
      family.particular_N = tension;
      family.basis = rows.basis;
      for (int d = 0; d < 3; ++d) {
        family.particular_by[d].head(n) = by.col(d);
        for (int c = 0; c < k; ++c) family.basis_by[d].col(c).head(n) = basis_by[c].col(d);
        if (k == 1) family.basis_by[d].col(1).setZero();
      }
      const Barycentre centre = barycentre(family, robot.tension_min_N, robot.tension_max_N);
      result.polytope_exists = centre.exists;
      lambda = centre.lambda_N;
      lambda_by = centre.by;
    }
    for (int c = 0; c < k; ++c) {
      tension += lambda[c] * rows.basis.col(c);
      by += lambda[c] * basis_by[c];
      for (int d = 0; d < 3; ++d) by.col(d) += lambda_by[d][c] * rows.basis.col(c);
    }
  }
  result.tension_N = tension;
  result.lambda_N = rows.basis.transpose() * tension;
  result.by_rotation = by;
  result.valid = tension.allFinite();
  return result;
}

double tension_margin_N(const Robot& robot, const CableVector& tension_N) {
  require_one_a_cable(tension_N, robot.cable_count());
  return std::min((tension_N.array() - robot.tension_min_N).minCoeff(),
                  (robot.tension_max_N - tension_N.array()).minCoeff());
}

TensionDistribution parse_tension_distribution(const std::string& name) {
  if (name == "barycentre") return TensionDistribution::barycentre;
  if (name == "minimum_norm") return TensionDistribution::minimum_norm;
  if (name == "mid_range") return TensionDistribution::mid_range;
  if (name == "given_lambda") return TensionDistribution::given_lambda;
  throw InputError("tension distribution \"" + name +
                   "\": use barycentre, minimum_norm, mid_range or given_lambda");
}

const char* to_string(TensionDistribution distribution) {
  switch (distribution) {
    case TensionDistribution::barycentre:
      return "barycentre";
    case TensionDistribution::minimum_norm:
      return "minimum_norm";
    case TensionDistribution::mid_range:
      return "mid_range";
    case TensionDistribution::given_lambda:
      return "given_lambda";
  }
  return "unknown";
}

}  // namespace cdprcal
