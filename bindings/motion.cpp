// motion: where the platform is at every sample, after the start-up.
#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>

#include "bindings.hpp"
#include "cdprcal/motion/calibrate_in_motion.hpp"
#include "cdprcal/motion/tracker.hpp"
#include "cdprcal/startup/robot_sample.hpp"
#include "people.hpp"

namespace cdprcal::python {
namespace {

/// What drives and AHRS say at one moment as a measurement.
Measurement measurement_of(const RobotSample& sample) {
  Measurement m;
  m.time_s = std::isfinite(sample.drives_time_s) ? sample.drives_time_s : sample.time_s;
  m.kind = PoseKind::kinematic_pose;
  m.length_m = sample.length_m;
  m.swivel_rad = sample.swivel_rad;
  m.tension_N = sample.tension_N;
  m.roll_pitch_yaw_rad = sample.roll_pitch_yaw_rad;
  m.specific_force_m_s2 = sample.specific_force_m_s2;
  m.angular_velocity_rad_s = sample.angular_velocity_rad_s;
  return m;
}

/// One number a sample and entry of `of`, as an array [N, …].
template <class Of>
py::array_t<double> rows_of(const std::vector<TrackedSample>& samples,
                            std::vector<py::ssize_t> shape, const Of& of) {
  py::ssize_t width = 1;
  for (const py::ssize_t size : shape) width *= size;
  shape.insert(shape.begin(), static_cast<py::ssize_t>(samples.size()));
  py::array_t<double> out(shape);
  double* to = out.mutable_data();
  for (const TrackedSample& sample : samples) {
    const auto values = of(sample);
    for (py::ssize_t i = 0; i < width; ++i) *to++ = values(i);
  }
  return out;
}

using Quaternion = Eigen::Matrix<double, 4, 1>;

void register_tracked_sample(py::module_& module) {
  py::class_<TrackedSample>(module, "TrackedSample",
                            "What is known of the platform after one sample. Immutable.")
      .def_readonly("time_s", &TrackedSample::time_s)
      .def_property_readonly("pose", [](const TrackedSample& s) { return s.state.pose; })
      .def_property_readonly(
          "twist", [](const TrackedSample& s) { return s.state.twist; },
          "[6]: velocity of P [m/s], angular velocity [rad/s], world axes.")
      .def_property_readonly(
          "acceleration", [](const TrackedSample& s) { return s.state.acceleration; },
          "[6]: derivative of the twist.")
      .def_readonly("pose_covariance", &TrackedSample::pose_covariance,
                    "[6, 6]: position [m], world-frame rotation vector [rad].")
      .def_readonly("twist_covariance", &TrackedSample::twist_covariance, "[6, 6]")
      .def_readonly("trusted", &TrackedSample::trusted,
                    "Whether the readings agree with one another and with the calibration; the "
                    "pose is no good otherwise.")
      .def_readonly("left_out", &TrackedSample::left_out,
                    "Readings of this sample that contradict the others.")
      .def_readonly("reason", &TrackedSample::reason, "Not trusted: why. Empty otherwise.")
      .def("__repr__", [](const TrackedSample& s) {
        return "<TrackedSample at " + std::to_string(s.time_s) + " s, position " +
               to_text(s.state.pose.position_m) + " m" + (s.trusted ? "" : ", not trusted") + ">";
      });
}

void register_track(py::module_& module) {
  py::class_<Track> track_class(
      module, "Track", "Pose and twist of the platform at every sample of a run. Immutable.");
  track_class.def("__len__", [](const Track& self) { return self.samples.size(); })
      .def("__getitem__",
           [](const Track& self, py::ssize_t index) {
             const auto count = static_cast<py::ssize_t>(self.samples.size());
             if (index < -count || index >= count) throw py::index_error("no such sample");
             return self.samples[static_cast<std::size_t>(index < 0 ? index + count : index)];
           })
      .def_readonly("convention", &Track::convention, "EulerConvention of the robot's sensors.")
      .def_property_readonly(
          "time_s",
          [](const Track& self) {
            return rows_of(self.samples, {}, [](const TrackedSample& s) {
              return Eigen::Matrix<double, 1, 1>(s.time_s);
            });
          },
          "[N]")
      .def_property_readonly(
          "position_m",
          [](const Track& self) {
            return rows_of(self.samples, {3}, [](const TrackedSample& s) -> const Vector3& {
              return s.state.pose.position_m;
            });
          },
          "[N, 3]: P in the world.")
      .def_property_readonly(
          "quaternion_wxyz",
          [](const Track& self) {
            return rows_of(self.samples, {4}, [](const TrackedSample& s) {
              const Eigen::Quaterniond& q = s.state.pose.rotation;
              return Quaternion(q.w(), q.x(), q.y(), q.z());
            });
          },
          "[N, 4]: R_world_platform, unit quaternions.")
      .def_property_readonly(
          "roll_pitch_yaw_rad",
          [](const Track& self) {
            return rows_of(self.samples, {3}, [&](const TrackedSample& s) {
              return euler_from_rotation(s.state.pose.rotation_matrix(), self.convention);
            });
          },
          "[N, 3] in `convention`; the yaw is absolute.")
      .def_property_readonly(
          "twist",
          [](const Track& self) {
            return rows_of(self.samples, {6},
                           [](const TrackedSample& s) -> const Vector6& { return s.state.twist; });
          },
          "[N, 6]: velocity of P [m/s], angular velocity [rad/s], world axes.")
      .def_property_readonly(
          "pose_covariance",
          [](const Track& self) {
            return rows_of(self.samples, {6, 6}, [](const TrackedSample& s) -> const Matrix6& {
              return s.pose_covariance;
            });
          },
          "[N, 6, 6]: position [m], world-frame rotation vector [rad].")
      .def_property_readonly(
          "twist_covariance",
          [](const Track& self) {
            return rows_of(self.samples, {6, 6}, [](const TrackedSample& s) -> const Matrix6& {
              return s.twist_covariance;
            });
          },
          "[N, 6, 6]")
      .def_property_readonly(
          "trusted",
          [](const Track& self) {
            py::array_t<bool> out(static_cast<py::ssize_t>(self.samples.size()));
            std::transform(self.samples.begin(), self.samples.end(), out.mutable_data(),
                           [](const TrackedSample& s) { return s.trusted; });
            return out;
          },
          "[N]: whether the readings agree with one another and with the calibration.");
  def_repr(track_class);
  def_people(track_class,
             "A row a sample: time_s, position, roll, pitch, yaw, twist, their standard "
             "deviations, trusted.",
             false);
  module.def(
      "track",
      [](const Calibration& calibration, const Log& log, int segment) {
        const py::gil_scoped_release release;
        return track(calibration, log, segment);
      },
      py::arg("calibration"), py::arg("log"), py::arg("segment") = -1,
      "Pose, twist and their covariances at every sample of a run, from its calibration: the log "
      "that was calibrated, or one that goes on counting from it. segment: which is the run, from "
      "0, -1 the last. Raises InputError for a calibration without a pose that can be trusted.");
}

void register_tracker(py::module_& module) {
  py::class_<Tracker>(
      module, "Tracker",
      "Pose and twist from sample to sample, in some microseconds each: an extended Kalman filter "
      "on SE(3) over pose, twist and acceleration. What the calibration leaves open is considered "
      "in the covariances and not estimated.")
      .def(py::init<const Calibration&>(), py::arg("calibration"),
           "Raises InputError for a calibration without a pose that can be trusted.")
      .def(
          "add",
          [](Tracker& self, const RobotSample& sample) { return self.add(measurement_of(sample)); },
          py::arg("sample"),
          "Takes the next RobotSample, which counts from the same power-on as the calibration's "
          "log; TrackedSample after it. After a gap of more than 2 s it starts anew. Raises "
          "InputError for a sample that is not after the last one or has more cables.")
      .def_property_readonly("latest", &Tracker::latest,
                             "TrackedSample: time_s is NaN before any.");
}

void register_in_motion(py::module_& module) {
  py::class_<Swing>(module, "Swing",
                    "A mode in which a platform with locked winches swings. Immutable.")
      .def_readonly("model_hz", &Swing::model_hz, "As the model has it about the mean pose.")
      .def_readonly("measured_hz", &Swing::measured_hz,
                    "Of the motion's peak that has its shape; NaN: there is none.")
      .def_readonly("size_m", &Swing::size_m,
                    "Root mean square of the motion in it: of the same kinetic energy as such a "
                    "shift of the mass.")
      .def("__repr__", [](const Swing& self) {
        char text[80];
        std::snprintf(text, sizeof text, "<Swing at %.3g Hz, model %.3g Hz>", self.measured_hz,
                      self.model_hz);
        return std::string(text);
      });
  py::class_<Push>(module, "Push",
                   "A time in which something pushes a platform whose winches stand still. "
                   "Immutable.")
      .def_readonly("begin_s", &Push::begin_s, "Time of the log.")
      .def_readonly("end_s", &Push::end_s, "Time of the log.")
      .def_readonly("before_J", &Push::before_J, "Energy of the swing before it.")
      .def_readonly("after_J", &Push::after_J, "Energy of the swing after it.")
      .def("__repr__", [](const Push& self) {
        char text[96];
        std::snprintf(text, sizeof text, "<Push at %.1f to %.1f s, %.3g to %.3g J>", self.begin_s,
                      self.end_s, self.before_J, self.after_J);
        return std::string(text);
      });
  py::class_<InMotion>(module, "InMotion",
                       "A calibration in which the balance counts in motion too. Immutable.")
      .def_readonly("calibration", &InMotion::calibration,
                    "Calibration of rests and moments of motion; what calibrate() says where "
                    "motion adds nothing.")
      .def_readonly("in_motion", &InMotion::in_motion, "Whether it is that of rests and motion.")
      .def_property_readonly(
          "damping_shift_1_s", [](const InMotion& self) { return self.beside.damping_1_s[0]; },
          "1/T: forces 2m/T v hold the centre of mass back.")
      .def_property_readonly(
          "damping_turn_1_s", [](const InMotion& self) { return self.beside.damping_1_s[1]; },
          "1/T: moments 2I/T w hold turns back.")
      .def_property_readonly(
          "late",
          [](const InMotion& self) {
            std::vector<AppliedEffect> out;
            for (const ActiveEffect& active : self.beside.late) {
              out.push_back(applied_effect(*active.effect,
                                           active.effect->to_reported(active.values),
                                           self.calibration.problem.robot.cable_count()));
            }
            return out;
          },
          "List of AppliedEffect: what makes readings of one moment belong to different ones "
          "(sensor_delay, swivel_delay ...), found beside the pose where it is clear; a copy.")
      .def_readonly("moments_a_reading", &InMotion::moments_a_reading,
                    "So many moments of motion are worth one independent reading.")
      .def_readonly("swings", &InMotion::swings,
                    "List of Swing, the slowest mode first: where the winches were locked for long "
                    "enough.")
      .def_readonly("pushes", &InMotion::pushes,
                    "List of Push: the swing gains energy there while the winches stand still; no "
                    "balance counts.")
      .def("__repr__", [](const InMotion& self) {
        return std::string("<InMotion ") + to_string(self.calibration.result.status) + ", " +
               (self.in_motion ? std::to_string(self.calibration.kinematic_poses) + " moments"
                               : std::string("of rests alone")) +
               ">";
      });
  module.def(
      "calibrate_in_motion",
      [](const Robot& robot, const Log& log, const std::optional<CalibrateOptions>& options,
         int most_moments, int rounds) {
        const py::gil_scoped_release release;
        return calibrate_in_motion(robot, log,
                                   {.calibrate = options.value_or(CalibrateOptions{}),
                                    .most_moments = most_moments,
                                    .rounds = rounds});
      },
      py::arg("robot"), py::arg("log"), py::arg("options") = py::none(),
      py::arg("most_moments") = InMotionOptions().most_moments,
      py::arg("rounds") = InMotionOptions().rounds,
      "As calibrate(), with the balance of forces and inertia at moments between the rests, or all "
      "along where there are none. InMotion. Raises InputError as calibrate() does, and for options "
      "that leave motion out (method static or kinematic, formulation paper, specified noise, "
      "at_s).");
}

}  // namespace

void register_motion(py::module_& module) {
  register_tracked_sample(module);
  register_track(module);
  register_tracker(module);
  register_in_motion(module);
}

}  // namespace cdprcal::python
