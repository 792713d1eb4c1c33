#include "cdprcal/diagnosis/discrete.hpp"

#include <algorithm>
#include <numeric>

namespace cdprcal {
namespace {

/// A fault must lower the cost by this factor: the small effects never do.
constexpr double kOrdersOfMagnitude = 10.0;
constexpr int kMostFaults = 6;

std::string channel_list(const std::vector<double>& signs) {
  std::string out;
  for (std::size_t i = 0; i < signs.size(); ++i) {
    if (signs[i] < 0.0) out += (out.empty() ? "" : ", ") + std::to_string(i + 1);
  }
  return out;
}

void add_signs(const std::string& name, const std::string& what, int n,
               std::vector<DiscreteFault>& out) {
  const auto add = [&](std::vector<double> signs) {
    const std::string list = channel_list(signs);
    out.push_back({name, "sign", std::move(signs), what + " of cable " + list + " counts backwards"});
  };
  add(std::vector<double>(static_cast<std::size_t>(n), -1.0));
  // Every combination while there are few; one and two at a time beyond.
  for (int mask = 1; mask < (1 << n) - 1; ++mask) {
    if (n > 5 && __builtin_popcount(static_cast<unsigned>(mask)) > 2) continue;
    std::vector<double> signs;
    for (int i = 0; i < n; ++i) signs.push_back((mask >> i) & 1 ? -1.0 : 1.0);
    add(std::move(signs));
  }
}

std::vector<DiscreteFault> all_faults(const Robot& robot, const Log& log) {
  const int n = robot.cable_count();
  std::vector<DiscreteFault> out;
  if (log.length_m.cols() > 0) add_signs("length_sign", "the length", n, out);
  if (log.swivel_rad.cols() > 0) add_signs("swivel_sign", "the swivel", n, out);
  std::vector<double> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 1.0);
  if (n <= 4) {
    while (std::next_permutation(order.begin(), order.end())) {
      out.push_back({"cable_order", "order", order, "the cables are read in another order"});
    }
  } else {
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        std::vector<double> swapped = order;
        std::swap(swapped[static_cast<std::size_t>(i)], swapped[static_cast<std::size_t>(j)]);
        out.push_back({"cable_order", "order", swapped,
                       "cables " + std::to_string(i + 1) + " and " + std::to_string(j + 1) +
                           " are read in each other's place"});
      }
    }
  }
  out.push_back({"length_unit", "factor", {1e-3}, "the lengths are in millimetres"});
  // values: factor of swivels, factor of attitude
  out.push_back({"angle_unit", "factor", {kDegree, 1.0}, "the swivel angles are in degrees"});
  out.push_back({"angle_unit", "factor", {1.0, kDegree}, "the attitude is in degrees"});
  out.push_back({"angle_unit", "factor", {kDegree, kDegree}, "all angles are in degrees"});
  for (int c = 0; c < 6; ++c) {
    if (static_cast<EulerConvention>(c) == robot.euler_convention) continue;
    out.push_back({"euler_convention", "convention", {static_cast<double>(c)},
                   "the attitude's Euler angles are " +
                       to_string(static_cast<EulerConvention>(c))});
  }
  return out;
}

double cost_of(const Robot& robot, const Log& log, int most_starts, bool& agrees) {
  CalibrateOptions options;
  options.method = log.tension_N.cols() > 0 ? Method::statics : Method::kinematic;
  options.most_starts = most_starts;
  options.solve.max_iterations = 50;
  const Calibration c = calibrate(robot, log, options);
  agrees = c.result.status == CalibrationStatus::converged;
  return std::isfinite(c.result.cost) ? c.result.cost : std::numeric_limits<double>::infinity();
}

}  // namespace

void set_right(const DiscreteFault& fault, Robot& robot, Log& log) {
  const auto scale = [&](LogMatrix& m) {
    for (Eigen::Index i = 0; i < m.cols(); ++i) m.col(i) *= fault.values[static_cast<std::size_t>(i)];
  };
  if (fault.name == "length_sign") {
    scale(log.length_m);
  } else if (fault.name == "swivel_sign") {
    scale(log.swivel_rad);
  } else if (fault.name == "cable_order") {
    for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
      const LogMatrix read = *m;
      for (Eigen::Index i = 0; i < m->cols(); ++i) {
        m->col(i) = read.col(static_cast<Eigen::Index>(fault.values[static_cast<std::size_t>(i)]) - 1);
      }
    }
  } else if (fault.name == "length_unit") {
    log.length_m *= fault.values[0];
  } else if (fault.name == "angle_unit") {
    log.swivel_rad *= fault.values[0];
    log.roll_pitch_yaw_rad *= fault.values[1];
  } else if (fault.name == "euler_convention") {
    robot.euler_convention = static_cast<EulerConvention>(static_cast<int>(fault.values[0]));
  }
}

DiscreteSearch find_discrete_faults(Robot& robot, Log& log) {
  DiscreteSearch search;
  bool agrees = false;
  double cost = search.cost_before = cost_of(robot, log, 8, agrees);
  while (!agrees && static_cast<int>(search.faults.size()) < kMostFaults) {
    std::optional<DiscreteFault> best;
    double best_cost = cost;
    bool best_agrees = false;
    for (const DiscreteFault& fault : all_faults(robot, log)) {
      Robot trial_robot = robot;
      Log trial_log = log;
      set_right(fault, trial_robot, trial_log);
      bool trial_agrees = false;
      // Some hundred trials: the right one comes down from the first start in a few steps.
      const double trial_cost = cost_of(trial_robot, trial_log, 1, trial_agrees);
      if (trial_cost < best_cost) {
        best = fault;
        best_cost = trial_cost;
        best_agrees = trial_agrees;
      }
    }
    // The last of several faults must make the log agree; one on the way must help a great deal.
    if (!best || !(best_cost * kOrdersOfMagnitude < cost)) break;
    set_right(*best, robot, log);
    search.faults.push_back(*best);
    cost = best_cost;
    agrees = best_agrees;
  }
  search.cost_after = cost;
  return search;
}

}  // namespace cdprcal
