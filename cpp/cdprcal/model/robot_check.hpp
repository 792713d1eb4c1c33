// Private: the checks of `finalise`, with the field kept apart so that the robot-file
// reader can point at its line.
#pragma once

#include <stdexcept>
#include <string>

#include "cdprcal/error.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal::detail {

/// A field that cannot be used: `field` is its path in the robot file ("cables[#1].pulley.x_axis",
/// cables counted from 1), `problem` says what is wrong and what to do.
struct FieldError : std::runtime_error {
  FieldError(std::string field_path, const std::string& problem)
      : std::runtime_error(problem), field(std::move(field_path)) {}
  std::string field;
};

/// Runs a check of a robot that no file stands behind: its FieldError becomes an InputError.
template <typename Check>
void as_input_error(const Check& check) {
  try {
    check();
  } catch (const FieldError& error) {
    throw InputError("robot: " + error.field + ": " + error.what());
  }
}

/// `finalise`, throwing FieldError.
void check_and_complete(Robot& robot);

/// Path of a cable's field: cable_field(0, "pulley.radius_m") is "cables[#1].pulley.radius_m".
std::string cable_field(std::size_t index, const std::string& name);

/// The wrench sigmas that `finalise` derives when they are 0: [N] and [Nm].
double default_wrench_force_N(const Robot& robot);
double default_wrench_moment_Nm(const Robot& robot);

}  // namespace cdprcal::detail
