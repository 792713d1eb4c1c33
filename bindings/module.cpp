// cdprcal._core: the C++ core under the same names.
#include <exception>
#include <sstream>

#include "bindings.hpp"
#include "versions.hpp"

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

Points to_rows(const std::vector<Vector3>& points) {
  Points rows(points.size(), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = points[i];
  return rows;
}

std::vector<CableVector> to_cable_vectors(const std::vector<Eigen::VectorXd>& rows,
                                          const char* name, int cable_count) {
  std::vector<CableVector> out;
  out.reserve(rows.size());
  for (const Eigen::VectorXd& row : rows) out.push_back(to_cable_vector(row, name, cable_count));
  return out;
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

namespace {

PYBIND11_CONSTINIT py::gil_safe_call_once_and_store<py::object> input_error;

/// InputError → cdprcal.InputError. Not register_exception: a message may quote bytes of a damaged
/// file, and what is not UTF-8 must not become a UnicodeDecodeError.
void register_input_error(py::module_& module) {
  input_error.call_once_and_store_result([&module] {
    py::exception<InputError> type(module, "InputError", PyExc_ValueError);
    type.doc() =
        "Wrong use or unusable input. The message names the file, line or field and what to do.";
    return py::object(type);
  });
  py::register_exception_translator([](std::exception_ptr pending) {
    try {
      if (pending) std::rethrow_exception(pending);
    } catch (const InputError& error) {
      const std::string text = error.what();
      const auto message = py::reinterpret_steal<py::object>(
          PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace"));
      PyErr_SetObject(input_error.get_stored().ptr(), message.ptr());
    }
  });
}

newfunc make_instance = nullptr;

/// The base of all classes has no instances. pybind11 aborts the interpreter where one is asked
/// for, as pickle protocols 0 and 1 do of classes that have no pickle.
PyObject* refuse_base(PyTypeObject* type, PyObject* args, PyObject* kwargs) {
  if (reinterpret_cast<PyObject*>(type) == py::detail::get_internals().instance_base) {
    PyErr_SetString(PyExc_TypeError, "pybind11_object has no instances");
    return nullptr;
  }
  return make_instance(type, args, kwargs);
}

/// Before any class is made, since each inherits it.
void guard_base() {
  auto* const base = reinterpret_cast<PyTypeObject*>(py::detail::get_internals().instance_base);
  if (base->tp_new == refuse_base) return;
  make_instance = base->tp_new;
  base->tp_new = refuse_base;
}

}  // namespace
}  // namespace cdprcal::python

PYBIND11_MODULE(_core, module) {
  using namespace cdprcal::python;
  module.doc() =
      "C++ core of cdprcal. SI units; the unit is the name's suffix. Poses and rotations map the "
      "platform frame P into the world frame O.\n\n"
      "Wrong use raises InputError; a numerical failure is a status in the result.";
  guard_base();
  register_input_error(module);
  register_geometry(module);
  register_model(module);
  register_kinematics(module);
  register_statics(module);
  register_equilibria(module);
  register_workspace(module);
  register_planning(module);
  register_readings(module);
  register_delimited_text(module);
  register_noise(module);
  register_calibration(module);
  register_diagnosis(module);
  register_synthetic(module);
  bind_simulator(module);
  register_online(module);
  register_motion(module);
  register_frame(module);
  register_versions(module);
}
