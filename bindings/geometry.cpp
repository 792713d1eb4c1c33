// geometry/: poses, rotations, Tait–Bryan angles. Rotations are 3×3 arrays in Python.
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/geometry/pose.hpp"

#include "bindings.hpp"

namespace cdprcal::python {
namespace {

Pose make_pose(const Vector3& position_m, const Matrix3& rotation) {
  require_finite(position_m, "position_m");
  return {position_m, rotation_from_matrix(rotation)};
}

void register_euler(py::module_& module) {
  WordEnum<EulerConvention>(module, "EulerConvention",
                            "Intrinsic order of the Tait–Bryan angles: XYZ means "
                            "R = Rx(roll) Ry(pitch) Rz(yaw).")
      .value("XYZ", EulerConvention::XYZ)
      .value("XZY", EulerConvention::XZY)
      .value("YXZ", EulerConvention::YXZ)
      .value("YZX", EulerConvention::YZX)
      .value("ZXY", EulerConvention::ZXY)
      .value("ZYX", EulerConvention::ZYX)
      .finalize();
  module.def("parse_euler_convention", &parse_euler_convention, py::arg("name"),
             "'XYZ' … → EulerConvention. Raises InputError naming the accepted orders.");
  module.def(
      "rotation_from_euler",
      [](const Vector3& angles, EulerConvention convention) -> Matrix3 {
        return rotation_from_euler(angles, convention).toRotationMatrix();
      },
      py::arg("roll_pitch_yaw_rad"), py::arg("convention"),
      "(roll, pitch, yaw) [rad] → R_world_platform [3, 3].");
  module.def("euler_from_rotation", &euler_from_rotation, py::arg("rotation"),
             py::arg("convention"),
             "R_world_platform [3, 3] → (roll, pitch, yaw) [rad], the middle angle in "
             "[-pi/2, pi/2]; at gimbal lock the last angle is 0.");
  module.def("euler_rate_matrix", &euler_rate_matrix, py::arg("roll_pitch_yaw_rad"),
             py::arg("convention"),
             "H [3, 3] of omega_world = H · d(roll, pitch, yaw)/dt; singular at gimbal lock.");
}

void register_pose(py::module_& module) {
  py::class_<Pose>(module, "Pose",
                   "Pose of the platform frame P in the world frame O: "
                   "x_world = position_m + rotation @ x_platform. Immutable.")
      .def(py::init(&make_pose), py::arg("position_m") = Vector3(Vector3::Zero()),
           py::arg_v("rotation", Matrix3(Matrix3::Identity()), "numpy.eye(3)"),
           "position_m [3] in world axes; rotation [3, 3] R_world_platform. Raises InputError when "
           "rotation is not a rotation within 1e-6 or position_m is not finite.")
      .def_static(
          "from_euler",
          [](const Vector3& position_m, const Vector3& angles, EulerConvention convention) {
            require_finite(position_m, "position_m");
            require_finite(angles, "roll_pitch_yaw_rad");
            return Pose{position_m, rotation_from_euler(angles, convention)};
          },
          py::arg("position_m"), py::arg("roll_pitch_yaw_rad"),
          py::arg_v("convention", EulerConvention::XYZ, "EulerConvention.XYZ"),
          "The pose at position_m [3] with (roll, pitch, yaw) [rad] in the given convention.")
      .def_property_readonly(
          "position_m", [](const Pose& pose) { return pose.position_m; },
          "Position of P in world axes [3]; a copy.")
      .def_property_readonly("rotation", &Pose::rotation_matrix, "R_world_platform [3, 3]; a copy.")
      .def(
          "euler_rad",
          [](const Pose& pose, EulerConvention convention) {
            return euler_from_rotation(pose.rotation_matrix(), convention);
          },
          py::arg_v("convention", EulerConvention::XYZ, "EulerConvention.XYZ"),
          "(roll, pitch, yaw) [rad] in the given convention.")
      .def("__repr__",
           [](const Pose& pose) {
             return "Pose(position_m=" + to_text(pose.position_m) +
                    ", rotation_vector_rad=" + to_text(log_so3(pose.rotation)) + ")";
           })
      .def(py::pickle(
          [](const Pose& pose) {
            return py::make_tuple(pose.position_m, Eigen::Vector4d(pose.rotation.coeffs()));
          },
          [](const py::tuple& state) {
            Pose pose;
            pose.position_m = state[0].cast<Vector3>();
            pose.rotation.coeffs() = state[1].cast<Eigen::Vector4d>();
            return pose;
          }));
  module.def(
      "plus",
      [](const Pose& pose, const Vector6& twist) {
        require_finite(twist.head<3>(), "twist");
        require_finite(twist.tail<3>(), "twist");
        return plus(pose, twist);
      },
      py::arg("pose"), py::arg("twist"),
      "pose ⊕ twist, twist [6] = (dp [m], dtheta [rad]) in world axes: p + dp, "
      "exp(dtheta) R.");
  module.def("minus", &minus, py::arg("to"), py::arg("from_"),
             "The twist [6] (m, rad, world axes) for which plus(from_, twist) is `to`.");
  module.def("rotation_distance_rad", &rotation_distance_rad, py::arg("a"), py::arg("b"),
             "Geodesic angle [rad] between two orientations.");
  module.def("rotation_angle_difference_rad", &rotation_angle_difference_rad, py::arg("a"),
             py::arg("b"),
             "|alpha_a - alpha_b| [rad], eq. 20 of the paper: not a distance between rotations, "
             "kept to compare with it.");
}

}  // namespace

void register_geometry(py::module_& module) {
  register_euler(module);
  register_pose(module);
  module.def(
      "exp_so3", [](const Vector3& v) -> Matrix3 { return exp_so3(v).toRotationMatrix(); },
      py::arg("rotation_vector_rad"), "Rotation vector [3] [rad] → rotation [3, 3].");
  module.def(
      "log_so3", [](const Matrix3& rotation) { return log_so3(rotation_from_matrix(rotation)); },
      py::arg("rotation"),
      "Rotation [3, 3] → rotation vector [3] [rad], of norm ≤ pi. Raises InputError when it is "
      "not a rotation.");
}

}  // namespace cdprcal::python
