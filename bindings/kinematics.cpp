// kinematics/: one cable as a function of q, and the whole robot at a pose.
#include "cdprcal/kinematics/cable.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/kinematics/platform.hpp"

#include "bindings.hpp"

namespace cdprcal::python {
namespace {

void require_ok(const CableState& state) {
  if (state.status != CableStatus::ok) {
    throw InputError(std::string("state: ") + to_string(state.status) +
                     ": derivatives exist only where status is ok; check it first");
  }
}

void register_cable(py::module_& module) {
  WordEnum<CableStatus>(module, "CableStatus", "Whether a cable's kinematics exist at a point.")
      .value("ok", CableStatus::ok)
      .value("anchor_inside_pulley", CableStatus::anchor_inside_pulley)
      .value("anchor_on_swivel_axis", CableStatus::anchor_on_swivel_axis)
      .finalize();
  py::class_<CableState>(module, "CableState",
                         "One cable's kinematics (eqs 2–5). Vectors are unit vectors in world "
                         "axes. Meaningless unless status is ok.")
      .def_readonly("status", &CableState::status)
      .def_readonly("length_m", &CableState::length_m,
                    "l, eq. 5: free part plus the arc on the pulley [m].")
      .def_readonly("swivel_rad", &CableState::swivel_rad, "sigma, eq. 2 [rad].")
      .def_readonly("tangency_rad", &CableState::tangency_rad, "psi, eq. 4 [rad].")
      .def_readonly("free_length_m", &CableState::free_length_m, "‖rho‖ [m].")
      .def_readonly("radial_distance_m", &CableState::radial_distance_m, "u·q [m].")
      .def_readonly("radial", &CableState::radial, "u [3]: from D to the pulley centre C.")
      .def_readonly("groove_normal", &CableState::groove_normal, "w = k × u [3].")
      .def_readonly("contact", &CableState::contact, "n [3]: from C to B, where the cable leaves.")
      .def_readonly("direction", &CableState::direction,
                    "t [3]: along the cable, from B to the platform.");
  py::class_<CableDerivatives>(module, "CableDerivatives",
                               "First derivatives of one cable by q [m] and pulley radius [m].")
      .def_readonly("length_by_q", &CableDerivatives::length_by_q, "t [3].")
      .def_readonly("swivel_by_q", &CableDerivatives::swivel_by_q, "w/(u·q) [3] [rad/m].")
      .def_readonly("tangency_by_q", &CableDerivatives::tangency_by_q, "n/‖rho‖ [3] [rad/m].")
      .def_readonly("direction_by_q", &CableDerivatives::direction_by_q, "T of eq. A5 [3, 3].")
      .def_readonly("length_by_radius", &CableDerivatives::length_by_radius)
      .def_readonly("tangency_by_radius", &CableDerivatives::tangency_by_radius, "[rad/m].")
      .def_readonly("direction_by_radius", &CableDerivatives::direction_by_radius, "[3] [1/m].");
  module.def("cable_state", &cable_state, py::arg("pulley"), py::arg("q_world_m"),
             "CableState for q [3] [m], world axes, from the pulley's entry D to the platform "
             "anchor A.");
  module.def(
      "cable_derivatives",
      [](const Pulley& pulley, const CableState& state) {
        require_ok(state);
        return cable_derivatives(pulley, state);
      },
      py::arg("pulley"), py::arg("state"),
      "Derivatives at a state. Raises InputError unless state.status is ok.");
}

}  // namespace

void register_kinematics(py::module_& module) {
  register_cable(module);
  py::class_<PlatformState>(module, "PlatformState",
                            "Inverse kinematics of all cables at one pose (eqs 2–5).")
      .def_readonly("valid", &PlatformState::valid, "Every cable's status is ok.")
      .def_readonly("cable_count", &PlatformState::cable_count)
      .def_readonly("rotation", &PlatformState::rotation, "R_world_platform [3, 3].")
      .def_property_readonly(
          "anchor_arm_m",
          [](const PlatformState& state) {
            Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> arms(state.cable_count, 3);
            for (int i = 0; i < state.cable_count; ++i) arms.row(i) = state.anchor_arm_m[i];
            return arms;
          },
          "R a′ [n, 3] [m]: from P to each platform anchor, world axes.")
      .def_readonly("centre_of_mass_arm_m", &PlatformState::centre_of_mass_arm_m,
                    "R s′ [3] [m]: from P to the centre of mass, world axes.")
      .def_property_readonly(
          "cable",
          [](const PlatformState& state) {
            return std::vector<CableState>(state.cable.begin(),
                                           state.cable.begin() + state.cable_count);
          },
          "List of n CableState; copies.")
      .def_property_readonly("length_m", &PlatformState::length_m, "Cable lengths [n] [m], eq. 5.")
      .def_property_readonly("swivel_rad", &PlatformState::swivel_rad,
                             "Swivel angles [n] [rad], eq. 2.");
  module.def("platform_state", &platform_state, py::arg("robot"), py::arg("pose"),
             "PlatformState of a robot at a pose; see its `valid`.");
  module.def("length_jacobian", &length_jacobian, py::arg("state"),
             "dl/ddelta [n, 6] for a world-frame twist: row i is (t, a′ × t), eq. 7.");
  module.def("swivel_jacobian", &swivel_jacobian, py::arg("state"),
             "dsigma/ddelta [n, 6]: row i is (w, a′ × w)/(u·q).");
  module.def(
      "obstruction",
      [](const Robot& robot, const Pose& pose) {
        return obstruction(robot, pose, platform_state(robot, pose));
      },
      py::arg("robot"), py::arg("pose"),
      "What of the robot's surroundings is in the way at a pose, in words; empty: nothing. The "
      "platform is the box along the world's axes around P, its anchors and its outline_m.");
  module.def("describe_invalid", &describe_invalid, py::arg("state"),
             "Why a state is not valid, with the cable's number from 1; empty when it is.");
}

}  // namespace cdprcal::python
