#include "cdprcal/equilibria/wrench_distribution.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/polytope.hpp"
#include "cdprcal/statics/tension.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {
namespace {

/// Below this (pivot against the largest one, moments as arms of one metre's worth of force) the
/// cables do not hold all six directions.
constexpr double kNoRank = 1e-10;
/// How much of a cable's tension must be free for the rule of N to hold on to it.
constexpr double kFree = 1e-3;

/// f numbers, and f×n of them.
using FreeVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;
using FreeRows =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxCables>;

/// X, its Gram matrix's factor and its null space.
struct WrenchRows {
  bool valid = false;
  FreeRows x;                    ///< moments divided by the platform's size
  Eigen::LLT<SmallSquare> gram;  ///< of X Xᵀ
  TwistBasis scaled_basis;       ///< B, of wrenches whose moments are not divided
  FreeVector load;               ///< f, scaled alike
  [[nodiscard]] CableVector least_norm(const FreeVector& wrench) const {
    return x.transpose() * gram.solve(wrench);
  }
  [[nodiscard]] FreeVector reduced(const Vector6& wrench) const {
    return scaled_basis.transpose() * wrench;
  }
};

WrenchRows wrench_rows(const Robot& robot, const PlatformState& state) {
  WrenchRows rows;
  const int n = state.cable_count;
  const bool few = n < cables_that_hold(robot) || n - cables_that_hold(robot) > kMostFree;
  if (!state.valid || few) return rows;
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(1.0 / characteristic_length_m(robot));
  rows.scaled_basis = scale.asDiagonal() * motion_basis(robot);
  rows.x = rows.scaled_basis.transpose() * structure_matrix(state);
  rows.load = rows.reduced(gravity_wrench(robot, state));
  const SmallSquare gram = rows.x * rows.x.transpose();
  rows.gram.compute(gram);
  if (rows.gram.info() != Eigen::Success) return rows;
  const auto pivots = rows.gram.matrixLLT().diagonal().array().square();
  rows.valid = pivots.minCoeff() > kNoRank * pivots.maxCoeff();
  return rows;
}

/// N, orthonormal, whose column c belongs to the cable of `lead`; false when they do not lead.
bool basis_led_by(const WrenchRows& rows, const std::array<int, 2>& lead, NullBasis& basis) {
  const auto n = rows.x.cols();
  basis.resize(n, n - rows.x.rows());
  for (Eigen::Index c = 0; c < basis.cols(); ++c) {
    basis.col(c) = -rows.least_norm(rows.x.col(lead[c]));
    basis(lead[c], c) += 1.0;
    for (Eigen::Index before = 0; before < c; ++before) {
      basis.col(c) -= basis.col(before).dot(basis.col(c)) * basis.col(before);
    }
    const double norm = basis.col(c).norm();
    if (!(norm > kFree)) return false;
    basis.col(c) /= norm;
  }
  return true;
}

bool null_basis(const WrenchRows& rows, NullBasis& basis) {
  const int n = static_cast<int>(rows.x.cols());
  const int held = static_cast<int>(rows.x.rows());
  if (basis_led_by(rows, {held, held + 1}, basis)) return true;
  for (int a = n - 1; a >= 0; --a) {
    for (int b = a - 1; b >= 0; --b) {
      if (basis_led_by(rows, {b, a}, basis)) return true;
    }
  }
  return false;
}

DistributedTension distributed(const Robot& robot, const WrenchRows& rows,
                               TensionDistribution distribution, const CableVector& given_lambda_N,
                               bool nearest_miss) {
  DistributedTension result;
  NullBasis basis;
  if (!rows.valid || !null_basis(rows, basis)) return result;
  const Eigen::Index free = basis.cols();
  CableVector tension = rows.least_norm(rows.load);
  CableVector lambda = CableVector::Zero(free);
  switch (distribution) {
    case TensionDistribution::minimum_norm:
      break;
    case TensionDistribution::given_lambda:
      lambda = given_lambda_N;
      break;
    case TensionDistribution::mid_range:
      lambda =
          basis.transpose() *
          CableVector::Constant(tension.size(), 0.5 * (robot.tension_min_N + robot.tension_max_N));
      break;
    case TensionDistribution::barycentre:
      if (free > 0) {
        MovingFamily family;
        family.cable_count = static_cast<int>(tension.size());
        family.freedom = static_cast<int>(free);
        family.particular_N = tension;
        family.basis = basis;
        const Barycentre centre =
            barycentre(family, robot.tension_min_N, robot.tension_max_N, nearest_miss);
        result.polytope_exists = centre.exists;
        lambda = centre.lambda_N.head(free);
      }
      break;
  }
  if (free > 0) tension += basis * lambda;
  result.tension_N = tension;
  result.lambda_N = lambda;
  result.valid = tension.allFinite();
  return result;
}

/// A lattice in the middle of where the platform may be: between the pulleys, and below the highest
/// by as much as they are apart unless they are at different heights themselves.
std::vector<Vector3> middle_lattice(const Robot& robot) {
  auto [low, high] = pulley_box(robot);
  const double side = (high - low).head<2>().maxCoeff();
  if (high.z() - low.z() < 0.5 * side) low.z() = high.z() - side;
  std::vector<Vector3> lattice;
  for (int k = 0; k < 27; ++k) {
    const Vector3 share(0.25 + 0.25 * (k % 3), 0.25 + 0.25 * (k / 3 % 3), 0.25 + 0.25 * (k / 9));
    lattice.emplace_back(low + share.cwiseProduct(high - low));
  }
  return lattice;
}

/// How good an orientation is: places that are feasible, then the sum of their margins [N].
struct Score {
  int places = 0;
  double margin_N = 0.0;
  [[nodiscard]] bool better_than(const Score& other) const {
    return places != other.places ? places > other.places : margin_N > other.margin_N;
  }
};

Score score_of(const Robot& robot, const std::vector<Vector3>& lattice,
               const Eigen::Quaterniond& rotation) {
  Score score;
  for (const Vector3& position_m : lattice) {
    const PlatformState state = platform_state(robot, on_motion(robot, {position_m, rotation}));
    const DistributedTension tension =
        distributed(robot, wrench_rows(robot, state), TensionDistribution::barycentre, {}, false);
    if (!tension.valid || !tension.polytope_exists) continue;
    const double margin_N = tension_margin_N(robot, tension.tension_N);
    if (!(margin_N >= 0.0)) continue;
    ++score.places;
    score.margin_N += margin_N;
  }
  return score;
}

}  // namespace

