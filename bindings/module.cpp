// cdprcal._core: the C++ core under the same names.
#include <cmath>
#include <sstream>

#include "bindings.hpp"

namespace cdprcal::python {

CableVector to_cable_vector(const Eigen::VectorXd& values, const char* name) {
  if (values.size() > kMaxCables) {
    throw InputError(std::string(name) + ": has " + std::to_string(values.size()) +
                     " values, one a cable; a robot has at most " + std::to_string(kMaxCables) +
                     " cables");
  }
  return values;
}

CableVector to_cable_vector(const Eigen::VectorXd& values, const char* name, int cable_count) {
  if (values.size() != cable_count) {
    throw InputError(std::string(name) + ": has " + std::to_string(values.size()) +
                     " values; the robot has " + std::to_string(cable_count) +
                     " cables: give one value a cable");
  }
  return to_cable_vector(values, name);
}

void require_finite(const Eigen::Ref<const Eigen::VectorXd>& values, const char* name) {
  if (!values.allFinite()) {
    throw InputError(std::string(name) + ": must be finite numbers, got " + to_text(values));
  }
}

std::string to_text(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::ostringstream text;
  text << '[';
  for (Eigen::Index i = 0; i < values.size(); ++i) text << (i > 0 ? ", " : "") << values[i];
  text << ']';
  return text.str();
}

}  // namespace cdprcal::python

PYBIND11_MODULE(_core, module) {
  using namespace cdprcal::python;
  module.doc() =
      "C++ core of cdprcal. SI units; the unit is the name's suffix. Poses and rotations map the "
      "platform frame P into the world frame O.\n\n"
      "Wrong use raises InputError; a numerical failure is a status in the result.";
  auto& input_error =
      py::register_exception<cdprcal::InputError>(module, "InputError", PyExc_ValueError);
  input_error.doc() =
      "Wrong use or unusable input. The message names the file, line or field and what to do.";
  register_geometry(module);
  register_model(module);
  register_kinematics(module);
  register_statics(module);
  register_acquisition(module);
  register_calibration(module);
  bind_simulator(module);
}
