// What the binding files share: one register function a stage, and checked array conversion.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "cdprcal/error.hpp"
#include "cdprcal/types.hpp"
#include "word_enum.hpp"

namespace cdprcal::python {

namespace py = pybind11;

void register_geometry(py::module_& module);
void register_model(py::module_& module);
void register_kinematics(py::module_& module);
void register_statics(py::module_& module);
void register_equilibria(py::module_& module);
void register_workspace(py::module_& module);
void register_planning(py::module_& module);
void register_readings(py::module_& module);
void register_delimited_text(py::module_& module);
void register_synthetic(py::module_& module);
void bind_simulator(py::module_& module);
void register_noise(py::module_& module);
void register_calibration(py::module_& module);
void register_online(py::module_& module);
void register_motion(py::module_& module);
void register_frame(py::module_& module);
void register_diagnosis(py::module_& module);

/// An array of any length as a CableVector. The Eigen caster would write past the fixed capacity
/// when there are more than kMaxCables numbers, so per-cable arrays enter through here.
CableVector to_cable_vector(const Eigen::VectorXd& values, const char* name);
/// The same, of exactly `cable_count` numbers.
CableVector to_cable_vector(const Eigen::VectorXd& values, const char* name, int cable_count);

/// Rows of such arrays, set-points for one; each of exactly `cable_count` numbers.
std::vector<CableVector> to_cable_vectors(const std::vector<Eigen::VectorXd>& rows,
                                          const char* name, int cable_count);

/// Points as rows of an array.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
Points to_rows(const std::vector<Vector3>& points);

/// Throws InputError naming the field unless every number is finite.
void require_finite(const Eigen::Ref<const Eigen::VectorXd>& values, const char* name);

/// str(array) in one line, for __repr__.
std::string to_text(const Eigen::Ref<const Eigen::VectorXd>& values);

}  // namespace cdprcal::python
