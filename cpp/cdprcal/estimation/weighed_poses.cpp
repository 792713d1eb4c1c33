#include "cdprcal/estimation/weighed_poses.hpp"

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/estimation/unread_tensions.hpp"

namespace cdprcal {
namespace {

bool same(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.rotation.coeffs() == b.rotation.coeffs();
}

Pose nowhere() { return {Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()}; }

}  // namespace

WeighedPoses::WeighedPoses(const CalibrationProblem& problem, const std::vector<Pose>& poses)
    : problem_(problem), poses_(poses) {
  if (!problem.effects.empty()) changed_ = with_effects(problem.robot, problem.effects);
  statics_.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Measurement& measurement = problem.measurements[i];
    const int equations = balance_equations(problem.robot, measurement);
    const bool told =
        problem.statics == StaticsModel::left_inverse ? equations == 6 : equations > 0;
    const bool counts = told && (i > 0 || problem.reference_statics);
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
      weights[c] = 1.0 / noise.channel[c].sigma(measurement);
    }
  }
}

std::vector<std::size_t> WeighedPoses::moved(std::vector<Pose>& known_at) const {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench || same(known_at[i], poses_[i])) continue;
    if (balance_equations(problem_.robot, problem_.measurements[i]) < 6) continue;  // RunRows does
    known_at[i] = poses_[i];
    out.push_back(i);
  }
  return out;
}

void WeighedPoses::update_wrench_whitening(double graduation) {
  graduation_ = graduation;
  ++weights_version_;
  if (whitening_.empty()) return;
  for (const std::size_t i : moved(whitened_at_)) {
    const PlatformState state = platform_state(robot(), poses_[i]);
    if (!state.valid) continue;  // no row of it is asked for
    const Vector6 scale = wrench_sigma(i).cwiseInverse();
    const WrenchMatrix structure = scale.asDiagonal() * structure_matrix(state);
    const Matrix6 gram = structure.lazyProduct(structure.transpose());
    const SymmetricEigen<Matrix6> eigen(gram);
    tension_gain_[i] = eigen.eigenvalues().cwiseMax(0.0);
    axes_[i] = eigen.eigenvectors().transpose() * scale.asDiagonal();
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench) continue;
    const double sigma_N = 1.0 / weight(i, Channel::balance);
    const Vector6 variance = (sigma_N * sigma_N * tension_gain_[i]).array() + 1.0;
    whitening_[i] = (graduation * variance.cwiseSqrt()).cwiseInverse().asDiagonal() * axes_[i];
  }
}

Vector6 WeighedPoses::wrench_sigma(std::size_t pose) const {
  return cdprcal::wrench_sigma(wrench_force_N_, wrench_moment_Nm_,
                               problem_.measurements[pose].inertial_sigma);
}

double WeighedPoses::inertial_share(std::size_t pose, const Vector6& weights) const {
  const Vector6 inertial = problem_.measurements[pose].inertial_sigma;
  return weights.cwiseProduct(inertial).squaredNorm() /
         weights.cwiseProduct(wrench_sigma(pose)).squaredNorm();
}

BalanceSigma WeighedPoses::balance_sigma(std::size_t pose) const {
  return {CableVector::Constant(robot().cable_count(), 1.0 / tension_weight(pose)),
          graduation_ * wrench_sigma(pose)};
}

void WeighedPoses::update_wrench_weights(double graduation) {
  graduation_ = graduation;
  ++weights_version_;
  if (whitening_.empty()) return;
  const std::vector<std::size_t> changed = moved(rooted_at_);
  std::vector<Pose> poses;
  std::vector<BalanceSigma> sigma;
  graduation_ = 1.0;  // roots_ are kept at it
  for (const std::size_t i : changed) {
    poses.push_back(poses_[i]);
    sigma.push_back(balance_sigma(i));
  }
  graduation_ = graduation;
  const std::vector<Matrix6> roots = inverse_balance_roots(robot(), poses, sigma);
  for (std::size_t c = 0; c < changed.size(); ++c) {
    if (roots[c].allFinite()) roots_[changed[c]] = roots[c];  // else no row of it is asked for
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) whitening_[i] = roots_[i] / graduation;
}

}  // namespace cdprcal
