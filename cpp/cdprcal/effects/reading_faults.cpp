#include "cdprcal/effects/reading_faults.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cdprcal {
namespace {

const std::vector<double>& values_of(const AppliedEffect& fault) {
  return fault.parameters.front().values;
}

void scale_columns(const std::vector<double>& signs, LogMatrix& readings) {
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) *= signs[static_cast<std::size_t>(i)];
  }
}

void reorder(const std::vector<double>& order, LogMatrix& readings) {
  const LogMatrix read = readings;
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) = read.col(static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]) - 1);
  }
}

}  // namespace

bool is_reading_fault(const std::string& name) {
  return name == "length_sign" || name == "swivel_sign" || name == "cable_order" ||
         name == "length_unit" || name == "angle_unit";
}

std::string fault_problem(const AppliedEffect& fault) {
  const std::vector<double>& values = values_of(fault);
  const auto all = [&](auto condition) {
    return std::all_of(values.begin(), values.end(), condition);
  };
  if (fault.name == "length_sign" || fault.name == "swivel_sign") {
    return all([](double v) { return std::abs(v) == 1.0; }) ? "" : "must be 1 or -1 a cable";
  }
  if (fault.name == "cable_order") {
    std::vector<double> wanted(values.size());
    std::iota(wanted.begin(), wanted.end(), 1.0);
    const bool permutations = std::all_of(
        fault.parameters.begin(), fault.parameters.end(), [&](const AppliedEffect::Parameter& p) {
          return std::is_permutation(p.values.begin(), p.values.end(), wanted.begin(),
                                     wanted.end());
        });
    return permutations ? "" : "must hold every cable once, counted from 1";
  }
  return all([](double v) { return v > 0.0; }) ? "" : "must be positive";
}

Robot without_reading_faults(Robot robot) {
  std::erase_if(robot.effects, [](const AppliedEffect& e) { return is_reading_fault(e.name); });
  return robot;
}

void set_right(const AppliedEffect& fault, Log& log) {
  const std::vector<double>& values = values_of(fault);
  if (fault.name == "length_sign") {
    scale_columns(values, log.length_m);
  } else if (fault.name == "swivel_sign") {
    scale_columns(values, log.swivel_rad);
  } else if (fault.name == "cable_order") {
    reorder(values, log.length_m);
    reorder(values, log.swivel_rad);
    const std::vector<double>& of_tension = fault.parameters.back().values;
    reorder(of_tension, log.tension_N);
    reorder(of_tension, log.tension_setpoint_N);
  } else if (fault.name == "length_unit") {
    log.length_m *= values[0];
  } else if (fault.name == "angle_unit") {
    log.swivel_rad *= values[0];
    log.roll_pitch_yaw_rad *= values[1];
  }
}

}  // namespace cdprcal
