#include "cdprcal/calibration/pose_cache.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace cdprcal {
namespace {

bool same(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.rotation.coeffs() == b.rotation.coeffs();
}

Pose nowhere() { return {Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()}; }

}  // namespace

PoseCache::PoseCache(const CalibrationProblem& problem, const std::vector<Pose>& poses)
    : problem_(problem), robot_(with_effects(problem.robot, problem.effects)), poses_(poses) {
  statics_.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Measurement& measurement = problem.measurements[i];
    const bool counts = measurement.in_balance() && (i > 0 || problem.reference_statics);
    statics_.push_back(counts ? problem.statics : StaticsModel::none);
  }
  if (problem.statics == StaticsModel::wrench) {
    whitening_.assign(poses.size(), Matrix6::Identity());
    axes_.assign(poses.size(), Matrix6::Identity());
    roots_.assign(poses.size(), Matrix6::Identity());
    tension_gain_.assign(poses.size(), Vector6::Zero());
    whitened_at_.assign(poses.size(), nowhere());
    rooted_at_.assign(poses.size(), nowhere());
  }
  const NoiseModel noise = problem.noise.value_or(specified_noise(problem.robot.sigma));
  wrench_force_N_ = noise.wrench_force_N;
  wrench_moment_Nm_ = noise.wrench_moment_Nm;
  weights_.reserve(poses.size());
  for (const Measurement& measurement : problem.measurements) {
    auto& weights = weights_.emplace_back();
    for (std::size_t c = 0; c < kChannels; ++c) {
      weights[c] = 1.0 / noise.channel[c].sigma(measurement.samples);
    }
  }
}

void PoseCache::evaluate(std::size_t index, const Pose& at, PoseEvaluation& out) const {
  evaluate_pose(robot_, problem_.measurements[index], at, statics_[index],
                problem_.left_inverse_rows, problem_.effects, true, out);
}

void PoseCache::update() {
  if (evaluations_.empty()) {  // large, and a minimiser does without: not before it is asked for
    evaluations_.resize(poses_.size());
    evaluated_at_.assign(poses_.size(), nowhere());
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (same(evaluated_at_[i], poses_[i])) continue;
    evaluated_at_[i] = poses_[i];
    evaluate(i, poses_[i], evaluations_[i]);
  }
}

Matrix6 balance_root(const PlatformState& state, double tension_sigma_N, const SensorSigma& sigma) {
  const WrenchMatrix structure = structure_matrix(state);
  Matrix6 covariance = tension_sigma_N * tension_sigma_N * structure * structure.transpose();
  covariance.diagonal().head<3>().array() += sigma.wrench_force_N * sigma.wrench_force_N;
  covariance.diagonal().tail<3>().array() += sigma.wrench_moment_Nm * sigma.wrench_moment_Nm;
  return covariance.llt().matrixL();
}

template <typename Decompose, typename Set>
void PoseCache::whiten_balances(double graduation, std::vector<Pose>& known_at,
                                const Decompose& decompose, const Set& set) {
  graduation_ = graduation;
  if (whitening_.empty()) return;
  Vector6 scale;
  scale << Vector3::Constant(1.0 / wrench_force_N_), Vector3::Constant(1.0 / wrench_moment_Nm_);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench) continue;
    if (!same(known_at[i], poses_[i])) {
      const PlatformState state = platform_state(robot_, poses_[i]);
      if (!state.valid) continue;
      decompose(i, scale, WrenchMatrix(scale.asDiagonal() * structure_matrix(state)));
      known_at[i] = poses_[i];
    }
    set(i, 1.0 / weight(i, Channel::balance));
  }
}

void PoseCache::update_wrench_whitening(double graduation) {
  const auto decompose = [this](std::size_t i, const Vector6& scale,
                                const WrenchMatrix& structure) {
    const Matrix6 gram = structure.lazyProduct(structure.transpose());
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(gram);
    tension_gain_[i] = eigen.eigenvalues().cwiseMax(0.0);
    axes_[i] = eigen.eigenvectors().transpose() * scale.asDiagonal();
  };
  const auto set = [this, graduation](std::size_t i, double sigma_N) {
    const Vector6 variance = (sigma_N * sigma_N * tension_gain_[i]).array() + 1.0;
    whitening_[i] = (graduation * variance.cwiseSqrt()).cwiseInverse().asDiagonal() * axes_[i];
  };
  whiten_balances(graduation, whitened_at_, decompose, set);
}

void PoseCache::update_wrench_weights(double graduation) {
  const auto decompose = [this](std::size_t i, const Vector6& scale,
                                const WrenchMatrix& structure) {
    const WrenchMatrix whitened = structure / weight(i, Channel::balance);
    const Matrix6 covariance = Matrix6::Identity() + whitened.lazyProduct(whitened.transpose());
    roots_[i] = covariance.llt().matrixL().solve(Matrix6(scale.asDiagonal()));
  };
  const auto set = [this, graduation](std::size_t i, double) {
    whitening_[i] = roots_[i] / graduation;
  };
  whiten_balances(graduation, rooted_at_, decompose, set);
}

}  // namespace cdprcal
