// Start-up runs of irma4 with known imperfections, for the diagnosis tests.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {

/// A run of `robot` through set-points; noise in the robot's own σ, a sample.
inline Log run_through(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                       double noise, std::uint64_t seed) {
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, noise);
  options.seed = seed;
  options.dwell_s = options.move_s = 4.0;
  return synthetic_log(robot, setpoints_N, options).log;
}

/// A run of `robot` through a 3 × 3 × nz grid (nz = 0: 2 × 2 × 2); noise in the robot's own σ, a
/// sample. The set-points are those that irma4 as drawn would choose.
inline Log startup_log(const Robot& robot, double noise, std::uint64_t seed, int nz = 2) {
  const Robot drawn = load_robot("irma4");
  const std::vector<CableVector> setpoints =
      nz == 0 ? default_setpoints(drawn, 2, 2, 2) : default_setpoints(drawn, 3, 3, nz);
  Log log = run_through(robot, setpoints, noise, seed);
  log.source = "run" + std::to_string(seed) + ".csv";
  return log;
}

/// Rows of a log with the paper's sensors.
inline Log cut(Log log, Eigen::Index begin, Eigen::Index count) {
  for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N,
                       &log.roll_pitch_yaw_rad}) {
    *m = m->middleRows(begin, count).eval();
  }
  log.time_s = log.time_s.segment(begin, count).eval();
  return log;
}

/// A run whose yaw is off by a bump over time, which nothing in the catalogue does.
inline Log log_with_bump() {
  Log log = startup_log(load_robot("irma4"), 0.1, 78);
  const double middle_s = 0.55 * log.time_s[log.sample_count() - 1];
  log.roll_pitch_yaw_rad.col(2).array() -=
      0.1 * ((log.time_s.array() - middle_s) / middle_s).square();
  return log;
}

/// Those of a list that have this name.
template <class T>
std::vector<T> named(const std::vector<T>& all, const std::string& name) {
  std::vector<T> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out),
               [&](const T& one) { return one.name == name; });
  return out;
}

inline std::string summary(const Diagnosis& d) {
  std::string text = std::string(to_string(d.verdict)) + ":";
  for (const DiscreteFault& fault : d.faults) text += " " + fault.name;
  for (const NamedEffect& effect : d.effects) text += " " + effect.effect->name();
  for (const Unexplained& left : d.unexplained) text += " ?" + left.channel + "~" + left.depends_on;
  for (const RejectedEffect& r : d.rejected) text += "\n  " + r.name + ": " + r.reason;
  return text;
}

}  // namespace cdprcal::test
