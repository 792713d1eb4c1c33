#include "cdprcal/planning/plan.hpp"

#include <algorithm>

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/planning/candidates.hpp"
#include "cdprcal/planning/known_effects.hpp"
#include "cdprcal/planning/legs.hpp"
#include "cdprcal/planning/observability.hpp"

namespace cdprcal {
namespace {

/// Freedoms that cables of given lengths leave the platform, where they are independent.
Eigen::Index usual_modes(const Robot& robot) {
  return std::max<Eigen::Index>(0, motion_basis(robot).cols() - robot.cable_count());
}

/// How far a planned pose may be from where the platform settles [m, rad].
constexpr double kSettled = 1e-3;

/// Ends planning from anywhere in it; make_plan turns it into a status.
struct Ended {
  PlanStatus status;
  std::string reason;
};

/// One planning task, stage after stage.
class Planner {
 public:
  Planner(const Robot& robot, const PlanOptions& options)
      : robot_(robot),
        options_(options),
        solver_(robot, options.set_points),
        checker_(solver_, path_options(robot, options)),
        timer_(checker_, options.timing) {
    if (options.optimal < 0)
      throw InputError("plan: the number of optimal poses must be 0 or more");
    if (options.order == VisitingOrder::random && options.visits < 1) {
      throw InputError("plan: at least 1 visit of each pose");
    }
    if (options.box) check_box(robot, *options.box);
  }

  PlanResult run() {
    PlanResult result;
    try {
      find_box(result);
      start_ = set_point_at(options_.home_m.value_or(home()), "the start");
      const std::vector<SetPoint> measured =
          options_.optimal > 0 ? choose(result) : grid_or_given();
      arrange(measured, result);
      result.status = PlanStatus::planned;
    } catch (const Ended& ended) {
      result.status = ended.status;
      result.reason = ended.reason;
      result.plan = Plan{};
    }
    return result;
  }

 private:
  static PathOptions path_options(const Robot& robot, const PlanOptions& options) {
    PathOptions out;
    out.tension_margin_N = tension_margin_N(robot, options.set_points);
    out.bounds = options.bounds;
    return out;
  }

  void report(const char* stage, double share) const {
    if (options_.progress && !options_.progress({stage, share})) {
      throw Ended{PlanStatus::stopped, "stopped"};
    }
  }
  [[nodiscard]] ShareDone reporter(const char* stage) const {
    if (!options_.progress) return {};
    return [this, stage](double share) { return options_.progress({stage, share}); };
  }

  void find_box(PlanResult& result) {
    if (options_.box) {
      box_ = in_plane(robot_, *options_.box);
      result.box_origin = "given";
    } else if (!options_.positions_m.empty()) {
      box_ = Box::empty();
      for (const Vector3& p : options_.positions_m) box_.include(p);
      result.box_origin = "around the positions given";
    } else {
      report("measurement box", 0.0);
      const auto proceed = [this] {
        return !options_.progress || options_.progress({"measurement box", 0.0});
      };
      const BoxProposal proposal = propose_measurement_box(robot_, options_.set_points, proceed);
      if (proposal.stopped) throw Ended{PlanStatus::stopped, "stopped"};
      if (!proposal.box) throw Ended{PlanStatus::infeasible, proposal.reason};
      box_ = *proposal.box;
      result.box_origin = proposal.reason;
    }
    result.box = box_;
  }

  [[nodiscard]] Vector3 home() const { return 0.5 * (box_.lower_m + box_.upper_m); }

  [[nodiscard]] SetPoint set_point_at(const Vector3& position_m, const std::string& what) const {
    const SetPointSolver::Result found = solver_.at(position_m);
    if (!found.set_point) {
      throw Ended{PlanStatus::infeasible,
                  what + " at " + in_words(position_m) + " is no set-point: " + found.reason};
    }
    return *found.set_point;
  }

  [[nodiscard]] std::vector<SetPoint> grid_or_given() const {
    const std::vector<Vector3> positions =
        options_.positions_m.empty() ? grid_positions(box_, in_plane(robot_, options_.grid))
                                     : options_.positions_m;
    std::vector<SetPoint> out;
    for (const Vector3& position : positions) {
      report("set-points", static_cast<double>(out.size()) / static_cast<double>(positions.size()));
      out.push_back(set_point_at(position, "pose " + std::to_string(out.size() + 1)));
    }
    return out;
  }

