#include "cdprcal/estimation/balance_roots.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "cdprcal/estimation/pose_lanes.hpp"
#include "cdprcal/kinematics/cable_equations.hpp"
#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

constexpr int kRoot = 21;

struct RootBatch {
  const Robot& robot;
  const double* poses;
  const double* sigma;  ///< [wrench, tension of each cable][lane]
  double* root;         ///< [21][lane]: rows of the lower triangle
};

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void roots(const RootBatch& in, int first) {
  const Lanes<V> pose(in.poses, first), sigma(in.sigma, first);
  const WritableLanes<V> out(in.root, first);
  V r[3][3];
  rotation_matrix(pose, r);
  V per[6];
  for (int i = 0; i < 6; ++i) per[i] = 1.0 / sigma[i];
  // In units of the model's own error: 1 + (SΞᵀσ_τ)(SΞᵀσ_τ)ᵀ.
  V h[kRoot];
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) h[packed(i, j)] = V{} + (i == j ? 1.0 : 0.0);
  }
  auto valid = finite(pose[0]) & finite(pose[1]) & finite(pose[2]);
  for (std::size_t k = 0; k < in.robot.cables.size(); ++k) {
    const Cable& cable = in.robot.cables[k];
    const V by = sigma[6 + static_cast<int>(k)];
    const Triple<V> arm = rotate(r, cable.platform_anchor_m);
    const Vector3& d = cable.pulley.position_m;
    const Triple<V> q{pose[0] + arm.x - d.x(), pose[1] + arm.y - d.y(), pose[2] + arm.z - d.z()};
    const CableEquations<V> s = cable_equations<Kind>(cable.pulley, q);
    valid &= s.is_tangent();
    const Triple<V> moment = cross(arm, s.direction);
    V wrench[6] = {s.direction.x, s.direction.y, s.direction.z, moment.x, moment.y, moment.z};
    for (int i = 0; i < 6; ++i) wrench[i] *= by * per[i];
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) h[packed(i, j)] += wrench[i] * wrench[j];
    }
  }
  cholesky<Kind>(h);
  // L⁻¹, column by column; L has its diagonal inverted.
  V inverse[kRoot];
  for (int j = 0; j < 6; ++j) {
    inverse[packed(j, j)] = h[packed(j, j)];
    for (int i = j + 1; i < 6; ++i) {
      V sum = {};
      for (int k = j; k < i; ++k) sum -= h[packed(i, k)] * inverse[packed(k, j)];
      inverse[packed(i, j)] = sum * h[packed(i, i)];
    }
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      const V value = inverse[packed(i, j)] * per[j];
      out.set(packed(i, j), valid ? value : V{} + kNaN);
    }
  }
}

CDPRCAL_DEFINE_FOR_PROCESSORS(root_lanes, roots, RootBatch)

}  // namespace

Vector6 wrench_sigma(double force_N, double moment_Nm, const Vector6& inertial) {
  Vector6 own;
  own << Vector3::Constant(force_N), Vector3::Constant(moment_Nm);
  return (own.cwiseAbs2() + inertial.cwiseAbs2()).cwiseSqrt();
}

std::vector<Matrix6> inverse_balance_roots(const Robot& robot, const std::vector<Pose>& poses,
                                           const std::vector<BalanceSigma>& sigma) {
  std::vector<Matrix6> out(poses.size());
  const Buffer sigmas = buffer(6 + robot.cables.size()), root = buffer(kRoot);
  PoseLanes batch(kLanes);
  for (std::size_t first = 0; first < poses.size(); first += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = std::min(first + lane, poses.size() - 1);
      batch.set(lane, poses[i]);
      for (std::size_t k = 0; k < 6; ++k) {
        sigmas[k * kLanes + lane] = sigma[i].wrench[static_cast<Eigen::Index>(k)];
      }
      for (std::size_t k = 0; k < robot.cables.size(); ++k) {
        sigmas[(6 + k) * kLanes + lane] = sigma[i].tension_N[static_cast<Eigen::Index>(k)];
      }
    }
    root_lanes({robot, batch.batch(0), sigmas.get(), root.get()});
    for (std::size_t lane = 0; lane < std::min<std::size_t>(kLanes, poses.size() - first); ++lane) {
      Matrix6& to = out[first + lane];
      to.setZero();
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j <= i; ++j) {
          to(i, j) = root[static_cast<std::size_t>(packed(i, j)) * kLanes + lane];
        }
      }
    }
  }
  return out;
}

}  // namespace cdprcal
