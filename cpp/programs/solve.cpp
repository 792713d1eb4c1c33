// cdprcal-solve ROBOT LOG [--json]: the initial pose from a canonical log, without Python.
//
// Exit codes: 0 done, 1 the solution cannot be trusted, 2 wrong use, 3 a pose, but the model lacks
// something. The Python command has caveats besides: what is wrong with the log.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/version.hpp"

namespace {

using nlohmann::ordered_json;
using namespace cdprcal;

/// NaN has no place in JSON: null stands for "not measured".
ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

template <typename Vector>
ordered_json numbers(const Vector& values) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(number(values[i]));
  return out;
}

template <typename Matrix>
ordered_json rows(const Matrix& matrix) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) out.push_back(numbers(matrix.row(i)));
  return out;
}

ordered_json to_json(const Robot& robot, const Calibration& calibration) {
  const CalibrationResult& result = calibration.result;
  ordered_json out;
  out["status"] = to_string(result.status);
  out["reason"] = result.reason;
  out["reference_time_s"] = calibration.reference_time_s;
  out["initial_pose"] = nullptr;
  if (!result.poses.empty()) {
    const Pose& pose = result.poses.front();
    out["initial_pose"] = {{"position_m", numbers(pose.position_m)},
                           {"rotation", rows(pose.rotation_matrix())},
                           {"euler_rad", numbers(euler_from_rotation(pose.rotation_matrix(),
                                                                     robot.euler_convention))}};
  }
  out["covariance"] = result.covariance ? rows(*result.covariance) : ordered_json(nullptr);
  out["standard_deviation"] = numbers(result.standard_deviation());
  out["initial_lengths_m"] = numbers(result.initial_length_m);
  out["initial_swivels_rad"] = numbers(result.initial_swivel_rad);
  out["cost"] = number(result.cost);
  out["iterations"] = result.iterations;
  out["solve_time_s"] = result.solve_time_s;
  out["static_poses"] = calibration.static_poses;
  out["kinematic_poses"] = calibration.kinematic_poses;
  out["least_observed"] =
      result.least_observed.empty() ? ordered_json(nullptr) : ordered_json(result.least_observed);
  const ResidualRms& rms = result.residual_rms;
  out["residual_rms"] = {{"length_m", number(rms.length_m)},
                         {"swivel_rad", number(rms.swivel_rad)},
                         {"roll_pitch_rad", number(rms.roll_pitch_rad)},
                         {"yaw_rad", number(rms.yaw_rad)},
                         {"tension_N", number(rms.tension_N)},
                         {"wrench_force_N", number(rms.wrench_force_N)},
                         {"wrench_moment_Nm", number(rms.wrench_moment_Nm)}};
  // Sensors that few robots have: only where they read something.
  for_each_absolute(
      [&](const Sensor& sensor, double value) {
        if (std::isfinite(value)) out["residual_rms"][sensor.field()] = value;
      },
      rms);
  out["poses"] = ordered_json::array();
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    const Measurement& measurement = calibration.problem.measurements[i];
    const bool rests = measurement.kind == PoseKind::static_pose;
    out["poses"].push_back({{"time_s", measurement.time_s},
                            {"position_m", numbers(result.poses[i].position_m)},
                            {"rotation", rows(result.poses[i].rotation_matrix())},
                            {"kind", rests ? "static" : "kinematic"}});
  }
  return out;
}

void print_table(const Robot& robot, const Calibration& calibration) {
  const CalibrationResult& result = calibration.result;
  std::printf("%s: %s\n", to_string(result.status), result.reason.c_str());
  std::printf("%d static and %d kinematic poses, %d iterations, %.3f ms\n",
              calibration.static_poses, calibration.kinematic_poses, result.iterations,
              1e3 * result.solve_time_s);
  if (result.poses.empty()) return;
  const Pose& pose = result.poses.front();
  const Vector3 angles = euler_from_rotation(pose.rotation_matrix(), robot.euler_convention);
  const Vector6& sigma = result.standard_deviation();
  std::printf("initial pose at %.3f s\n", calibration.reference_time_s);
  for (int i = 0; i < 3; ++i) {
    std::printf("  %c      %10.4f m    sigma %8.4f m\n", "xyz"[i], pose.position_m[i], sigma[i]);
  }
  constexpr const char* kNames[] = {"roll ", "pitch", "yaw  "};
  for (int i = 0; i < 3; ++i) {
    std::printf("  %s  %10.3f deg  (world-frame rotation about %c: sigma %.3f deg)\n", kNames[i],
                angles[i] / kDegree, "xyz"[i], sigma[3 + i] / kDegree);
  }
  if (!result.least_observed.empty()) std::printf("  %s\n", result.least_observed.c_str());
  for (const GatedReading& g : calibration.gated) {
    std::printf("  left out at %.3f s: %s %d (%s)\n", g.time_s, to_string(g.channel),
                g.component + 1, to_string(g.reason));
  }
  for (int i = 0; i < robot.cable_count(); ++i) {
    std::printf("  cable %d: initial length %.4f m, swivel %.3f deg\n", i + 1,
                result.initial_length_m[i], result.initial_swivel_rad[i] / kDegree);
  }
}

int solve(int argc, char** argv) {
  CLI::App app{
      "Initial pose of a cable robot from the log of its own sensors.\n"
      "Example: cdprcal-solve irma4 log.csv --json",
      "cdprcal-solve"};
  std::string robot_name, log_path, method = "unified", formulation = "full", noise;
  std::vector<double> at_s;
  int segment = -1;
  bool json = false;
  app.add_option("ROBOT", robot_name, "robot file (YAML) or built-in name (irma4)")->required();
  app.add_option("LOG", log_path, "canonical log (CSV)")->required();
  app.add_option("--method", method, "unified | static | kinematic")->capture_default_str();
  app.add_option("--formulation", formulation, "full | paper")->capture_default_str();
  app.add_option("--at", at_s, "poses by hand: times in seconds, the first is the reference")
      ->delimiter(',');
  app.add_option("--noise", noise, "data | specified (default: data; specified for paper)");
  app.add_option("--segment", segment, "which segment is the run, from 0 (default: the last)");
  app.add_flag("--json", json, "print the result as JSON");
  app.set_version_flag("--version", CDPRCAL_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const Robot robot = load_robot(robot_name);
  const Log log = read_log(log_path);
  CalibrateOptions options;
  options.method = parse_method(method);
  options.formulation = parse_formulation(formulation);
  if (!noise.empty()) options.noise = parse_noise_source(noise);
  options.at_s = std::move(at_s);
  options.segment = segment;
  const Calibration calibration = calibrate(robot, log, options);
  if (json) {
    std::printf("%s\n", to_json(robot, calibration).dump(2).c_str());
  } else {
    print_table(robot, calibration);
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    throw InputError("standard output: cannot be written to; the result is lost");
  }
  if (calibration.result.status != CalibrationStatus::converged) return 1;
  return calibration.result.lacks_something ? 3 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return solve(argc, argv);
  } catch (const std::exception& error) {  // InputError, or no memory
    std::fprintf(stderr, "cdprcal-solve: %s\n", error.what());
    return 2;
  }
}
