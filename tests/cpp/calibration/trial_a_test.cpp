// Trial a of the paper, measured on the real robot (not part of the repository).
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "../support/scenario.hpp"
#include "../support/shared_data.hpp"
#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal::test {
namespace {

Pose pose_from(const nlohmann::json& six, EulerConvention convention) {
  std::vector<double> v = six.get<std::vector<double>>();
  return {Vector3(v[0], v[1], v[2]), rotation_from_euler(Vector3(v[3], v[4], v[5]), convention)};
}

class TrialA : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string log_path = shared_data("irma4/trial_a.csv");
    const std::string json_path = shared_data("irma4/trial_a.json");
    if (log_path.empty() || json_path.empty()) GTEST_SKIP() << "no shared data: irma4/trial_a";
    log = read_log(log_path);
    const auto record = nlohmann::json::parse(std::ifstream(json_path));
    options.at_s = record["times_s"].get<std::vector<double>>();
    options.method = Method::statics;
    options.formulation = Formulation::paper;
    for (const auto& six : record["initial_guess"]) {
      options.guess.push_back(pose_from(six, robot.euler_convention));
    }
    recorded = pose_from(record["recorded_solution_initial_pose"], robot.euler_convention);
    truth = pose_from(record["recorded_ground_truth_initial_pose"], robot.euler_convention);
  }

  void expect_recorded_minimum(const CalibrationResult& result) const {
    EXPECT_EQ(result.status, CalibrationStatus::converged) << result.reason;
    EXPECT_NEAR(result.cost, 14.942858, 1e-5);
    ASSERT_FALSE(result.poses.empty());
    EXPECT_LT(minus(result.poses[0], recorded).cwiseAbs().maxCoeff(), 1e-5);
  }

  Robot robot = load_robot("irma4");
  Log log;
  CalibrateOptions options;
  Pose recorded, truth;
};

TEST_F(TrialA, RecordedMinimumFromTheRecordedGuess) {
  const CalibrationResult result = calibrate(robot, log, options).result;
  expect_recorded_minimum(result);
  EXPECT_NEAR((result.poses[0].position_m - truth.position_m).norm(), 0.010508, 1e-5);
  EXPECT_NEAR(rotation_angle_difference_rad(result.poses[0], truth) / kDegree, 1.41754, 1e-3);
  EXPECT_NEAR(rotation_distance_rad(result.poses[0], truth) / kDegree, 2.19, 0.01);
}

TEST_F(TrialA, RecordedMinimumFromGuessesFarOff) {
  const std::vector<Pose> guess = options.guess;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    options.guess = disturbed(guess, 0.2, 10.0 * kDegree, seed);
    expect_recorded_minimum(calibrate(robot, log, options).result);
  }
}

TEST_F(TrialA, RecordedMinimumWithoutAnyGuess) {
  options.guess.clear();
  expect_recorded_minimum(calibrate(robot, log, options).result);
}

TEST_F(TrialA, FullFormulationAtTheSamePosesTurnsBetter) {
  options.formulation = Formulation::full;
  const CalibrationResult result = calibrate(robot, log, options).result;
  EXPECT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  // Yaw is observable from the moment balance: the authors' 2.19° becomes under 1°.
  EXPECT_LT(rotation_distance_rad(result.poses[0], truth) / kDegree, 1.0);
}

}  // namespace
}  // namespace cdprcal::test
