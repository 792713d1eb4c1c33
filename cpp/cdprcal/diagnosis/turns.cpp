#include "cdprcal/diagnosis/turns.hpp"

namespace cdprcal {

std::array<bool, 3> angles_that_vary(const DiagnosisModel& model) {
  constexpr double kTimes = 3.0;
  const DiagnosisSystem system = linearise(model);
  if (!system.valid || system.poses.empty()) return {};
  Vector3 first = Vector3::Zero(), sum = first, squares = first, variance = first;
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const Pose& at = model.runs[pose.run].poses[pose.pose];
    const EulerConvention convention = model.robot.euler_convention;
    const Vector3 angles = euler_from_rotation(at.rotation.toRotationMatrix(), convention);
    if (&pose == &system.poses.front()) first = angles;
    const Vector3 turned = (angles - first).unaryExpr([](double a) { return wrap_angle(a); });
    sum += turned;
    squares += turned.cwiseAbs2();
    const Eigen::MatrixXd inverse = system.pose_by_rows(pose);
    variance += (euler_rate_matrix(angles, convention).inverse() * inverse.bottomRows<3>())
                    .rowwise()
                    .squaredNorm();
  }
  const auto count = static_cast<double>(system.poses.size());
  const Vector3 spread = squares / count - (sum / count).cwiseAbs2();
  std::array<bool, 3> out{};
  for (int a = 0; a < 3; ++a) {
    out[static_cast<std::size_t>(a)] = spread[a] > kTimes * kTimes * variance[a] / count;
  }
  return out;
}

}  // namespace cdprcal
