// A simulated start-up from power-on, and the initial pose found from what its sensors read.
#include "cdprcal/calibration/calibrate.hpp"

#include <cstdio>
#include <numbers>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/planning/plan.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/simulator/simulate_startup.hpp"

int main() {
  using namespace cdprcal;
  const Robot robot = load_robot("irma4");
  const Plan plan = make_plan(robot).plan;

  // The procedure of the real robot against a simulated plant, with the noise of real sensors.
  StartUpPlan setpoints{.setpoint_N = {plan.start_tension_N}};
  for (const PlannedPose& stop : plan.poses) setpoints.setpoint_N.push_back(stop.tension_N);
  StartUpRunOptions options;
  options.simulator.seed = 7;
  const StartUpRun run = simulate_startup(robot, setpoints, options);
  if (run.state != StartUpState::done) {
    std::puts(run.reason.c_str());
    return 1;
  }
  std::printf("rests: %zu %td\n", run.rests.size(), static_cast<std::ptrdiff_t>(run.truth.size()));

  const Calibration calibration = calibrate(robot, run.log);
  const CalibrationResult& result = calibration.result;
  if (result.status != CalibrationStatus::converged) {
    std::puts(result.reason.c_str());
    return 1;
  }
  const Pose& found = result.poses.front();
  const Pose& truth = run.truth.front().pose;
  std::printf("poses: %d\n", calibration.static_poses);
  std::printf("position_m: %.4f %.4f %.4f\n", found.position_m.x(), found.position_m.y(),
              found.position_m.z());
  if (!result.covariance) return 1;
  const Vector6 sigma = result.covariance->diagonal().cwiseSqrt();
  std::printf("sigma_mm: %.3f %.3f %.3f\n", 1e3 * sigma[0], 1e3 * sigma[1], 1e3 * sigma[2]);

  const double error_m = (found.position_m - truth.position_m).norm();
  const double angle_deg = rotation_distance_rad(found, truth) * 180.0 / std::numbers::pi;
  std::printf("error_mm_deg: %.2f %.3f\n", 1e3 * error_m, angle_deg);
  return error_m < 1e-3 ? 0 : 1;
}
