// calibration/online and planning/next_stop: what is known, and what to measure next, while a robot
// is started up.
#include "cdprcal/calibration/online.hpp"

#include "bindings.hpp"
#include "cdprcal/planning/next_stop.hpp"
#include "progress.hpp"

namespace cdprcal::python {
namespace {

void register_online_calibration(py::module_& module) {
  py::class_<OnlineCalibration>(
      module, "OnlineCalibration",
      "The estimate while the robot is being measured, a stretch of the log at a time: the same "
      "problem as calibrate() poses, started from what was solved before. "
      "calibrate() on the finished log has the last word.")
      .def(py::init([](const Robot& robot, const std::optional<CalibrateOptions>& options) {
             return OnlineCalibration(robot, options.value_or(CalibrateOptions{}));
           }),
           py::arg("robot"), py::arg("options") = py::none(),
           "options: at_s, segment and guess must be unset. Raises InputError.")
      .def(
          "add",
          [](OnlineCalibration& self, const Log& since_last) {
            const py::gil_scoped_release release;
            return self.add(since_last).result;
          },
          py::arg("since_last"),
          "Takes what was read since the last call, best up to the end of a rest; the first sample "
          "of the first stretch is the reference. CalibrationResult after it: what calibrate() "
          "would say, unobservable while there is too little. Raises InputError for a stretch that "
          "does not fit the robot or begins before the last one ended.")
      .def_property_readonly(
          "calibration", [](const OnlineCalibration& self) { return self.calibration(); },
          "So far; a copy.");
}

void register_next_stop(py::module_& module) {
  py::class_<AskedAccuracy>(module, "AskedAccuracy",
                            "Standard deviations of the initial pose that somebody wants, of the "
                            "worst axis whichever way it points. Immutable.")
      .def(py::init([](double position_m, double rotation_rad) {
             if (!(position_m > 0.0) || !(rotation_rad > 0.0)) {
               throw InputError("asked accuracy: position_m and rotation_rad must be above 0");
             }
             return AskedAccuracy{position_m, rotation_rad};
           }),
           py::kw_only(), py::arg("position_m"), py::arg("rotation_rad"))
      .def_readonly("position_m", &AskedAccuracy::position_m)
      .def_readonly("rotation_rad", &AskedAccuracy::rotation_rad)
      .def(
          "reached",
          [](const AskedAccuracy& asked, const Matrix6& covariance) {
            return reached(covariance, asked);
          },
          py::arg("covariance"),
          "Whether a covariance [6, 6] of the initial pose (position [m], world-frame rotation "
          "vector [rad]) is good enough.");
  py::class_<NextStop>(module, "NextStop",
                       "The stop to measure next and how to get there. Immutable.")
      .def_readonly("stop", &NextStop::stop, "Which of the plan's poses, from 0.")
      .def_readonly("way", &NextStop::way, "StartUpPlan: set-points to pass, then the stop.")
      .def_readonly("time_s", &NextStop::time_s, "With settling and measuring.")
      .def_property_readonly(
          "predicted_deviation", [](const NextStop& next) { return next.predicted_deviation; },
          "[6] of the initial pose after it, from rests alone [m, rad].");
  py::class_<NextStopChooser>(
      module, "NextStopChooser",
      "Chooses among the measured stops of a plan what to measure next: the stop that teaches most "
      "about the initial pose per second (A-optimal in the units of the accuracy asked for).")
      .def(py::init([](const Robot& robot, const Plan& plan, int threads,
                       const ProgressCallback<double>& progress) {
             Progress ask(progress);
             std::unique_ptr<NextStopChooser> chooser;
             {
               const py::gil_scoped_release release;
               chooser = std::make_unique<NextStopChooser>(
                   robot, plan, threads, [&ask](double share) { return ask(share); });
             }
             ask.rethrow();
             return chooser;
           }),
           py::arg("robot"), py::arg("plan"), py::arg("threads") = 0,
           py::arg("progress") = py::none(),
           "Follows the ways between all stops. Raises InputError for a plan of another robot.")
      .def(
          "choose",
          [](const NextStopChooser& self, const std::vector<int>& measured, const Pose& initial,
             const Eigen::VectorXd& reading_N, const AskedAccuracy& asked) {
            const CableVector reading = to_cable_vector(reading_N, "initial_reading_N");
            const py::gil_scoped_release release;
            return self.choose(measured, initial, reading, asked);
          },
          py::arg("measured"), py::arg("initial"), py::arg("initial_reading_N"), py::arg("asked"),
          "measured: stops so far, in order, from 0; the robot is at the last one, or at τ0. "
          "initial: the estimate of ζ0, initial_reading_N [n] the load cells there. None: no stop "
          "is left that can be reached.")
      .def(
          "choose_by_worth",
          [](const NextStopChooser& self, const std::vector<int>& measured,
             const std::vector<double>& worth) {
            const py::gil_scoped_release release;
            return self.choose(measured, worth);
          },
          py::arg("measured"), py::arg("worth"),
          "The stop of the greatest worth per second. worth: of each pose of the plan, in any unit. "
          "None: no stop is left that is worth anything and can be reached.");
}

}  // namespace

void register_online(py::module_& module) {
  register_online_calibration(module);
  register_next_stop(module);
}

}  // namespace cdprcal::python
