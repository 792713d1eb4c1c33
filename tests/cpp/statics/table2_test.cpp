// Table II of the paper: the tensions that the left inverse gives at the printed poses.
#include "../support/table2.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "../support/shared_data.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

using test::kTable2;
using test::Table2Row;

TensionModel recorded_left_inverse(const Robot& robot, const Pose& pose) {
  return tensions_left_inverse(robot, platform_state(robot, pose), left_inverse_rows(4));
}

/// ∂τ/∂(roll, pitch, yaw) at constant position.
Eigen::Matrix<double, 4, 3> by_angles(const TensionModel& model, const Vector3& angles) {
  return model.by_twist.rightCols<3>() * euler_rate_matrix(angles, EulerConvention::XYZ);
}

/// The angles within the rounding of a row whose tensions are nearest to the row's: four equations,
/// three unknowns, so that the fit itself is a check.
Vector3 unrounded_angles(const Robot& robot, const Table2Row& row) {
  Vector3 angles = row.euler();
  for (int i = 0; i < 5; ++i) {
    const TensionModel model = recorded_left_inverse(robot, row.pose(angles));
    angles += least_squares(by_angles(model, angles), row.tension() - model.tension_N).x;
  }
  return angles;
}

TEST(Table2, TensionsFollowFromThePosesTo1e5N) {
  const Robot robot = load_robot("irma4");
  for (const Table2Row& row : kTable2) {
    const Vector3 angles = unrounded_angles(robot, row);
    // Six decimals of angle are up to 5 mN of tension: so the angles are completed first, by no
    // more than their rounding (and what the rounding of the tensions adds).
    EXPECT_LE((angles - row.euler()).cwiseAbs().maxCoeff(), 1.01 * test::kTable2AngleRounding_rad);
    const TensionModel model = recorded_left_inverse(robot, row.pose(angles));
    ASSERT_TRUE(model.valid);
    EXPECT_LE((model.tension_N - row.tension()).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST(Table2, RoundedPosesGiveTheTensionsWithinTheirRounding) {
  const Robot robot = load_robot("irma4");
  for (const Table2Row& row : kTable2) {
    const TensionModel model = recorded_left_inverse(robot, row.pose());
    ASSERT_TRUE(model.valid);
    const Eigen::Vector4d rounding =
        by_angles(model, row.euler()).cwiseAbs().rowwise().sum() * test::kTable2AngleRounding_rad;
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(model.tension_N[i], row.tension()[i],
                  rounding[i] + test::kTable2TensionRounding_N);
    }
  }
}

TEST(Table2, RowsAreEquilibriaTo4e4) {
  const Robot robot = load_robot("irma4");
  for (const Table2Row& row : kTable2) {
    const Pose pose = row.pose(unrounded_angles(robot, row));
    const PlatformState state = platform_state(robot, pose);
    EXPECT_LT(wrench_residual(robot, state, row.tension()).cwiseAbs().maxCoeff(), 4e-4);
  }
}

TEST(Table2, WithTheOrderThatThePaperNamesNoRowIsAnEquilibrium) {
  const Robot robot = load_robot("irma4");
  for (const Table2Row& row : kTable2) {
    Pose pose = row.pose();
    pose.rotation = rotation_from_euler(row.euler(), EulerConvention::ZYX);
    const PlatformState state = platform_state(robot, pose);
    EXPECT_GT(wrench_residual(robot, state, row.tension()).cwiseAbs().maxCoeff(), 0.1);
    const TensionModel model = recorded_left_inverse(robot, pose);
    EXPECT_GT((model.tension_N - row.tension()).cwiseAbs().maxCoeff(), 10.0);
  }
}

TEST(Table2, TensionsPrintedInRow6AreNoEquilibrium) {
  const Robot robot = load_robot("irma4");
  const Table2Row& row = kTable2[5];
  const PlatformState state = platform_state(robot, row.pose());
  const CableVector printed = Eigen::Vector4d(53.86, 70.04, 81.18, 31.01);
  EXPECT_GT(wrench_residual(robot, state, printed).cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LT(wrench_residual(robot, state, row.tension()).cwiseAbs().maxCoeff(), 4e-4);
}

/// The 8 × 6 numbers of the recorded starting guess, which are Table II's poses in full.
std::vector<double> recorded_poses(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  std::string body = text.str();
  body.erase(0, body.find(':', body.find("\"initial_guess\"")) + 1);
  for (char& c : body) {
    if (c == '[' || c == ']' || c == ',') c = ' ';
  }
  std::istringstream numbers(body);
  std::vector<double> values(48, kNaN);
  for (double& value : values) numbers >> value;
  return values;
}

TEST(Table2, RecordedPosesGiveTheTensionsTo1e5N) {
  const std::string path = test::shared_data("irma4/trial_a.json");
  if (path.empty()) GTEST_SKIP() << "no shared data: irma4/trial_a.json";
  const Robot robot = load_robot("irma4");
  const std::vector<double> numbers = recorded_poses(path);
  for (std::size_t i = 0; i < kTable2.size(); ++i) {
    const Table2Row& row = kTable2[i];
    const Vector3 angles(numbers[6 * i + 3], numbers[6 * i + 4], numbers[6 * i + 5]);
    ASSERT_LE((angles - row.euler()).cwiseAbs().maxCoeff(), 1e-6);
    const TensionModel model = recorded_left_inverse(robot, row.pose(angles));
    ASSERT_TRUE(model.valid);
    EXPECT_LE((model.tension_N - row.tension()).cwiseAbs().maxCoeff(), 1e-5);
    const PlatformState state = platform_state(robot, row.pose(angles));
    EXPECT_LT(wrench_residual(robot, state, model.tension_N).cwiseAbs().maxCoeff(), 4e-4);
  }
}

}  // namespace
}  // namespace cdprcal
