#include "cdprcal/calibration/pose_cache.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace cdprcal {

PoseBlock to_block(const Pose& pose) {
  PoseBlock block;
  block << pose.position_m, pose.rotation.coeffs();
  return block;
}

Pose from_block(const double* block) {
  Pose pose;
  pose.position_m = Eigen::Map<const Vector3>(block);
  pose.rotation = Eigen::Map<const Eigen::Quaterniond>(block + 3);
  return pose;
}

void evaluate_pose(const Robot& robot, const Measurement& measurement, const Pose& pose,
                   StaticsModel statics, const std::vector<WrenchRow>& left_inverse_rows,
                   bool with_jacobians, PoseEvaluation& out) {
  const PlatformState state = platform_state(robot, pose);
  out.valid = state.valid && pose.position_m.allFinite();
  if (!out.valid) return;
  out.length_m = state.length_m();
  out.swivel_rad = state.swivel_rad();
  out.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, robot.euler_convention);
  if (with_jacobians) {
    out.length_by_twist = length_jacobian(state);
    out.swivel_by_twist = swivel_jacobian(state);
    out.attitude_by_twist.leftCols<3>().setZero();
    out.attitude_by_twist.rightCols<3>() =
        euler_rate_matrix(out.roll_pitch_yaw_rad, robot.euler_convention).inverse();
    out.valid = out.attitude_by_twist.allFinite();  // gimbal lock
  }
  if (statics == StaticsModel::left_inverse) {
    const TensionModel model = tensions_left_inverse(robot, state, left_inverse_rows);
    out.valid = out.valid && model.valid;
    if (!out.valid) return;
    out.tension_N = model.tension_N;
    out.tension_by_twist = model.by_twist;
  } else if (statics == StaticsModel::wrench) {
    out.wrench = wrench_residual(robot, state, measurement.tension_N);
    if (with_jacobians) out.wrench_by_twist = stiffness(robot, state, measurement.tension_N);
  }
}

PoseCache::PoseCache(const CalibrationProblem& problem, const std::vector<Pose>& poses)
    : problem_(problem),
      evaluations_(poses.size()),
      whitening_(poses.size(), Matrix6::Identity()) {
  blocks_.reserve(poses.size());
  for (const Pose& pose : poses) blocks_.push_back(to_block(pose));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Measurement& measurement = problem.measurements[i];
    const bool rests = measurement.kind == PoseKind::static_pose &&
                       (i > 0 || problem.reference_statics) && measurement.tension_N.allFinite();
    statics_.push_back(rests ? problem.statics : StaticsModel::none);
  }
}

void PoseCache::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (!new_evaluation_point && (have_jacobians_ || !evaluate_jacobians)) return;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    evaluate_pose(problem_.robot, problem_.measurements[i], pose(i), statics_[i],
                  problem_.left_inverse_rows, evaluate_jacobians, evaluations_[i]);
  }
  have_jacobians_ = evaluate_jacobians;
}

void PoseCache::update_wrench_whitening(double graduation) {
  const SensorSigma& sigma = problem_.robot.sigma;
  tension_weight_ = 1.0 / (graduation * sigma.tension_N);
  Vector6 model_variance;
  model_variance << Vector3::Constant(sigma.wrench_force_N * sigma.wrench_force_N),
      Vector3::Constant(sigma.wrench_moment_Nm * sigma.wrench_moment_Nm);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench) continue;
    const PlatformState state = platform_state(problem_.robot, pose(i));
    if (!state.valid) continue;
    const WrenchMatrix structure = structure_matrix(state);
    Matrix6 covariance = sigma.tension_N * sigma.tension_N * structure * structure.transpose();
    covariance.diagonal() += model_variance;
    // C = L Lᵀ ⇒ ‖L⁻¹ r‖² = rᵀ C⁻¹ r
    const Matrix6 root = covariance.llt().matrixL();
    whitening_[i] =
        root.triangularView<Eigen::Lower>().solve(Matrix6::Identity()) / graduation;
  }
}

}  // namespace cdprcal