  /// Poses by observability, and what a grid would give.
  [[nodiscard]] std::vector<SetPoint> choose(PlanResult& result) const {
    const ReachableSetPoints candidates =
        reachable_set_points(checker_, start_, options_.box, reporter("candidates"));
    if (candidates.stopped) throw Ended{PlanStatus::stopped, "stopped"};
    result.candidates = static_cast<int>(candidates.set_points.size());
    if (result.candidates < options_.optimal) {
      throw Ended{PlanStatus::infeasible, "only " + std::to_string(result.candidates) +
                                              " set-points can be reached safely; " +
                                              std::to_string(options_.optimal) + " were asked for"};
    }
    const Observability observability(robot_, start_);
    std::vector<Eigen::MatrixXd> information;
    for (const SetPoint& candidate : candidates.set_points) {
      report("observability", 0.5 * static_cast<double>(information.size()) / result.candidates);
      information.push_back(observability.added_by(candidate));
    }
    std::vector<SetPoint> chosen;
    GridComparison comparison;
    for (int count = 1; count <= options_.optimal; ++count) {
      const auto proceed = [&] {
        return !options_.progress ||
               options_.progress({"observability", 0.5 + 0.5 * count / options_.optimal});
      };
      const Selection selection = select_d_optimal(observability.of_start(), information, count,
                                                   proceed, motion_basis(robot_));
      if (selection.stopped) throw Ended{PlanStatus::stopped, "stopped"};
      comparison.optimal_standard_deviation.push_back(square_roots(selection.covariance));
      if (count < options_.optimal) continue;
      for (const int c : selection.chosen) chosen.push_back(candidates.set_points[c]);
    }
    compare(comparison, result);
    return chosen;
  }

  /// Against the grid, when all of it can be measured.
  void compare(GridComparison& comparison, PlanResult& result) const {
    std::vector<SetPoint> grid;
    for (const Vector3& position : grid_positions(box_, in_plane(robot_, options_.grid))) {
      const SetPointSolver::Result found = solver_.at(position);
      if (!found.set_point) return;
      grid.push_back(*found.set_point);
    }
    comparison.grid_poses = static_cast<int>(grid.size());
    comparison.grid_standard_deviation = square_roots(predicted_covariance(robot_, start_, grid));
    const Vector6& of_grid = comparison.grid_standard_deviation;
    for (std::size_t i = 0; i < comparison.optimal_standard_deviation.size(); ++i) {
      const Vector6& optimal = comparison.optimal_standard_deviation[i];
      if (optimal.head<3>().norm() <= of_grid.head<3>().norm() &&
          optimal.tail<3>().norm() <= of_grid.tail<3>().norm()) {
        comparison.poses_needed = static_cast<int>(i) + 1;
        break;
      }
    }
    result.comparison = comparison;
  }

  /// Order and times of the measured set-points.
  void arrange(const std::vector<SetPoint>& measured, PlanResult& result) const {
    std::vector<SetPoint> places{start_};
    places.insert(places.end(), measured.begin(), measured.end());
    const LegTable legs(checker_, timer_, places, options_.threads, reporter("paths"));
    if (legs.stopped()) throw Ended{PlanStatus::stopped, "stopped"};
    const Eigen::MatrixXd time_s = legs.time_s();
    for (std::size_t p = 1; p < places.size(); ++p) {
      const int place = static_cast<int>(p);
      if (!legs.way(0, place).empty() && !legs.way(place, 0).empty()) continue;
      throw Ended{
          PlanStatus::infeasible,
          "pose " + std::to_string(p) + " at " + in_words(places[p].pose.position_m) +
              " cannot be reached from the start and left again: " + legs.obstacle(0, place)};
    }
    report("order", 0.0);
    std::vector<int> order;
    if (options_.order == VisitingOrder::random) {
      const Eigen::MatrixXd lengths = lengths_of(places);
      order = random_order(lengths, options_.visits, options_.seed);
      result.approach = approach_coverage(lengths, order);
    } else {
      const Tour tour = least_time_tour(time_s);
      order = tour.order;
      result.order_is_optimal = tour.optimal;
    }
    write(legs, order, result.plan);
  }

  [[nodiscard]] Eigen::MatrixXd lengths_of(const std::vector<SetPoint>& places) const {
    Eigen::MatrixXd lengths(places.size(), robot_.cable_count());
    for (std::size_t i = 0; i < places.size(); ++i) {
      lengths.row(static_cast<Eigen::Index>(i)) =
          platform_state(robot_, places[i].pose).length_m().transpose();
    }
    return lengths;
  }

