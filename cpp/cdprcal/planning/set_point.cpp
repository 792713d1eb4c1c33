#include "cdprcal/planning/set_point.hpp"

#include <sstream>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

InverseOptions inverse_options(const Robot& robot, const SetPointOptions& options) {
  InverseOptions out;
  out.distribution = options.distribution;
  out.lambda_N = options.lambda_N;
  out.rotation = options.rotation;
  if (!holds_orientation(robot)) out.stability = StabilityNotion::constant_tensions;
  return out;
}

/// Why a position is no set-point, for people who chose it.
std::string explain(const InverseResult& result) {
  switch (result.status) {
    case EquilibriumStatus::infeasible:
      return "the tensions that hold the platform there are beyond the robot's limits";
    case EquilibriumStatus::unstable:
      return "the platform is in balance there, but not stable when its tensions are held constant";
    default:
      return result.reason;
  }
}

}  // namespace

double tension_margin_N(const Robot& robot, const SetPointOptions& options) {
  const double margin = options.tension_margin_N.value_or(robot.sigma.tension_N);
  const double range = robot.tension_max_N - robot.tension_min_N;
  if (!(margin >= 0.0) || !(2.0 * margin < range)) {
    std::ostringstream text;
    text << "tension margin: " << margin << " N must be at least 0 and less than half the range of "
         << "the tension limits, " << robot.tension_min_N << " to " << robot.tension_max_N << " N";
    throw InputError(text.str());
  }
  return margin;
}

void require_tensions_of(const Robot& robot, const CableVector& reading_N,
                         const std::string& what) {
  if (reading_N.size() == robot.cable_count()) return;
  throw InputError("plan: " + what + " has " + std::to_string(reading_N.size()) + " tensions; " +
                   robot.name + " has " + std::to_string(robot.cable_count()) +
                   " cables; give the plan of this robot");
}

double margin_within_limits_N(const Robot& robot, const CableVector& tension_N,
                              const std::string& what) {
  const double margin_N = tension_margin_N(robot, tension_N);
  if (margin_N >= 0.0) return margin_N;
  throw InputError("plan: a tension of " + what + " is beyond the limits of " + robot.name +
                   "; make the plan anew");
}

SetPointSolver::SetPointSolver(const Robot& robot, const SetPointOptions& options)
    : solver_(robot, inverse_options(robot, options)),
      margin_N_(tension_margin_N(robot, options)) {}

SetPointSolver::Result SetPointSolver::at(const Vector3& position_m) const {
  if (!position_m.allFinite()) throw InputError("set-point: the position must be finite [m]");
  const InverseResult found = solver_.describe(position_m, solver_.solve(position_m));
  Result result;
  if (found.status != EquilibriumStatus::found) {
    result.reason = explain(found);
  } else if (found.margin_N < margin_N_) {
    std::ostringstream text;
    text.precision(3);
    text << "a tension is only " << found.margin_N << " N from the robot's limits; the margin is "
         << margin_N_ << " N";
    result.reason = text.str();
  } else {
    result.set_point = SetPoint{found.pose, found.tension_N};
  }
  return result;
}

bool SetPointSolver::in_workspace(const Vector3& position_m,
                                  const Eigen::Quaterniond& rotation) const {
  if (solver_.continue_from(position_m, rotation).status == EquilibriumStatus::found) return true;
  return !holds_orientation(robot()) &&
         solver_.solve(position_m).status == EquilibriumStatus::found;
}

Vector6 settling_deviation(const Robot& robot, const SetPoint& set_point) {
  const PlatformState state = platform_state(robot, set_point.pose);
  if (!state.valid) return Vector6::Constant(kNaN);
  if (holds_orientation(robot)) {
    const Eigen::MatrixXd jacobian =
        FreeMotion(robot).of(length_jacobian(state).transpose()).transpose();
    const Eigen::MatrixXd by_length = pseudo_inverse(jacobian);
    return robot.sigma.length_m * by_length.rowwise().norm();
  }
  const Eigen::MatrixXd hessian = stiffness(robot, state, set_point.tension_N);
  const WrenchMatrix by_tension = solve_square(hessian, Eigen::MatrixXd(structure_matrix(state)));
  return robot.sigma.tension_N * by_tension.rowwise().norm();
}

bool survives_tension_error(const SetPointSolver& solver, const SetPoint& set_point) {
  const Vector6 deviation = settling_deviation(solver.robot(), set_point);
  if (!deviation.allFinite()) return false;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Vector3 there =
          set_point.pose.position_m + sign * deviation[axis] * Vector3::Unit(axis);
      if (!solver.in_workspace(there, set_point.pose.rotation)) return false;
    }
  }
  return true;
}

}  // namespace cdprcal
