// What a diagnosis model leaves of each reading, in the reading's own unit: for tables and
// pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/estimation/model.hpp"
#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// One pose of one run: modelled − measured at the fitted pose, offsets and effects included; NaN
/// where absent. tension_N is the smallest change of the tensions that would balance the platform
/// best, moments over the characteristic length: the wrench residual as seen from the load cells.
struct ModelResidual {
  std::size_t run = 0, pose = 0;
  double run_time_s = 0.0;
  PoseResidual residual;
};

/// All poses of all runs, in order. Poses that the model cannot be evaluated at are left out.
std::vector<ModelResidual> model_residuals(const DiagnosisModel& model);

/// A formula against the first of its variables, with what the readings say.
struct CoursePoint {
  std::size_t run = 0;
  int cable = -1;      ///< from 0; −1: of all cables
  double x = 0.0;      ///< the variable
  double added = 0.0;  ///< the formula
  double read = 0.0;   ///< reading − model without the formula
};
struct Course {
  std::string to, variable;
  std::vector<CoursePoint> points;
};

/// Of the effect `k` of a model; nothing unless it is a formula for readings (length, swivel,
/// attitude, tension). Throws InputError for one that the model does not have.
std::optional<Course> formula_course(const DiagnosisModel& model, std::size_t k);

}  // namespace cdprcal
