// equilibria/: inverse and direct geometrico-static problems.
#include <array>
#include <optional>

#include "bindings.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"

namespace cdprcal::python {
namespace {

void register_equilibria_enums(py::module_& module) {
  WordEnum<EquilibriumStatus>(
      module, "EquilibriumStatus",
      "found: balanced and stable, every cable pulls. obstructed: so, but for what the robot file "
      "says is in the way. unstable, infeasible (a tension beyond the robot's limits) and slack are "
      "balanced too. not_found, invalid_geometry: no pose.")
      .value("found", EquilibriumStatus::found)
      .value("obstructed", EquilibriumStatus::obstructed)
      .value("unstable", EquilibriumStatus::unstable)
      .value("infeasible", EquilibriumStatus::infeasible)
      .value("slack", EquilibriumStatus::slack)
      .value("not_found", EquilibriumStatus::not_found)
      .value("invalid_geometry", EquilibriumStatus::invalid_geometry)
      .finalize();
  WordEnum<TensionDistribution>(
      module, "TensionDistribution",
      "Which of the tensions that carry the weight a robot is given. barycentre: centroid of the "
      "feasible polytope; minimum_norm; mid_range: closest to the middle of the limits; "
      "given_lambda: eq. A2 with lambda as given.")
      .value("barycentre", TensionDistribution::barycentre)
      .value("minimum_norm", TensionDistribution::minimum_norm)
      .value("mid_range", TensionDistribution::mid_range)
      .value("given_lambda", TensionDistribution::given_lambda)
      .finalize();
  module.def("parse_tension_distribution", &parse_tension_distribution, py::arg("name"),
             "'barycentre' … → TensionDistribution. Raises InputError naming the choices.");
  WordEnum<StabilityNotion>(
      module, "StabilityNotion",
      "locked_lengths: winches hold the cable lengths (K_f of eq. A4, the paper's criterion); "
      "constant_tensions: force control (the whole K + Q), which demands more.")
      .value("locked_lengths", StabilityNotion::locked_lengths, "locked-lengths")
      .value("constant_tensions", StabilityNotion::constant_tensions, "constant-tensions")
      .finalize();
}

void register_equilibria_results(py::module_& module) {
  py::class_<Stability>(module, "Stability",
                        "Smallest eigenvalues of the two stiffnesses [N/m], rotations measured as "
                        "arcs at the characteristic length; positive: stable. Immutable.")
      .def_readonly("locked_lengths_N_m", &Stability::locked_lengths_N_m,
                    "Of K_f (eq. A4); inf when the cables leave no freedom.")
      .def_readonly("constant_tensions_N_m", &Stability::constant_tensions_N_m, "Of K + Q.");
  module.def(
      "stability",
      [](const Robot& robot, const PlatformState& state, const Eigen::VectorXd& tension_N) {
        return stability(robot, state, to_cable_vector(tension_N, "tension_N", state.cable_count));
      },
      py::arg("robot"), py::arg("state"), py::arg("tension_N"),
      "Both notions of stability at a pose that is in balance.");
  py::class_<EquilibriumResult>(module, "EquilibriumResult",
                                "One equilibrium, or the reason why there is none. Immutable.")
      .def_readonly("status", &EquilibriumResult::status)
      .def_readonly("reason", &EquilibriumResult::reason, "One sentence; empty when found.")
      .def_property_readonly(
          "pose",
          [](const EquilibriumResult& r) {
            return r.balanced() ? std::optional<Pose>(r.pose) : std::nullopt;
          },
          "The balanced pose; None when none was reached.")
      .def_property_readonly(
          "tension_N", [](const EquilibriumResult& r) -> Eigen::VectorXd { return r.tension_N; },
          "[n]; NaN or empty when no pose was reached.")
      .def_property_readonly(
          "length_m", [](const EquilibriumResult& r) -> Eigen::VectorXd { return r.length_m; },
          "[n], arc on the pulley included.")
      .def_readonly("stable", &EquilibriumResult::stable, "By the notion that fits the problem.")
      .def_readonly("stability", &EquilibriumResult::stability)
      .def_readonly("residual_N", &EquilibriumResult::residual_N,
                    "‖Ξᵀτ − f‖, moments divided by the characteristic length.")
      .def_readonly("evaluations", &EquilibriumResult::evaluations)
      .def_property_readonly("balanced", &EquilibriumResult::balanced,
                             "Whether the pose is an equilibrium, whatever else is wrong with it.")
      .def("__repr__", [](const EquilibriumResult& r) {
        return std::string("EquilibriumResult(") + to_string(r.status) +
               (r.balanced() ? ", position_m=" + to_text(r.pose.position_m) +
                                   ", tension_N=" + to_text(r.tension_N)
                             : ", " + r.reason) +
               ")";
      });
  py::class_<InverseResult, EquilibriumResult>(
      module, "InverseResult", "An equilibrium at a position that was asked for. Immutable.")
      .def_property_readonly(
          "lambda_N", [](const InverseResult& r) -> Eigen::VectorXd { return r.lambda_N; },
          "[n - 3], from six cables on [n - 6]: what reproduces these tensions with given_lambda.")
      .def_readonly("margin_N", &InverseResult::margin_N,
                    "Of the closest tension to its limit; negative when infeasible.");
}

/// Keyword arguments of the inverse problem, at the border once.
InverseOptions inverse_options(TensionDistribution distribution, const Eigen::VectorXd& lambda_N,
                               StabilityNotion stability, const std::optional<Matrix3>& rotation) {
  InverseOptions options;
  options.distribution = distribution;
  options.lambda_N = to_cable_vector(lambda_N, "lambda_N");
  options.stability = stability;
  if (rotation) options.rotation = rotation_from_matrix(*rotation);
  return options;
}

/// Many positions in a row, each continued from the one before.
struct InversePath {
  Eigen::VectorXi status;
  Eigen::MatrixXd quaternion_wxyz;  ///< [m, 4]
  Eigen::MatrixXd tension_N;        ///< [m, n]
};

InversePath solve_along(const InverseSolver& solver, const Eigen::MatrixX3d& positions_m) {
  const Eigen::Index count = positions_m.rows();
  InversePath path{Eigen::VectorXi(count), Eigen::MatrixXd::Constant(count, 4, kNaN),
                   Eigen::MatrixXd::Constant(count, solver.robot().cable_count(), kNaN)};
  std::optional<Eigen::Quaterniond> before;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vector3 position = positions_m.row(i);
    InverseSolver::Point point;
    if (before) point = solver.continue_from(position, *before);
    const auto balanced = [&point] {
      return rank(point.status) < rank(EquilibriumStatus::not_found);
    };
    if (!before || !balanced()) point = solver.solve(position);
    path.status[i] = rank(point.status);
    if (!balanced()) continue;
    before = point.rotation;
    path.quaternion_wxyz.row(i) << point.rotation.w(), point.rotation.vec().transpose();
    path.tension_N.row(i) = point.tension_N;
  }
  return path;
}

void register_inverse(py::module_& module) {
  module.def(
      "inverse",
      [](const Robot& robot, const Vector3& position_m, TensionDistribution distribution,
         const Eigen::VectorXd& lambda_N, StabilityNotion stability,
         const std::optional<Matrix3>& start, const std::optional<Matrix3>& rotation) {
        std::optional<Eigen::Quaterniond> from;
        if (start) from = rotation_from_matrix(*start);
        const InverseOptions options = inverse_options(distribution, lambda_N, stability, rotation);
        const py::gil_scoped_release release;
        return inverse(robot, position_m, options, from);
      },
      py::arg("robot"), py::arg("position_m"), py::kw_only(),
      py::arg_v("distribution", TensionDistribution::barycentre, "TensionDistribution.barycentre"),
      py::arg("lambda_N") = Eigen::VectorXd(),
      py::arg_v("stability", StabilityNotion::locked_lengths, "StabilityNotion.locked_lengths"),
      py::arg("start") = py::none(), py::arg("rotation") = py::none(),
      "Inverse geometrico-static problem (eqs A1-A3): orientation and tensions at position_m [3] of "
      "P. lambda_N [n - 3]: with given_lambda. start [3, 3]: a rotation close to the solution; "
      "without it the search is by NLopt from several. From six cables on rotation [3, 3] is "
      "commanded (default: held_orientation), the tensions are chosen, and lambda_N has n - 6 "
      "values. Raises InputError for n < 3 and for a rotation of fewer than six.");
  module.def(
      "all_equilibria_at",
      [](const Robot& robot, const Vector3& position_m, TensionDistribution distribution,
         const Eigen::VectorXd& lambda_N, StabilityNotion stability,
         const std::optional<Matrix3>& rotation) {
        const InverseOptions options = inverse_options(distribution, lambda_N, stability, rotation);
        const py::gil_scoped_release release;
        return all_equilibria_at(robot, position_m, options);
      },
      py::arg("robot"), py::arg("position_m"), py::kw_only(),
      py::arg_v("distribution", TensionDistribution::barycentre, "TensionDistribution.barycentre"),
      py::arg("lambda_N") = Eigen::VectorXd(),
      py::arg_v("stability", StabilityNotion::locked_lengths, "StabilityNotion.locked_lengths"),
      py::arg("rotation") = py::none(),
      "All distinct equilibria at a position that about a dozen starts reach: found ones first, by "
      "falling tension margin; from six cables on the one at the commanded rotation.");
  module.def(
      "inverse_along",
      [](const Robot& robot, const Eigen::MatrixX3d& positions_m, TensionDistribution distribution,
         const Eigen::VectorXd& lambda_N, StabilityNotion stability,
         const std::optional<Matrix3>& rotation) {
        if (!positions_m.allFinite()) throw InputError("positions_m: must be finite numbers");
        const InverseOptions options = inverse_options(distribution, lambda_N, stability, rotation);
        InversePath path;
        {
          const py::gil_scoped_release release;
          path = solve_along(InverseSolver(robot, options), positions_m);
        }
        std::vector<EquilibriumStatus> status;
        for (const int code : path.status) status.push_back(static_cast<EquilibriumStatus>(code));
        return py::make_tuple(status, path.quaternion_wxyz, path.tension_N);
      },
      py::arg("robot"), py::arg("positions_m"), py::kw_only(),
      py::arg_v("distribution", TensionDistribution::barycentre, "TensionDistribution.barycentre"),
      py::arg("lambda_N") = Eigen::VectorXd(),
      py::arg_v("stability", StabilityNotion::locked_lengths, "StabilityNotion.locked_lengths"),
      py::arg("rotation") = py::none(),
      "The inverse problem at positions_m [m, 3], each continued from the one before by Newton "
      "steps, from nothing by NLopt where that fails: (status [m], quaternion_wxyz [m, 4], "
      "tension_N [m, n]), NaN where there is no balance. Raises InputError as inverse does.");
  module.def(
      "holds_orientation", &holds_orientation, py::arg("robot"),
      "Whether lengths hold the whole pose: six cables or more. Then poses are commanded and "
      "tensions chosen; with fewer, tensions are commanded and statics choose the orientation.");
  module.def(
      "held_orientation",
      [](const Robot& robot) -> Matrix3 {
        if (!holds_orientation(robot)) {
          throw InputError("held_orientation: " + robot.name +
                           " has fewer than six cables, which hold none; leave it out");
        }
        return held_orientation(robot).toRotationMatrix();
      },
      py::arg("robot"),
      "The rotation [3, 3] in which six cables and more are commanded to hold the platform when "
      "nobody says: the robot file's own, or the best turn about the vertical.");
  module.def(
      "lambda_of",
      [](const Robot& robot, const PlatformState& state,
         const Eigen::VectorXd& tension_N) -> Eigen::VectorXd {
        return lambda_of(robot, state, to_cable_vector(tension_N, "tension_N", state.cable_count));
      },
      py::arg("robot"), py::arg("state"), py::arg("tension_N"),
      "lambda [n - 3], from six cables on [n - 6], [N] of given tensions at a pose; empty when the "
      "cables do not span space.");
  module.def(
      "tension_margin_N",
      [](const Robot& robot, const Eigen::VectorXd& tension_N) {
        return tension_margin_N(robot,
                                to_cable_vector(tension_N, "tension_N", robot.cable_count()));
      },
      py::arg("robot"), py::arg("tension_N"),
      "Distance [N] of the closest tension to its limit; negative outside.");
}

void register_direct(py::module_& module) {
  module.def(
      "direct_from_tensions",
      [](const Robot& robot, const Eigen::VectorXd& tension_N, const std::optional<Pose>& start) {
        const CableVector tension = to_cable_vector(tension_N, "tension_N", robot.cable_count());
        const py::gil_scoped_release release;
        return direct_from_tensions(robot, tension, start);
      },
      py::arg("robot"), py::arg("tension_N"), py::arg("start") = py::none(),
      "Where a force-controlled platform hangs: minimum of Σ τ l + m g z_G at constant tensions "
      "[n] ≥ 0. Status found, unstable, not_found or invalid_geometry.");
  module.def(
      "direct_from_lengths",
      [](const Robot& robot, const Eigen::VectorXd& length_m, const std::optional<Pose>& start) {
        const CableVector length = to_cable_vector(length_m, "length_m", robot.cable_count());
        const py::gil_scoped_release release;
        return direct_from_lengths(robot, length, start);
      },
      py::arg("robot"), py::arg("length_m"), py::arg("start") = py::none(),
      "Where a platform hangs on cables of given length [n] > 0: the lowest centre of mass with no "
      "cable longer. Status found, slack, unstable, not_found or invalid_geometry. Raises "
      "InputError for n > 6.");
  module.def(
      "all_equilibria_from_tensions",
      [](const Robot& robot, const Eigen::VectorXd& tension_N) {
        const CableVector tension = to_cable_vector(tension_N, "tension_N", robot.cable_count());
        const py::gil_scoped_release release;
        return all_equilibria_from_tensions(robot, tension);
      },
      py::arg("robot"), py::arg("tension_N"),
      "All equilibria that about a dozen starts reach, distinct, stable ones first.");
  module.def(
      "all_equilibria_from_lengths",
      [](const Robot& robot, const Eigen::VectorXd& length_m) {
        const CableVector length = to_cable_vector(length_m, "length_m", robot.cable_count());
        const py::gil_scoped_release release;
        return all_equilibria_from_lengths(robot, length);
      },
      py::arg("robot"), py::arg("length_m"),
      "All equilibria that about a dozen starts reach, distinct, stable ones first.");
}

}  // namespace

void register_equilibria(py::module_& module) {
  register_equilibria_enums(module);
  register_equilibria_results(module);
  register_inverse(module);
  register_direct(module);
}

}  // namespace cdprcal::python