  void write(const LegTable& legs, const std::vector<int>& order, Plan& plan) const {
    plan.robot_name = robot_.name;
    plan.start_tension_N = start_.tension_N;
    plan.start_pose = start_.pose;
    std::vector<SetPoint> measured;
    int at = 0;
    for (const int pose : order) {
      const std::vector<Leg> way = legs.way(at, pose + 1);
      for (std::size_t i = 0; i < way.size(); ++i) {
        const SetPoint& place = legs.places()[static_cast<std::size_t>(way[i].to)];
        const Timing& timing = way[i].timing;
        const PlatformState state = platform_state(robot_, place.pose);
        PlannedPose stop;
        stop.measured = i + 1 == way.size();
        stop.pose = place.pose;
        stop.tension_N = place.tension_N;
        stop.transition_s = timing.transition_s;
        stop.dwell_s = stop.measured ? timing.dwell_s : timing.settling_s;
        if (!holds_orientation(robot_)) {
          // Where cables are dependent one motion more is free: a plan has as many a stop.
          const ModeVector free =
              free_motion_modes(robot_, state, place.tension_N).natural_frequency_hz;
          stop.natural_frequencies_hz = free.head(std::min(free.size(), usual_modes(robot_)));
          stop.constant_tension_frequencies_hz =
              constant_tension_modes(robot_, state, place.tension_N).natural_frequency_hz;
        }
        plan.poses.push_back(stop);
        plan.start_dwell_s = std::max(plan.start_dwell_s, timing.dwell_s);
        if (stop.measured) measured.push_back(place);
      }
      at = pose + 1;
    }
    plan.duration_s = plan.start_dwell_s;
    for (const PlannedPose& stop : plan.poses) plan.duration_s += stop.transition_s + stop.dwell_s;
    plan.predicted_standard_deviation =
        square_roots(predicted_covariance(robot_, start_, measured));
  }

  const Robot& robot_;
  const PlanOptions& options_;
  SetPointSolver solver_;
  PathChecker checker_;
  TransitionTimer timer_;
  Box box_;
  SetPoint start_;
};

}  // namespace

int Plan::measured_count() const {
  return static_cast<int>(
      std::count_if(poses.begin(), poses.end(), [](const PlannedPose& p) { return p.measured; }));
}

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::planned:
      return "planned";
    case PlanStatus::infeasible:
      return "infeasible";
    case PlanStatus::stopped:
      return "stopped";
  }
  return "unknown";
}

PlanResult make_plan(const Robot& robot, const PlanOptions& options) {
  const KnownEffects effects(robot);
  PlanResult result = Planner(effects.robot(), options).run();
  if (result.status == PlanStatus::planned &&
      !apply_known_effects(effects, result.plan, result.reason)) {
    result.status = PlanStatus::infeasible;
    result.plan = Plan{};
  }
  return result;
}

std::string verify_plan(const Robot& given, const Plan& plan, const std::optional<Box>& bounds) {
  const KnownEffects effects(given);
  const Robot& robot = effects.robot();
  const auto name_of = [](std::size_t i) {
    return i == 0 ? std::string("the start") : "stop " + std::to_string(i);
  };
  std::vector<SetPoint> stops{{plan.start_pose, plan.start_tension_N}};
  for (const PlannedPose& pose : plan.poses) stops.push_back({pose.pose, pose.tension_N});
  for (std::size_t i = 0; i < stops.size(); ++i) {
    SetPoint& stop = stops[i];
    require_tensions_of(robot, stop.tension_N, name_of(i));
    if (!effects.any()) {
      margin_within_limits_N(robot, stop.tension_N, name_of(i));
      continue;
    }
    const std::optional<Pose> settled = effects.settled(stop.tension_N, stop.pose);
    if (!settled || minus(*settled, stop.pose).norm() > kSettled) {
      return name_of(i) + " is not where the platform rests, with the effects of " + robot.name;
    }
    // The path is followed as it was planned: true tensions, no forces but the weight.
    const std::optional<SetPoint> planned = effects.as_planned(stop);
    if (!planned) return name_of(i) + ": its tensions do not hold the platform";
    stop = *planned;
    margin_within_limits_N(robot, stop.tension_N, name_of(i));
  }

  SetPointOptions any_margin;
  any_margin.tension_margin_N = 0.0;
  const SetPointSolver solver(robot, any_margin);
  PathOptions options;
  options.bounds = bounds;
  const PathChecker checker(solver, options);
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const Path path = checker.follow(stops[i - 1], stops[i]);
    if (!path.clear()) return "from " + name_of(i - 1) + " to " + name_of(i) + ": " + path.reason;
  }
  return {};
}

}  // namespace cdprcal