TensionFamily wrench_family(const Robot& robot, const PlatformState& state) {
  TensionFamily family;
  const WrenchRows rows = wrench_rows(robot, state);
  if (!rows.valid) return family;
  family.valid = null_basis(rows, family.basis);
  family.minimum_norm_N = rows.least_norm(rows.load);
  return family;
}

DistributedTension distribute_wrench(const Robot& robot, const PlatformState& state,
                                     TensionDistribution distribution,
                                     const CableVector& given_lambda_N) {
  return distributed(robot, wrench_rows(robot, state), distribution, given_lambda_N, true);
}

CableVector balanced_near(const Robot& robot, const PlatformState& state,
                          const CableVector& tension_N) {
  const WrenchRows rows = wrench_rows(robot, state);
  if (!rows.valid) return {};
  return tension_N + rows.least_norm(rows.load - rows.x * tension_N);
}

CableVector tensions_of_least_norm(const Robot& robot, const PlatformState& state,
                                   const Vector6& wrench) {
  const WrenchRows rows = wrench_rows(robot, state);
  return rows.valid ? rows.least_norm(rows.reduced(wrench)) : CableVector();
}

Eigen::Quaterniond held_orientation(const Robot& robot) {
  const MotionRow& motion = row_of(robot.platform.motion);
  if (motion.is_point()) return Eigen::Quaterniond::Identity();
  const Vector3 axis =
      motion.is_planar() ? robot.platform.motion_plane_normal : Vector3(Vector3::UnitZ());
  const std::vector<Vector3> lattice = middle_lattice(robot);
  const Eigen::Quaterniond own = Eigen::Quaterniond::Identity();
  const Score of_own = score_of(robot, lattice, own);
  Eigen::Quaterniond best = own;
  Score of_best = of_own;
  const auto try_turn = [&](const Eigen::Quaterniond& from, double angle_rad) {
    const Eigen::Quaterniond turned = (exp_so3(angle_rad * axis) * from).normalized();
    const Score score = score_of(robot, lattice, turned);
    if (!score.better_than(of_best)) return;
    best = turned;
    of_best = score;
  };
  // By no more than a quarter: beyond, cables wind around the platform, which statics do not see.
  constexpr int kSteps = 6;
  for (int k = -kSteps; k <= kSteps; ++k) try_turn(own, 0.5 * kPi * k / kSteps);
  for (double step = 0.25 * kPi / kSteps; step > kDegree; step *= 0.5) {
    const Eigen::Quaterniond middle = best;
    try_turn(middle, -step);
    try_turn(middle, step);
  }
  return 2 * of_own.places >= of_best.places ? own : best;
}

}  // namespace cdprcal
