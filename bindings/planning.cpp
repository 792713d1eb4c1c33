// planning/: set-points, paths, natural frequencies, and the measurement plan.
#include "cdprcal/planning/plan.hpp"

#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "cdprcal/planning/known_effects.hpp"
#include "cdprcal/planning/observability.hpp"
#include "cdprcal/planning/path.hpp"
#include "cdprcal/planning/plan_file.hpp"
#include "people.hpp"
#include "progress.hpp"

namespace cdprcal::python {
namespace {

void register_set_points(py::module_& module) {
  py::class_<SetPoint>(module, "SetPoint",
                       "An equilibrium. Up to five cables of constant tensions: command them and "
                       "the platform settles at the pose; from six on lengths lead it there. "
                       "Immutable.")
      .def(py::init([](const Pose& pose, const Eigen::VectorXd& tension_N) {
             return SetPoint{pose, to_cable_vector(tension_N, "tension_N")};
           }),
           py::arg("pose"), py::arg("tension_N"))
      .def_readonly("pose", &SetPoint::pose)
      .def_property_readonly(
          "tension_N", [](const SetPoint& s) -> Eigen::VectorXd { return s.tension_N; }, "[n].");
  py::class_<SetPointOptions>(module, "SetPointOptions", "Which tensions hold the platform.")
      .def(
          py::init([](TensionDistribution distribution, const Eigen::VectorXd& lambda_N,
                      std::optional<double> margin_N, const std::optional<Matrix3>& rotation) {
            SetPointOptions options{distribution, to_cable_vector(lambda_N, "lambda_N"),
                                    std::nullopt, margin_N};
            if (rotation) options.rotation = rotation_from_matrix(*rotation);
            return options;
          }),
          py::kw_only(),
          py::arg_v("distribution", TensionDistribution::barycentre,
                    "TensionDistribution.barycentre"),
          py::arg("lambda_N") = Eigen::VectorXd(), py::arg("tension_margin_N") = py::none(),
          py::arg("rotation") = py::none(),
          "lambda_N [n - 3], from six cables on [n - 6]: with given_lambda. tension_margin_N: least "
          "distance from the limits; default one sigma of the load cells. rotation [3, 3]: "
          "commanded, from six cables on; default held_orientation.")
      .def_readonly("distribution", &SetPointOptions::distribution)
      .def_property_readonly("lambda_N",
                             [](const SetPointOptions& o) -> Eigen::VectorXd { return o.lambda_N; })
      .def_readonly("tension_margin_N", &SetPointOptions::tension_margin_N);
  module.def(
      "set_point_at",
      [](const Robot& robot, const Vector3& position_m, const SetPointOptions& options) {
        SetPointSolver::Result result = SetPointSolver(robot, options).at(position_m);
        return py::make_tuple(result.set_point, result.reason);
      },
      py::arg("robot"), py::arg("position_m"), py::arg("options") = SetPointOptions{},
      "The set-point at a position [3]: (SetPoint or None, reason why there is none).");
  const auto require_of = [](const Robot& robot, const SetPoint& point, const char* name) {
    require_finite(to_cable_vector(point.tension_N, name, robot.cable_count()), name);
  };
  module.def(
      "settling_deviation",
      [=](const Robot& robot, const SetPoint& set_point) {
        require_of(robot, set_point, "set_point.tension_N");
        return settling_deviation(robot, set_point);
      },
      py::arg("robot"), py::arg("set_point"),
      "Standard deviation [6] of the pose (position [m], world-frame rotation vector [rad]) "
      "when every tension is wrong by one sigma of the load cells. Raises InputError for tensions that "
      "are not one a cable.");
  module.def(
      "predicted_covariance",
      [=](const Robot& robot, const SetPoint& start, const std::vector<SetPoint>& set_points) {
        require_of(robot, start, "start.tension_N");
        for (const SetPoint& s : set_points) require_of(robot, s, "set_points: tension_N");
        const py::gil_scoped_release release;
        return predicted_covariance(robot, start, set_points);
      },
      py::arg("robot"), py::arg("start"), py::arg("set_points"),
      "Covariance [6, 6] of the initial pose (position [m], world-frame rotation vector [rad]) that "
      "measuring these set-points will give; None while it stays unobservable. Raises InputError for "
      "tensions that are not one a cable.");
}

template <class F>
auto modes_of(const F& modes) {
  return [modes](const Robot& robot, const PlatformState& state, const Eigen::VectorXd& tension_N) {
    const Modes found =
        modes(robot, state, to_cable_vector(tension_N, "tension_N", state.cable_count));
    return py::make_tuple(Eigen::VectorXd(found.natural_frequency_hz),
                          Eigen::MatrixXd(found.shape));
  };
}

void register_modes(py::module_& module) {
  module.def("constant_tension_modes", modes_of(&constant_tension_modes), py::arg("robot"),
             py::arg("state"), py::arg("tension_N"),
             "The six small oscillations at constant tensions: (natural_frequency_hz [6], rising; "
             "shapes [6, 6], one twist a column). NaN: the motion grows instead.");
  module.def(
      "free_motion_modes", modes_of(&free_motion_modes), py::arg("robot"), py::arg("state"),
      py::arg("tension_N"),
      "The 6 - n oscillations with locked cables: (natural_frequency_hz, shapes [6, 6 - n]).");
}

void register_planning_path(py::module_& module) {
  WordEnum<PathStatus>(module, "PathStatus",
                       "Whether a transition keeps the platform stable and inside.")
      .value("clear", PathStatus::clear)
      .value("unstable", PathStatus::unstable)
      .value("other_equilibrium", PathStatus::other_equilibrium)
      .value("beyond_tension_limits", PathStatus::beyond_tension_limits)
      .value("outside_workspace", PathStatus::outside_workspace)
      .finalize();
  py::class_<PathPoint>(module, "PathPoint", "One equilibrium on the way. Immutable.")
      .def_readonly("fraction", &PathPoint::fraction, "Of the tension change: 0 … 1.")
      .def_readonly("pose", &PathPoint::pose)
      .def_property_readonly(
          "tension_N", [](const PathPoint& p) -> Eigen::VectorXd { return p.tension_N; }, "[n].")
      .def_readonly("stiffness_N_m", &PathPoint::stiffness_N_m);
  py::class_<Path>(module, "Path", "What happens between two set-points. Immutable.")
      .def_readonly("status", &Path::status)
      .def_readonly("reason", &Path::reason, "One sentence; empty when clear.")
      .def_readonly("points", &Path::points, "Up to the failure when not clear.");
  module.def(
      "follow_path",
      [](const Robot& robot, const SetPoint& from, const SetPoint& to,
         const std::optional<Box>& bounds, double tension_margin_N) {
        to_cable_vector(from.tension_N, "from_set_point.tension_N", robot.cable_count());
        to_cable_vector(to.tension_N, "to_set_point.tension_N", robot.cable_count());
        const SetPointSolver solver(robot);
        return PathChecker(solver, {tension_margin_N, bounds}).follow(from, to);
      },
      py::arg("robot"), py::arg("from_set_point"), py::arg("to_set_point"), py::kw_only(),
      py::arg("bounds") = py::none(), py::arg("tension_margin_N") = 0.0,
      "The platform's quasi-static path while the tensions change from one set-point to another: "
      "stable, inside the static workspace and the bounds (default workspace_box), or why not.");
}

void register_known_effects(py::module_& module) {
  py::class_<KnownEffects>(module, "KnownEffects",
                           "The effects that a robot file lists for every run, as planning sees "
                           "them. Immutable.")
      .def(py::init<const Robot&>(), py::arg("robot"))
      .def_property_readonly(
          "robot", [](const KnownEffects& k) { return k.robot(); },
          "The robot with their geometry and inertia, its list of effects empty.")
      .def(
          "reading_N",
          [](const KnownEffects& k, const Pose& pose,
             const Eigen::VectorXd& tension_N) -> Eigen::VectorXd {
            return k.reading_N(pose,
                               to_cable_vector(tension_N, "tension_N", k.robot().cable_count()));
          },
          py::arg("pose"), py::arg("tension_N"), "What the load cells read under tensions [n].")
      .def(
          "tension_N",
          [](const KnownEffects& k, const Pose& pose,
             const Eigen::VectorXd& reading_N) -> Eigen::VectorXd {
            return k.tension_N(pose,
                               to_cable_vector(reading_N, "reading_N", k.robot().cable_count()));
          },
          py::arg("pose"), py::arg("reading_N"), "Tensions [n] behind readings of the load cells.")
      .def(
          "settled",
          [](const KnownEffects& k, const Eigen::VectorXd& reading_N, const Pose& near) {
            return k.settled(to_cable_vector(reading_N, "reading_N", k.robot().cable_count()),
                             near);
          },
          py::arg("reading_N"), py::arg("near"),
          "Where the platform rests when the load cells are held at these readings [n], close to a "
          "pose: with all effects, an external force too. None when it does not settle.")
      .def(
          "as_planned",
          [](const KnownEffects& k, const SetPoint& stop) {
            to_cable_vector(stop.tension_N, "tension_N", k.robot().cable_count());
            return k.as_planned(stop);
          },
          py::arg("stop"),
          "The set-point of true tensions, without forces but the weight, behind a stop of a "
          "finished plan; None when those tensions do not hold the platform.");
}

void register_plan_types(py::module_& module) {
  py::class_<PlannedPose>(module, "PlannedPose", "One stop of a plan. Immutable.")
      .def_readonly("measured", &PlannedPose::measured, "False: passed through only.")
      .def_readonly("pose", &PlannedPose::pose)
      .def_property_readonly(
          "tension_N", [](const PlannedPose& p) -> Eigen::VectorXd { return p.tension_N; },
          "Set-point [n], as the load cells read it.")
      .def_readonly("transition_s", &PlannedPose::transition_s,
                    "Of the fifth-degree transition from the stop before.")
      .def_readonly("dwell_s", &PlannedPose::dwell_s)
      .def_property_readonly(
          "natural_frequencies_hz",
          [](const PlannedPose& p) -> Eigen::VectorXd { return p.natural_frequencies_hz; },
          "Free motions with locked cables [6 - n], rising.")
      .def_property_readonly(
          "constant_tension_frequencies_hz",
          [](const PlannedPose& p) -> Eigen::VectorXd { return p.constant_tension_frequencies_hz; },
          "Under force control [6], rising.");
  py::class_<Plan> cls(module, "Plan", "What `acquire` runs. Immutable.");
  cls.def_readonly("robot_name", &Plan::robot_name)
      .def_property_readonly(
          "start_tension_N", [](const Plan& p) -> Eigen::VectorXd { return p.start_tension_N; },
          "tau_0 [n], as the load cells read it.")
      .def_readonly("start_pose", &Plan::start_pose)
      .def_readonly("start_dwell_s", &Plan::start_dwell_s)
      .def_readonly("poses", &Plan::poses, "PlannedPose in visiting order.")
      .def_readonly("duration_s", &Plan::duration_s)
      .def_property_readonly(
          "predicted_standard_deviation",
          [](const Plan& p) { return p.predicted_standard_deviation; },
          "Of the initial pose [6]: position [m], world-frame rotation vector [rad]; NaN when it "
          "would not be observable.")
      .def_property_readonly("measured_count", &Plan::measured_count)
      .def("__repr__", [](const Plan& p) {
        return "Plan('" + p.robot_name + "', " + std::to_string(p.measured_count()) +
               " measured poses, " + std::to_string(p.duration_s) + " s)";
      });
  def_people(cls, "A pandas.DataFrame: a row a stop, in visiting order.", true);
  module.def("format_plan", &format_plan, py::arg("plan"), "Text of a plan file (CSV).");
  module.def(
      "write_plan",
      [](const Plan& plan, const std::filesystem::path& path) { write_plan(plan, path); },
      py::arg("plan"), py::arg("path"),
      "Writes a plan file. Raises InputError when it cannot be written.");
  module.def("parse_plan", &parse_plan, py::arg("text"), py::arg("source"),
             "Text of a plan file → Plan. Raises InputError 'source:line:column: …'.");
  module.def(
      "read_plan", [](const std::filesystem::path& path) { return read_plan(path); },
      py::arg("path"), "Reads a plan file. Raises InputError 'file:line:column: …'.");
}

void register_planning_options(py::module_& module) {
  WordEnum<VisitingOrder>(module, "VisitingOrder",
                          "least_time: each pose once; random: each several times, shuffled "
                          "so that drifts and creep look like no pose.")
      .value("least_time", VisitingOrder::least_time, "least-time")
      .value("random", VisitingOrder::random)
      .finalize();
  module.def("parse_visiting_order", &parse_visiting_order, py::arg("name"),
             "'least-time', 'random' → VisitingOrder. Raises InputError naming the choices.");
  const TimingOptions usual;
  py::class_<TimingOptions>(module, "TimingOptions",
                            "What transition and dwell times are derived from. Immutable.")
      .def(
          py::init(
              [](double platform, double cable, double damping, double rest, double measuring) {
                return TimingOptions{platform, cable, damping, rest, measuring};
              }),
          py::kw_only(), py::arg("max_platform_speed_m_s") = usual.max_platform_speed_m_s,
          py::arg("max_cable_speed_m_s") = usual.max_cable_speed_m_s,
          py::arg("damping_ratio") = usual.damping_ratio,
          py::arg("rest_tolerance") = usual.rest_tolerance,
          py::arg("measuring_s") = usual.measuring_s,
          "Peak speeds; damping ratio of every mode; ringing that counts as rest, in sigma of each "
          "sensor; rest left for measuring.")
      .def_readonly("max_platform_speed_m_s", &TimingOptions::max_platform_speed_m_s)
      .def_readonly("max_cable_speed_m_s", &TimingOptions::max_cable_speed_m_s)
      .def_readonly("damping_ratio", &TimingOptions::damping_ratio)
      .def_readonly("rest_tolerance", &TimingOptions::rest_tolerance)
      .def_readonly("measuring_s", &TimingOptions::measuring_s);
}

void register_planning_results(py::module_& module) {
  WordEnum<PlanStatus>(module, "PlanStatus",
                       "infeasible: a pose is no set-point or cannot be reached; stopped: "
                       "by the progress callback. The plan is empty unless planned.")
      .value("planned", PlanStatus::planned)
      .value("infeasible", PlanStatus::infeasible)
      .value("stopped", PlanStatus::stopped)
      .finalize();
  py::class_<GridComparison>(module, "GridComparison",
                             "How many poses chosen by observability the grid is worth. Immutable.")
      .def_readonly("grid_poses", &GridComparison::grid_poses)
      .def_property_readonly(
          "grid_standard_deviation",
          [](const GridComparison& c) { return c.grid_standard_deviation; }, "[6] [m, rad].")
      .def_property_readonly(
          "optimal_standard_deviation",
          [](const GridComparison& c) {
            Eigen::MatrixXd rows(c.optimal_standard_deviation.size(), 6);
            for (std::size_t i = 0; i < c.optimal_standard_deviation.size(); ++i) {
              rows.row(static_cast<Eigen::Index>(i)) = c.optimal_standard_deviation[i];
            }
            return rows;
          },
          "Row k - 1: of k poses [6] [m, rad].")
      .def_readonly("poses_needed", &GridComparison::poses_needed,
                    "The fewest that are no worse in position and in rotation; None: not within "
                    "those that were chosen.");
  py::class_<ApproachCoverage>(module, "ApproachCoverage",
                               "How well an order tells the two directions apart. Immutable.")
      .def_readonly("both", &ApproachCoverage::both,
                    "Pairs (pose, cable) approached paying out and reeling in.")
      .def_readonly("possible", &ApproachCoverage::possible);
  py::class_<PlanResult> cls(module, "PlanResult", "A plan, or why there is none. Immutable.");
  cls.def_readonly("status", &PlanResult::status)
      .def_readonly("reason", &PlanResult::reason, "One sentence; empty when planned.")
      .def_readonly("plan", &PlanResult::plan)
      .def_readonly("box", &PlanResult::box, "Of the grid.")
      .def_readonly("box_origin", &PlanResult::box_origin, "Where the box comes from.")
      .def_readonly("order_is_optimal", &PlanResult::order_is_optimal, "Least time, proved.")
      .def_readonly("approach", &PlanResult::approach, "Of a random order.")
      .def_readonly("comparison", &PlanResult::comparison, "With `optimal`.")
      .def_readonly("candidates", &PlanResult::candidates, "That `optimal` chose from.");
  def_repr(cls);
}

PlanResult plan(const Robot& robot, const std::optional<Box>& box, const std::array<int, 3>& grid,
                int optimal, const std::optional<Eigen::MatrixX3d>& positions_m,
                const std::optional<Vector3>& home_m, VisitingOrder order, int visits,
                std::uint64_t seed, const SetPointOptions& set_points,
                const std::optional<Box>& bounds, const TimingOptions& timing, int threads,
                const ProgressCallback<std::string, double>& progress) {
  PlanOptions options;
  options.box = box;
  options.grid = grid;
  options.optimal = optimal;
  if (positions_m) {
    if (positions_m->rows() == 0) {
      throw InputError("positions_m: has no row; give one position or more, or None for a grid");
    }
    for (Eigen::Index i = 0; i < positions_m->rows(); ++i) {
      options.positions_m.emplace_back(positions_m->row(i));
    }
  }
  options.home_m = home_m;
  options.order = order;
  options.visits = visits;
  options.seed = seed;
  options.set_points = set_points;
  options.bounds = bounds;
  options.timing = timing;
  options.threads = threads;
  Progress ask(progress);
  options.progress = [&ask](const PlanProgress& p) { return ask(std::string(p.stage), p.share); };
  PlanResult result;
  {
    const py::gil_scoped_release release;
    result = make_plan(robot, options);
  }
  ask.rethrow();
  return result;
}

void register_make_plan(py::module_& module) {
  const PlanOptions usual;
  module.def(
      "make_plan", &plan, py::arg("robot"), py::kw_only(), py::arg("box") = py::none(),
      py::arg("grid") = usual.grid, py::arg("optimal") = usual.optimal,
      py::arg("positions_m") = py::none(), py::arg("home_m") = py::none(),
      py::arg_v("order", usual.order, "VisitingOrder.least_time"), py::arg("visits") = usual.visits,
      py::arg("seed") = usual.seed, py::arg_v("set_points", SetPointOptions{}, "SetPointOptions()"),
      py::arg("bounds") = py::none(), py::arg_v("timing", TimingOptions{}, "TimingOptions()"),
      py::arg("threads") = usual.threads, py::arg("progress") = py::none(),
      "Which poses, in which order, at which tensions and how fast (paper §3.2), every path checked. "
      "grid: positions along x, y, z of the box (default: eq. 19 for irma4, else proposed). "
      "optimal > 0: that many poses chosen by observability instead. positions_m [k, 3]: instead of "
      "both. home_m [3]: where the run starts (default: the middle of the box). visits, seed: of "
      "the random order. bounds: that the platform may not leave. progress(stage, share): False "
      "stops. The robot's known effects are applied. A pose that cannot be measured or reached is a "
      "status. Raises InputError for options that make no sense and for n < 3.");
  module.def(
      "verify_plan",
      [](const Robot& robot, const Plan& plan, const std::optional<Box>& bounds) {
        const py::gil_scoped_release release;
        return verify_plan(robot, plan, bounds);
      },
      py::arg("robot"), py::arg("plan"), py::arg("bounds") = py::none(),
      "'' when every set-point of a plan is an equilibrium of this robot and every path clear; "
      "otherwise what is wrong with which stop. Raises InputError for a plan of another robot.");
  module.def("published_measurement_box", &published_measurement_box, py::arg("robot"),
             "The box of eq. 19 when the robot is irma4, else None.");
}

}  // namespace

void register_planning(py::module_& module) {
  register_set_points(module);
  register_modes(module);
  register_planning_path(module);
  register_known_effects(module);
  register_plan_types(module);
  register_planning_options(module);
  register_planning_results(module);
  register_make_plan(module);
}

}  // namespace cdprcal::python
