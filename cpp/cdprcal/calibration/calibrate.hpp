// From a log to the initial pose, with nothing picked by hand.
#pragma once

#include "cdprcal/acquisition/log.hpp"
#include "cdprcal/calibration/problem.hpp"

namespace cdprcal {

enum class Method { unified, statics, kinematic };   ///< unified, "static" (τlσε), kinematic (lσε)
enum class Formulation { full, paper };

struct CalibrateOptions {
  Method method = Method::unified;
  Formulation formulation = Formulation::full;
  std::vector<double> at_s;        ///< poses by hand; the first is the reference. Empty: automatic
  int segment = -1;                ///< which segment is the run; −1: the last
  std::optional<std::vector<Pose>> guess;  ///< one a pose, or only ζ0; empty: automatic
  std::optional<SensorSigma> sigma;        ///< instead of the robot's
  DetectionOptions detection;
  SolveOptions solve;
};

struct Calibration {
  CalibrationResult result;
  std::vector<Measurement> measurements;
  std::vector<Equilibrium> equilibria;   ///< found in the run (empty with at_s)
  double reference_time_s = 0.0;
  int static_poses = 0;
  int kinematic_poses = 0;
};

/// Throws InputError for a log that does not fit the robot; otherwise see result.status.
Calibration calibrate(const Robot& robot, const Log& log, const CalibrateOptions& options = {});

Method parse_method(const std::string& name);
Formulation parse_formulation(const std::string& name);
const char* to_string(Method method);
const char* to_string(Formulation formulation);

}  // namespace cdprcal
