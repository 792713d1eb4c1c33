// calibration/: what is free, how to solve, what came out; and log → initial pose.
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/calibration/refine.hpp"
#include "cdprcal/estimation/linearise.hpp"

#include <optional>

#include "bindings.hpp"
#include "cdprcal/effects/applied.hpp"
#include "people.hpp"
#include "sensors.hpp"

namespace cdprcal::python {
namespace {

void require_cables(const Log& log, int cable_count) {
  if (cable_count != log.cable_count()) {
    throw InputError("cable_count: is " + std::to_string(cable_count) + ", the log has " +
                     std::to_string(log.cable_count()) + " cables; give that");
  }
}

void register_calibration_enums(py::module_& module) {
  WordEnum<PoseKind>(module, "PoseKind",
                     "static_pose: at rest, statics hold; kinematic_pose: geometry only.")
      .value("static_pose", PoseKind::static_pose, "static")
      .value("kinematic_pose", PoseKind::kinematic_pose, "kinematic")
      .finalize();
  WordEnum<StaticsModel>(module, "StaticsModel",
                         "none: j = lσε; left_inverse: eqs 10–12; wrench: eq. 6, all six "
                         "equations.")
      .value("none", StaticsModel::none)
      .value("left_inverse", StaticsModel::left_inverse)
      .value("wrench", StaticsModel::wrench)
      .finalize();
  WordEnum<CalibrationStatus>(module, "CalibrationStatus",
                              "Whether the initial pose can be trusted.")
      .value("converged", CalibrationStatus::converged)
      .value("not_converged", CalibrationStatus::not_converged)
      .value("unobservable", CalibrationStatus::unobservable)
      .finalize();
  WordEnum<Method>(module, "Method",
                   "unified; statics: τlσε on equilibria ('static'); kinematic: lσε.")
      .value("unified", Method::unified)
      .value("statics", Method::statics, "static")
      .value("kinematic", Method::kinematic)
      .finalize();
  WordEnum<Formulation>(module, "Formulation",
                        "full: wrench statics and all that pose 0 knows; paper: eqs 13–17.")
      .value("full", Formulation::full)
      .value("paper", Formulation::paper)
      .finalize();
  module.def("parse_method", &parse_method, py::arg("name"),
             "'unified', 'static' or 'kinematic' → Method; raises InputError.");
  WordEnum<NoiseSource>(module, "NoiseSource",
                        "from_data: estimated from the readings, outliers and slack cables "
                        "left out; specified: the robot file's sigma.")
      .value("from_data", NoiseSource::from_data, "data")
      .value("specified", NoiseSource::specified)
      .finalize();
  module.def("parse_noise_source", &parse_noise_source, py::arg("name"),
             "'data' or 'specified' → NoiseSource; raises InputError.");
  module.def("parse_formulation", &parse_formulation, py::arg("name"),
             "'full' or 'paper' → Formulation; raises InputError.");
}

Measurement make_measurement(double time_s, PoseKind kind, const Eigen::VectorXd& length_m,
                             const Eigen::VectorXd& swivel_rad, const Eigen::VectorXd& tension_N,
                             const Vector3& roll_pitch_yaw_rad, const py::kwargs& absolute) {
  Measurement measurement;
  measurement.time_s = time_s;
  measurement.kind = kind;
  measurement.length_m = to_cable_vector(length_m, "length_m");
  const int n = static_cast<int>(measurement.length_m.size());
  measurement.swivel_rad = to_cable_vector(swivel_rad, "swivel_rad", n);
  measurement.tension_N = to_cable_vector(tension_N, "tension_N", n);
  measurement.roll_pitch_yaw_rad = roll_pitch_yaw_rad;
  set_absolute(absolute, measurement);
  for_each_absolute(
      [&](const Sensor& sensor, const auto& readings) {
        const auto count = static_cast<int>(numbers(readings).size());
        if (count != 0 && count != sensor.columns_of(n)) {
          throw InputError(sensor.field() + ": has " + std::to_string(count) +
                           " numbers; give one a cable");
        }
      },
      measurement);
  return measurement;
}

void register_measurement(py::module_& module) {
  py::class_<Measurement> cls(
      module, "Measurement",
      "Readings at one pose; NaN where absent. Lengths, swivels and yaw have "
      "unknown offsets common to a problem's measurements. Immutable.");
  def_absolute<Measurement>(cls);
  cls.def(py::init(&make_measurement), py::kw_only(), py::arg("time_s"), py::arg("kind"),
          py::arg("length_m"), py::arg("swivel_rad"), py::arg("tension_N"),
          py::arg("roll_pitch_yaw_rad"),
          "length_m, swivel_rad, tension_N [n]; roll_pitch_yaw_rad [3]; more keywords: those of "
          "absolute sensors, by the names of the attributes. Raises InputError when their sizes "
          "differ.")
      .def_readonly("time_s", &Measurement::time_s)
      .def_readonly("kind", &Measurement::kind)
      .def_property_readonly(
          "length_m", [](const Measurement& m) { return m.length_m; }, "[n] [m].")
      .def_property_readonly(
          "swivel_rad", [](const Measurement& m) { return m.swivel_rad; }, "[n] [rad].")
      .def_property_readonly(
          "tension_N", [](const Measurement& m) { return m.tension_N; }, "[n] [N].")
      .def_property_readonly(
          "roll_pitch_yaw_rad", [](const Measurement& m) { return m.roll_pitch_yaw_rad; },
          "[3] [rad] in the robot's Euler convention.")
      .def_readonly("balance_counts", &Measurement::balance_counts,
                    "False: its balance of forces is left out (a slack cable, an outlier).")
      .def_property_readonly("moves", &Measurement::moves, "Whether it balances in motion.")
      .def_property_readonly(
          "rests", &Measurement::rests,
          "Whether it is a pose at rest: one that balances without acceleration.")
      .def_readonly("samples", &Measurement::samples, "Readings behind the mean.");
  module.def(
      "measurement_at",
      [](const Log& log, Eigen::Index index, PoseKind kind, int cable_count) {
        require_cables(log, cable_count);
        return measurement_at(log, index, kind, cable_count);
      },
      py::arg("log"), py::arg("index"), py::arg("kind"), py::arg("cable_count"),
      "The sample at row `index` as a Measurement. Raises InputError for a row that is not in the log "
      "and when the log is of another number of cables.");
  module.def(
      "measurement_mean",
      [](const Log& log, const SampleRange& range, PoseKind kind, int cable_count) {
        require_cables(log, cable_count);
        return measurement_mean(log, range, kind, cable_count);
      },
      py::arg("log"), py::arg("range"), py::arg("kind"), py::arg("cable_count"),
      "The mean over an interval; time_s is the middle of it. Raises InputError as measurement_at.");
}

void register_problem(py::module_& module) {
  py::class_<CalibrationProblem>(module, "CalibrationProblem",
                                 "What is modelled and what is free (§3.1 of the paper). "
                                 "measurements[0] is the reference: its pose is ζ0.")
      .def(
          py::init([](const Robot& robot, std::vector<Measurement> measurements,
                      StaticsModel statics, std::vector<WrenchRow> rows, bool reference_attitude,
                      bool reference_statics, bool reference_noise,
                      const std::optional<NoiseModel>& noise) {
            CalibrationProblem problem;
            problem.noise = noise;
            problem.robot = robot;
            problem.effects = resolve_effects(robot, "");
            problem.measurements = std::move(measurements);
            problem.statics = statics;
            problem.left_inverse_rows = std::move(rows);
            problem.reference_attitude = reference_attitude;
            problem.reference_statics = reference_statics;
            problem.reference_noise = reference_noise;
            return problem;
          }),
          py::kw_only(), py::arg("robot"), py::arg("measurements"),
          py::arg_v("statics", StaticsModel::wrench, "StaticsModel.wrench"),
          py::arg("left_inverse_rows") = std::vector<WrenchRow>{},
          py::arg("reference_attitude") = true, py::arg("reference_statics") = true,
          py::arg("reference_noise") = true, py::arg("noise") = py::none(),
          "noise: None is specified_noise(robot.sigma). reference_attitude, reference_statics, reference_noise: what pose 0 knows by itself "
          "and the paper leaves out. left_inverse_rows: empty means left_inverse_rows(n).")
      .def_readonly("robot", &CalibrationProblem::robot)
      .def_property_readonly(
          "measurements", [](const CalibrationProblem& problem) { return problem.measurements; },
          "List of Measurement; a copy.")
      .def_readonly("statics", &CalibrationProblem::statics)
      .def_readonly("left_inverse_rows", &CalibrationProblem::left_inverse_rows)
      .def_readonly("reference_attitude", &CalibrationProblem::reference_attitude)
      .def_readonly("reference_statics", &CalibrationProblem::reference_statics)
      .def_readonly("reference_noise", &CalibrationProblem::reference_noise)
      .def_property_readonly(
          "noise",
          [](const CalibrationProblem& problem) {
            return problem.noise.value_or(specified_noise(problem.robot.sigma));
          },
          "NoiseModel of the readings; a copy.");
  WordEnum<MinimiserKind>(module, "MinimiserKind",
                          "Who minimises: `arrowhead`, our own Levenberg-Marquardt on the "
                          "problem's structure; `ceres`, Ceres on the same rows, to check.")
      .value("arrowhead", MinimiserKind::arrowhead)
      .value("ceres", MinimiserKind::ceres)
      .finalize();
  const SolveOptions usual;
  py::class_<SolveOptions>(module, "SolveOptions", "How to solve.")
      .def(py::init([](std::vector<double> graduation, int max_iterations,
                       double function_tolerance, double parameter_tolerance,
                       double gradient_tolerance, MinimiserKind minimiser, bool explain) {
             SolveOptions options;
             options.explain = explain;
             options.minimiser = minimiser;
             options.graduation = std::move(graduation);
             options.max_iterations = max_iterations;
             options.function_tolerance = function_tolerance;
             options.parameter_tolerance = parameter_tolerance;
             options.gradient_tolerance = gradient_tolerance;
             return options;
           }),
           py::kw_only(), py::arg("graduation") = usual.graduation,
           py::arg("max_iterations") = usual.max_iterations,
           py::arg("function_tolerance") = usual.function_tolerance,
           py::arg("parameter_tolerance") = usual.parameter_tolerance,
           py::arg("gradient_tolerance") = usual.gradient_tolerance,
           py::arg_v("minimiser", usual.minimiser, "MinimiserKind.arrowhead"),
           py::arg("explain") = usual.explain)
      .def_readwrite("explain", &SolveOptions::explain,
                     "Whether to say which direction is least certain, and what sees it.")
      .def_readwrite("minimiser", &SolveOptions::minimiser)
      .def_readwrite("graduation", &SolveOptions::graduation,
                     "Factors on the standard deviations of tensions and wrenches, in turn; the "
                     "last is 1. Assign a whole list: the one read is a copy.")
      .def_readwrite("max_iterations", &SolveOptions::max_iterations, "Of each stage.")
      .def_readwrite("function_tolerance", &SolveOptions::function_tolerance)
      .def_readwrite("parameter_tolerance", &SolveOptions::parameter_tolerance)
      .def_readwrite("gradient_tolerance", &SolveOptions::gradient_tolerance)
      .def_readwrite(
          "settled", &SolveOptions::settled,
          "Weights of the balance are renewed until the initial pose moves less [m, rad].");
}

void register_calibration_result(py::module_& module) {
  py::class_<ResidualRms> rms(module, "ResidualRms",
                              "Root mean square of the unweighted residuals, a channel; NaN where "
                              "nothing measured it.");
  def_absolute<ResidualRms>(rms);
  rms.def_readonly("length_m", &ResidualRms::length_m)
      .def_readonly("swivel_rad", &ResidualRms::swivel_rad)
      .def_readonly("roll_pitch_rad", &ResidualRms::roll_pitch_rad)
      .def_readonly("yaw_rad", &ResidualRms::yaw_rad)
      .def_readonly("tension_N", &ResidualRms::tension_N)
      .def_readonly("wrench_force_N", &ResidualRms::wrench_force_N)
      .def_readonly("wrench_moment_Nm", &ResidualRms::wrench_moment_Nm);
  py::class_<PoseResidual> residual(
      module, "PoseResidual",
      "Residuals at one pose, modelled − measured (eq. 13); NaN where absent.");
  def_absolute<PoseResidual>(residual);
  residual
      .def_property_readonly(
          "length_m", [](const PoseResidual& r) { return r.length_m; }, "[n].")
      .def_property_readonly(
          "swivel_rad", [](const PoseResidual& r) { return r.swivel_rad; }, "[n].")
      .def_property_readonly(
          "tension_N", [](const PoseResidual& r) { return r.tension_N; }, "[n].")
      .def_property_readonly(
          "roll_pitch_yaw_rad", [](const PoseResidual& r) { return r.roll_pitch_yaw_rad; }, "[3].")
      .def_property_readonly(
          "wrench", [](const PoseResidual& r) { return r.wrench; },
          "Ξᵀτ* − f [6] [N, Nm], world axes, about P.");
  py::class_<CalibrationResult>(module, "CalibrationResult", "What came out. Look at status first.")
      .def_readonly("status", &CalibrationResult::status)
      .def_readonly("reason", &CalibrationResult::reason, "One sentence for people, always filled.")
      .def_property_readonly(
          "initial_pose",
          [](const CalibrationResult& r) {
            return r.poses.empty() ? std::nullopt : std::optional<Pose>(r.poses.front());
          },
          "poses[0] without the list of all; None when there is no pose.")
      .def_readonly("poses", &CalibrationResult::poses,
                    "ζ0, ζ1 … in the order of the measurements.")
      .def_readonly("residuals", &CalibrationResult::residuals, "One PoseResidual a pose.")
      .def_readonly("covariance", &CalibrationResult::covariance,
                    "Of ζ0 [6, 6]: position [m], world-frame rotation vector [rad]; None when ζ0 "
                    "is not observable.")
      .def_readonly("lacks_something", &CalibrationResult::lacks_something,
                    "The model does: an effect of the catalogue is more probable than none, or "
                    "poses misfit by more than twice what the robot file says of the sensors.")
      .def_readonly("covariance_holds", &CalibrationResult::covariance_holds,
                    "False: the model misfits, and the covariance leaves that out.")
      .def_property_readonly(
          "standard_deviation",
          [](const CalibrationResult& result) { return result.standard_deviation(); },
          "[6] [m, rad]; NaN when ζ0 is not observable.")
      .def_property_readonly(
          "initial_length_m",
          [](const CalibrationResult& result) { return result.initial_length_m; }, "l(ζ0) [n].")
      .def_property_readonly(
          "initial_swivel_rad",
          [](const CalibrationResult& result) { return result.initial_swivel_rad; }, "σ(ζ0) [n].")
      .def_readonly("cost", &CalibrationResult::cost, "½ Σ (F/σ)², eq. 14.")
      .def_readonly("iterations", &CalibrationResult::iterations)
      .def_readonly("solve_time_s", &CalibrationResult::solve_time_s)
      .def_readonly("residual_count", &CalibrationResult::residual_count)
      .def_readonly("parameter_count", &CalibrationResult::parameter_count)
      .def_readonly("chi_square_p_value", &CalibrationResult::chi_square_p_value)
      .def_readonly("residual_rms", &CalibrationResult::residual_rms)
      .def_readonly("least_observed", &CalibrationResult::least_observed,
                    "The weakest direction of the initial pose, in words, and which readings see "
                    "it; empty when nothing was found.")
      .def_property_readonly(
          "reference_errors", [](const CalibrationResult& r) { return r.reference_errors; },
          "Estimated errors of the reference's lengths, swivels and yaw [2 n + 1] (m, rad).");
  module.def(
      "solve",
      [](const CalibrationProblem& problem, const std::vector<Pose>& guess,
         const std::optional<SolveOptions>& options) {
        return solve(problem, guess, options.value_or(SolveOptions{}));
      },
      py::arg("problem"), py::arg("guess"), py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Solves from a guess, one Pose a measurement. Numerical failure is a status. Raises "
      "InputError when the problem itself makes no sense.");
}

CalibrateOptions make_options(Method method, Formulation formulation,
                              std::optional<NoiseSource> noise, bool allow_for_effects,
                              std::vector<double> at_s, int segment, double kinematic_spacing_s,
                              std::vector<Pose> guess,
                              const std::optional<DetectionOptions>& detection,
                              const std::optional<SolveOptions>& solve, int most_starts) {
  CalibrateOptions options;
  options.method = method;
  options.formulation = formulation;
  options.noise = noise;
  options.allow_for_effects = allow_for_effects;
  options.at_s = std::move(at_s);
  options.segment = segment;
  options.kinematic_spacing_s = kinematic_spacing_s;
  options.guess = std::move(guess);
  if (detection) options.detection = *detection;
  if (solve) options.solve = *solve;
  options.most_starts = most_starts;
  return options;
}

void register_calibration_options(py::module_& module) {
  const CalibrateOptions usual;
  py::class_<CalibrateOptions>(module, "CalibrateOptions", "How to calibrate from a log.")
      .def(
          py::init(&make_options), py::kw_only(),
          py::arg_v("method", usual.method, "Method.unified"),
          py::arg_v("formulation", usual.formulation, "Formulation.full"),
          py::arg("noise") = py::none(), py::arg("allow_for_effects") = usual.allow_for_effects,
          py::arg("at_s") = usual.at_s, py::arg("segment") = usual.segment,
          py::arg("kinematic_spacing_s") = usual.kinematic_spacing_s,
          py::arg_v("guess", usual.guess, "[]"), py::arg("detection") = py::none(),
          py::arg("solve") = py::none(), py::arg("most_starts") = usual.most_starts,
          "noise: where the weights come from; None: from_data for the full formulation, specified "
          "for the paper's. allow_for_effects: count in σ what effects that nobody named may do to "
          "the initial pose. at_s: times of the poses [s], the first is the reference; empty: automatic. segment: "
          "which is the run, from 0; -1 the last. kinematic_spacing_s: between samples that count "
          "as poses of their own. guess: one Pose a pose, or only ζ0; empty: automatic. most_starts: "
          "guesses of ζ0 to try while no minimum agrees with the readings; without load cells the "
          "rests alone and guesses all over the workspace follow (1: neither).")
      .def_readwrite("method", &CalibrateOptions::method)
      .def_readwrite("formulation", &CalibrateOptions::formulation)
      .def_readwrite("noise", &CalibrateOptions::noise)
      .def_readwrite("allow_for_effects", &CalibrateOptions::allow_for_effects)
      .def_readwrite("at_s", &CalibrateOptions::at_s, "A copy; assign a whole list.")
      .def_readwrite("segment", &CalibrateOptions::segment)
      .def_readwrite("kinematic_spacing_s", &CalibrateOptions::kinematic_spacing_s)
      // By value: a reference into the options would dangle as soon as they are assigned anew.
      .def_property(
          "guess", [](const CalibrateOptions& options) { return options.guess; },
          [](CalibrateOptions& options, std::vector<Pose> guess) {
            options.guess = std::move(guess);
          },
          "A copy; assign a whole list.")
      .def_readwrite("most_starts", &CalibrateOptions::most_starts)
      .def_readwrite("detection", &CalibrateOptions::detection)
      .def_readwrite("solve", &CalibrateOptions::solve);
}

void register_calibrate(py::module_& module) {
  register_calibration_options(module);
  module.def(
      "linearise",
      [](const CalibrationProblem& problem, const std::vector<Pose>& poses,
         const Eigen::VectorXd& errors) {
        LinearisedProblem system = linearise(problem, poses, errors);
        return py::make_tuple(std::move(system.residual), std::move(system.jacobian));
      },
      py::arg("problem"), py::arg("poses"), py::arg("errors") = Eigen::VectorXd(),
      "(residual [m], jacobian [m, 6 k + 2 n + 1]) at the poses, whitened (eq. 13 over sigma): six "
      "columns a pose (world-frame twist), then the errors of the reference readings, which are "
      "`errors` [2 n + 1] (none: zero). NaN where a pose has no geometry. Raises InputError for "
      "another number of poses or errors.");
  py::class_<Calibration> cls(module, "Calibration", "A calibration and what it was made from.",
                              py::dynamic_attr());
  cls.def_readonly("result", &Calibration::result)
      .def_readonly("problem", &Calibration::problem, "What was solved; it can be solved again.")
      .def_readonly("equilibria", &Calibration::equilibria, "Found in the run; empty with at_s.")
      .def_readonly("gated", &Calibration::gated, "Readings left out: list of GatedReading.")
      .def_readonly("reference_time_s", &Calibration::reference_time_s)
      .def_readonly("static_poses", &Calibration::static_poses,
                    "The reference included, when it is one.")
      .def_readonly("kinematic_poses", &Calibration::kinematic_poses);
  def_repr(cls);
  def_people(cls, "A pandas.DataFrame: a row a pose, with its time, position, angles and kind.",
             true);
  module.def(
      "prepare",
      [](const Robot& robot, const Log& log, const std::optional<CalibrateOptions>& options) {
        return prepare(robot, log, options.value_or(CalibrateOptions{}));
      },
      py::arg("robot"), py::arg("log"), py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "The problem that a log poses, and the equilibria it was drawn from; result is not filled. "
      "Raises InputError for a log that does not fit the robot or the options.");
  module.def(
      "calibrate",
      [](const Robot& robot, const Log& log, const std::optional<CalibrateOptions>& options) {
        return calibrate(robot, log, options.value_or(CalibrateOptions{}));
      },
      py::arg("robot"), py::arg("log"), py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "From a log to the initial pose. Look at result.status. The covariance counts what effects "
      "may do that the log cannot rule out; where the readings show that the model lacks something, "
      "pose and covariance allow for every known effect at its typical size "
      "(options.allow_for_effects). Raises as prepare does.");
}

}  // namespace

void register_calibration(py::module_& module) {
  register_calibration_enums(module);
  register_measurement(module);
  register_problem(module);
  register_calibration_result(module);
  register_calibrate(module);
}

}  // namespace cdprcal::python
