// What geometry says of one sample's readings.
#include "cdprcal/motion/geometric_readings.hpp"

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

/// All sensors at a pose, without offsets and noise.
Measurement exact(const Robot& robot, const Pose& pose) {
  const int n = robot.cable_count();
  RandomNormal random(1);
  const ReadingOffsets none{CableVector::Zero(n), CableVector::Zero(n), 0.0};
  return synthetic_measurement(robot, pose, CableVector::Constant(n, 50.0),
                               PoseKind::kinematic_pose, none,
                               reading_noise(robot.sigma, 0.0, true), random);
}

TEST(GeometricReadings, FitAtTheTruth) {
  for (const RobotPose& at : derivative_cases()) {
    SCOPED_TRACE(at.label);
    GeometricReadings out;
    ASSERT_TRUE(evaluate(at.robot, {}, exact(at.robot, at.pose), at.pose, out));
    const std::vector<RowLabel> rows = geometric_rows(at.robot.cable_count());
    ASSERT_EQ(static_cast<std::size_t>(out.misfit.size()), rows.size());
    ASSERT_TRUE(out.misfit.allFinite());
    EXPECT_LT(out.misfit.cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(GeometricReadings, HaveTheseDerivatives) {
  for (const RobotPose& at : derivative_cases(4)) {
    const Vector3 euler = euler_from_rotation(at.pose.rotation_matrix(), at.robot.euler_convention);
    if (std::abs(euler[1]) > 1.2) continue;  // near where its angles have no derivatives
    SCOPED_TRACE(at.label);
    const Measurement m = exact(at.robot, at.pose);
    GeometricReadings out;
    ASSERT_TRUE(evaluate(at.robot, {}, m, at.pose, out));
    const NumericJacobian numeric = numeric_pose_jacobian(
        [&](const Pose& pose) -> Eigen::VectorXd {
          GeometricReadings moved;
          if (!evaluate(at.robot, {}, m, pose, moved)) throw std::logic_error("no kinematics");
          return moved.misfit;
        },
        at.pose);
    EXPECT_TRUE(jacobian_matches(out.by_pose, numeric, 1e-7));
  }
}

TEST(GeometricReadings, OfAbsentSensorsSayNothing) {
  const Robot robot = load_robot("irma4");
  const Pose pose{{0.1, -0.1, 0.9}, Eigen::Quaterniond::Identity()};
  Measurement m = exact(robot, pose);
  m.swivel_rad.resize(0);
  m.length_m[2] = kNaN;
  m.roll_pitch_yaw_rad[2] = kNaN;
  m.direct_length_m.resize(0);
  GeometricReadings out;
  ASSERT_TRUE(evaluate(robot, {}, m, pose, out));
  const std::vector<RowLabel> rows = geometric_rows(4);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::string name = in_words(rows[r]);
    const bool absent = name.starts_with("swivel") || name == "length_3_m" || name == "yaw_rad" ||
                        name.starts_with("direct_length");
    EXPECT_EQ(std::isnan(out.misfit[static_cast<Eigen::Index>(r)]), absent) << name;
  }
}

TEST(GeometricReadings, AreNamedAsTheLogNamesThem) {
  std::vector<std::string> names;
  for (const RowLabel& row : geometric_rows(3)) {
    names.push_back(in_words(row));
    const bool counted = names.back().starts_with("length") || names.back().starts_with("swivel") ||
                         names.back() == "yaw_rad";
    EXPECT_EQ(has_offset(row), counted) << names.back();
    EXPECT_EQ(is_angle(row), names.back().ends_with("_rad")) << names.back();
  }
  EXPECT_EQ(names.size(), 16U);
  EXPECT_EQ(names[0], "length_1_m");
  EXPECT_EQ(names[5], "swivel_3_rad");
  EXPECT_EQ(names[8], "yaw_rad");
}

}  // namespace
}  // namespace cdprcal::test
