// statics/: wrenches, stiffness and tensions.
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"
#include "cdprcal/statics/wrench.hpp"

#include "bindings.hpp"

namespace cdprcal::python {
namespace {

CableVector tensions_of(const PlatformState& state, const Eigen::VectorXd& tension_N) {
  return to_cable_vector(tension_N, "tension_N", state.cable_count);
}

void register_wrench(py::module_& module) {
  module.def("structure_matrix", &structure_matrix, py::arg("state"),
             "Structure matrix Xi^T [6, n], eq. 7: column i is (t, a′ × t), world axes, about P.");
  module.def("gravity_wrench", &gravity_wrench, py::arg("robot"), py::arg("state"),
             "f of eq. 6 [6] [N, Nm]: weight and its moment about P, world axes.");
  module.def(
      "wrench_residual",
      [](const Robot& robot, const PlatformState& state, const Eigen::VectorXd& tension_N) {
        return wrench_residual(robot, state, tensions_of(state, tension_N));
      },
      py::arg("robot"), py::arg("state"), py::arg("tension_N"),
      "Xi^T tau - f [6] [N, Nm], world axes, about P: zero at a static equilibrium (eq. 6).");
  module.def(
      "tension_stiffness",
      [](const PlatformState& state, const Eigen::VectorXd& tension_N) {
        return tension_stiffness(state, tensions_of(state, tension_N));
      },
      py::arg("state"), py::arg("tension_N"),
      "K of eq. A5 [6, 6]: d(Xi^T tau)/ddelta at constant tensions.");
  module.def("gravity_stiffness", &gravity_stiffness, py::arg("robot"), py::arg("state"),
             "Q [6, 6]: -df/ddelta.");
  module.def(
      "stiffness",
      [](const Robot& robot, const PlatformState& state, const Eigen::VectorXd& tension_N) {
        return stiffness(robot, state, tensions_of(state, tension_N));
      },
      py::arg("robot"), py::arg("state"), py::arg("tension_N"),
      "K + Q [6, 6]; at an equilibrium the Hessian of the potential energy.");
  module.def(
      "free_motion_stiffness",
      [](const Robot& robot, const PlatformState& state, const Eigen::VectorXd& tension_N) {
        return free_motion_stiffness(robot, state, tensions_of(state, tension_N));
      },
      py::arg("robot"), py::arg("state"), py::arg("tension_N"),
      "K_f of eq. A4 [6-n, 6-n]: K + Q on the motions that no cable length resists.");
  module.def("free_motion_basis", &free_motion_basis, py::arg("state"),
             "Orthonormal basis [6, m] of the motions that no cable length resists.");
  module.def(
      "motion_basis", [](const Robot& robot) { return Eigen::MatrixXd(motion_basis(robot)); },
      py::arg("robot"),
      "Orthonormal basis [6, f] of the twists that the platform's guides allow, shifts first.");
  module.def(
      "potential_energy",
      [](const Robot& robot, const Pose& pose, const PlatformState& state,
         const Eigen::VectorXd& tension_N) {
        return potential_energy(robot, pose, state, tensions_of(state, tension_N));
      },
      py::arg("robot"), py::arg("pose"), py::arg("state"), py::arg("tension_N"),
      "Potential energy at constant tensions [J]; its gradient along a twist is wrench_residual.");
}

}  // namespace

void register_statics(py::module_& module) {
  register_wrench(module);
  WordEnum<WrenchRow>(module, "WrenchRow", "Rows of the wrench in Euler-rate coordinates.")
      .value("force_x", WrenchRow::force_x)
      .value("force_y", WrenchRow::force_y)
      .value("force_z", WrenchRow::force_z)
      .value("moment_roll", WrenchRow::moment_roll)
      .value("moment_pitch", WrenchRow::moment_pitch)
      .value("moment_yaw", WrenchRow::moment_yaw)
      .finalize();
  py::class_<TensionModel>(module, "TensionModel", "Modelled tensions at a pose.")
      .def_readonly("valid", &TensionModel::valid,
                    "False: the chosen rows are singular at this pose.")
      .def_readonly("tension_N", &TensionModel::tension_N, "tau [n] [N].")
      .def_readonly("by_twist", &TensionModel::by_twist, "dtau/ddelta [n, 6].");
  module.def("left_inverse_rows", &left_inverse_rows, py::arg("cable_count"),
             "The n wrench rows that the left inverse of eq. 12 solves. Raises InputError for "
             "n > 6.");
  module.def("tensions_left_inverse", &tensions_left_inverse, py::arg("robot"), py::arg("state"),
             py::arg("rows"), "Tensions by the paper's left inverse (eqs 11, 12) on n rows.");
  module.def("tensions_least_squares", &tensions_least_squares, py::arg("robot"), py::arg("state"),
             "Tensions of least squared wrench error, moments scaled by the characteristic "
             "length; for n ≤ 6 cables of full rank.");
  module.def("robot_size_m", &robot_size_m, py::arg("robot"),
             "Largest distance between pulleys or, when that is 0, of the platform's anchors [m].");
  module.def("characteristic_length_m", &characteristic_length_m, py::arg("robot"),
             "Root mean square distance of the platform anchors from the centre of mass [m].");
}

}  // namespace cdprcal::python
