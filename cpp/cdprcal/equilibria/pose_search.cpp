#include "cdprcal/equilibria/pose_search.hpp"

#include <algorithm>
#include <nlopt.hpp>
#include <vector>

#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {
namespace {

/// One search: keeps the state of the last point, which NLopt asks for twice (value, constraints).
class Search {
 public:
  Search(const Robot& robot, const Pose& start, const PoseObjective& objective,
         const PoseSearchOptions& options)
      : robot_(robot),
        start_(on_motion(robot, start)),
        objective_(objective),
        options_(options),
        free_(robot) {}

  [[nodiscard]] int size() const { return options_.fixed_position ? 3 : 6; }
  [[nodiscard]] int evaluations() const { return evaluations_; }

  Vector6 twist_at(const double* x) const {
    Vector6 twist = Vector6::Zero();
    if (!options_.fixed_position) twist.head<3>() = Eigen::Map<const Vector3>(x);
    twist.tail<3>() = Eigen::Map<const Vector3>(x + size() - 3) / options_.length_scale_m;
    return free_.of(twist);
  }
  Pose pose_at(const double* x) const { return plus(start_, twist_at(x)); }

  double value(const double* x, double* gradient) {
    move_to(x);
    if (!state_.valid) {  // the line search halves its step on infinity
      if (gradient != nullptr) std::fill_n(gradient, size(), 0.0);
      return HUGE_VAL;
    }
    Vector6 by_twist;
    const double v = objective_.value(pose_, state_, gradient != nullptr ? &by_twist : nullptr);
    if (gradient != nullptr) to_coordinates(x, by_twist, gradient);
    return v;
  }

  void constraints(double* result, const double* x, double* gradient) {
    move_to(x);
    const int count = objective_.constraint_count;
    if (!state_.valid) {
      std::fill_n(result, count, HUGE_VAL);
      if (gradient != nullptr) std::fill_n(gradient, count * size(), 0.0);
      return;
    }
    CableJacobian rows;
    const CableVector c =
        objective_.constraint(pose_, state_, gradient != nullptr ? &rows : nullptr);
    std::copy_n(c.data(), count, result);
    if (gradient == nullptr) return;
    for (int i = 0; i < count; ++i) {
      to_coordinates(x, rows.row(i).transpose(), gradient + i * size());
    }
  }

 private:
  void move_to(const double* x) {
    if (evaluations_ > 0 && std::equal(x, x + size(), last_.begin())) return;
    std::copy_n(x, size(), last_.begin());
    pose_ = pose_at(x);
    state_ = platform_state(robot_, pose_);
    ++evaluations_;
  }

  void to_coordinates(const double* x, const Vector6& by_twist, double* gradient) const {
    const Vector3 theta = twist_at(x).tail<3>();
    Vector6 by_x;
    by_x << by_twist.head<3>(),
        left_jacobian_so3(theta).transpose() * by_twist.tail<3>() / options_.length_scale_m;
    by_x = free_.of(by_x);
    std::copy_n(by_x.data() + 6 - size(), size(), gradient);
  }

  const Robot& robot_;
  Pose start_;
  const PoseObjective& objective_;
  const PoseSearchOptions& options_;
  FreeMotion free_;
  std::array<double, 6> last_{};
  Pose pose_;
  PlatformState state_;
  int evaluations_ = 0;
};

double objective_callback(unsigned, const double* x, double* gradient, void* data) {
  return static_cast<Search*>(data)->value(x, gradient);
}

void constraint_callback(unsigned, double* result, unsigned, const double* x, double* gradient,
                         void* data) {
  static_cast<Search*>(data)->constraints(result, x, gradient);
}

}  // namespace

Box search_bounds(const Robot& robot) {
  Box bounds = pulley_box(robot);
  const double reach = platform_reach_m(robot);
  const double size = bounds.extent_m().norm() + reach;
  bounds.lower_m -= Vector3(size, size, 10.0 * size);
  bounds.upper_m += Vector3(size, size, reach);
  return bounds;
}

PoseSearchResult search_pose(const Robot& robot, const Pose& start, const Box& bounds,
                             const PoseObjective& objective, const PoseSearchOptions& options) {
  Search search(robot, start, objective, options);
  const auto n = static_cast<unsigned>(search.size());
  nlopt::opt optimiser(nlopt::LD_SLSQP, n);
  optimiser.set_min_objective(objective_callback, &search);
  std::vector<double> lower(n, -kPi * options.length_scale_m);
  std::vector<double> upper(n, kPi * options.length_scale_m);
  if (!options.fixed_position) {
    for (int a = 0; a < 3; ++a) {  // a start outside the box widens it
      lower[a] = std::min(0.0, bounds.lower_m[a] - start.position_m[a]);
      upper[a] = std::max(0.0, bounds.upper_m[a] - start.position_m[a]);
    }
  }
  optimiser.set_lower_bounds(lower);
  optimiser.set_upper_bounds(upper);
  optimiser.set_xtol_rel(options.relative_tolerance);
  optimiser.set_xtol_abs(options.relative_tolerance * options.length_scale_m);
  optimiser.set_maxeval(options.max_evaluations);
  if (objective.constraint_count > 0) {
    const std::vector<double> tolerance(objective.constraint_count, 1e-9);
    optimiser.add_inequality_mconstraint(constraint_callback, &search, tolerance);
  }

  PoseSearchResult result;
  std::vector<double> x(n, 0.0);
  try {
    const nlopt::result code = optimiser.optimize(x, result.value);
    result.finished = code > 0 && code != nlopt::MAXEVAL_REACHED && std::isfinite(result.value);
    if (!result.finished) result.message = "the optimiser spent its evaluations";
  } catch (const nlopt::roundoff_limited&) {
    result.finished = true;                // as good as doubles allow: Newton takes over
  } catch (const std::exception& error) {  // NLopt reports numerical failure by throwing
    result.message = std::string("the optimiser gave up (") + error.what() + ")";
  }
  result.pose = search.pose_at(x.data());
  result.evaluations = search.evaluations();
  for (unsigned a = 0; a < 3 && !options.fixed_position; ++a) {
    const double slack = 1e-6 * (upper[a] - lower[a]);
    result.at_bound = result.at_bound || x[a] < lower[a] + slack || x[a] > upper[a] - slack;
  }
  return result;
}

}  // namespace cdprcal
