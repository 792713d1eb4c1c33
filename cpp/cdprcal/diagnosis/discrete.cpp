#include "cdprcal/diagnosis/discrete.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "cdprcal/effects/reading_faults.hpp"

namespace cdprcal {
namespace {

/// A fault must lower the cost by this factor: the small effects never do.
constexpr double kOrdersOfMagnitude = 10.0;
constexpr int kMostFaults = 6;
constexpr int kAllStarts = 8;
/// Rests that the trials look at, or samples where nothing says that the platform rests.
constexpr int kMostRests = 9, kMostSamples = 30;
/// Pairs of faults that are tried, about a millisecond each.
constexpr std::size_t kMostPairs = 3000;

/// Signs in any combination but all +1, and what each says: between `before` and `after` the list
/// of `names` where the sign is −1.
void add_signs(const std::string& fault, const std::vector<std::string>& names,
               const std::string& before, const std::string& after,
               std::vector<DiscreteFault>& out) {
  const int n = static_cast<int>(names.size());
  for (int mask = 1; mask < 1 << n; ++mask) {
    std::vector<double> signs;
    std::string list;
    for (int i = 0; i < n; ++i) {
      const bool reversed = ((mask >> i) & 1) != 0;
      signs.push_back(reversed ? -1.0 : 1.0);
      if (reversed) list += (list.empty() ? "" : ", ") + names[static_cast<std::size_t>(i)];
    }
    out.push_back({fault, "sign", std::move(signs), before + list + after});
  }
}

CalibrateOptions options_for(const Log& log) {
  CalibrateOptions options;
  options.method = log.tension_N.cols() > 0 ? Method::statics : Method::kinematic;
  options.noise = NoiseSource::specified;
  options.solve.max_iterations = 50;
  options.solve.explain = false;
  return options;
}

/// What a calibration says of a map of the readings.
struct Trial {
  double cost = std::numeric_limits<double>::infinity();
  double expected = 0.0;    ///< cost of a right map, with errors as specified
  bool agrees = false;      ///< a pose is found, and the residuals are within their sigma
  bool says_enough = true;  ///< not when the pose is left open: whatever fits then proves nothing
  bool surprises = true;    ///< residuals that chance would not make
};

Trial try_map(const Robot& robot, const Log& log, const std::vector<double>& at_s,
              int most_starts) {
  constexpr double kChance = 1e-3;
  CalibrateOptions options = options_for(log);
  options.most_starts = most_starts;
  options.at_s = at_s;
  const CalibrationResult result = calibrate(robot, log, options).result;
  Trial out;
  if (std::isfinite(result.cost)) out.cost = result.cost;
  out.expected = 0.5 * std::max(1, result.residual_count - result.parameter_count);
  out.agrees = result.status == CalibrationStatus::converged;
  out.says_enough = result.status != CalibrationStatus::unobservable;
  out.surprises = !(result.chi_square_p_value >= kChance);
  return out;
}

/// Root mean square of what readings vary by about each sensor's mean.
double variation(const LogMatrix& readings) {
  double squares = 0.0;
  Eigen::Index count = 0;
  for (Eigen::Index c = 0; c < readings.cols(); ++c) {
    const Eigen::VectorXd column = readings.col(c);
    const auto read = column.array().isFinite();
    const auto number = read.count();
    const double mean = read.select(column.array(), 0.0).sum() / static_cast<double>(number);
    squares += read.select((column.array() - mean).square(), 0.0).sum();
    count += number;
  }
  return std::sqrt(squares / static_cast<double>(count));
}

/// Whether setting a fault right (a unit) shrinks readings until they say nothing: whatever fits
/// then proves nothing.
bool silences(const Robot& robot, const Log& before, const Log& after) {
  const auto silenced = [](const LogMatrix& was, const LogMatrix& is, double sigma) {
    const double left = variation(is);
    return left < 0.5 * variation(was) && !(left > sigma);
  };
  return silenced(before.length_m, after.length_m, robot.sigma.length_m) ||
         silenced(before.swivel_rad, after.swivel_rad, robot.sigma.swivel_rad) ||
         silenced(before.roll_pitch_yaw_rad, after.roll_pitch_yaw_rad, robot.sigma.attitude_rad);
}

/// A log of a few rows, each the mean over a rest, or a sample in motion where there are no load
/// cells, spread over the run; and their times. Nothing when there are too few.
std::optional<Log> few_poses(const Robot& robot, const Log& log, std::vector<double>& at_s) {
  const CalibrateOptions options = options_for(log);
  std::vector<Measurement> poses =
      prepare(without_reading_faults(robot), log, options).problem.measurements;
  const bool at_rest = options.method == Method::statics;
  if (at_rest) {
    std::erase_if(poses, [](const Measurement& m) { return m.kind != PoseKind::static_pose; });
  }
  const auto count = static_cast<int>(poses.size());
  if (count < 2) return std::nullopt;
  const int rows = std::min(count, at_rest ? kMostRests : kMostSamples);
  std::vector<Measurement> chosen;
  for (int row = 0; row < rows; ++row) {
    chosen.push_back(poses[static_cast<std::size_t>(row * (count - 1) / (rows - 1))]);
  }
  Log brief = log_of(chosen);  // a second apart: one segment
  brief.source = log.source;
  at_s.assign(brief.time_s.begin(), brief.time_s.end());
  return brief;
}

}  // namespace

AppliedEffect as_listed(const DiscreteFault& fault) {
  AppliedEffect listed{fault.name, "", {{fault.parameter, fault.values}}};
  if (!fault.tension_order.empty()) {
    listed.parameters.push_back({"tension_order", fault.tension_order});
  }
  return listed;
}

void set_right(const DiscreteFault& fault, Robot& robot, Log& log) {
  if (fault.convention) {
    robot.euler_convention = *fault.convention;
  } else {
    set_right(as_listed(fault), log);
  }
}

std::vector<DiscreteFault> attitude_faults(const Robot& robot, const Log& log) {
  std::vector<DiscreteFault> out;
  if (log.roll_pitch_yaw_rad.cols() == 0) return out;
  for (int c = 0; c < 6; ++c) {
    const auto convention = static_cast<EulerConvention>(c);
    if (convention == robot.euler_convention) continue;
    out.push_back({"euler_convention",
                   "convention",
                   {static_cast<double>(c)},
                   "the attitude's Euler angles are " + to_string(convention),
                   {},
                   convention});
  }
  add_signs("attitude_sign", {"roll", "pitch", "yaw"}, "the AHRS counts ", " backwards", out);
  return out;
}

std::vector<DiscreteFault> discrete_faults(const Robot& robot, const Log& log) {
  const int n = robot.cable_count();
  std::vector<DiscreteFault> out;
  std::vector<std::string> numbers;
  for (int i = 1; i <= n; ++i) numbers.push_back(std::to_string(i));
  if (log.length_m.cols() > 0) {
    add_signs("length_sign", numbers, "the length of cable ", " counts backwards", out);
  }
  if (log.swivel_rad.cols() > 0) {
    add_signs("swivel_sign", numbers, "the swivel of cable ", " counts backwards", out);
  }
  std::vector<double> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 1.0);
  // The drives are in another order, or the encoders alone, or the load cells alone.
  const std::vector<double> as_it_is = order;
  const auto add_order = [&](const std::vector<double>& wrong, const std::string& cables) {
    out.push_back({"cable_order", "order", wrong, cables + " are read in another order"});
    if (log.tension_N.cols() == 0) return;
    out.push_back({"cable_order", "order", wrong,
                   "the length and swivel encoders of " + cables +
                       " are read in another order, the load cells are not",
                   as_it_is});
    out.push_back({"cable_order", "order", as_it_is,
                   "the load cells of " + cables + " are read in another order", wrong});
  };
  if (n <= 6) {
    while (std::next_permutation(order.begin(), order.end())) add_order(order, "the cables");
  } else {
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        std::vector<double> swapped = order;
        std::swap(swapped[static_cast<std::size_t>(i)], swapped[static_cast<std::size_t>(j)]);
        add_order(swapped, "cables " + std::to_string(i + 1) + " and " + std::to_string(j + 1));
      }
    }
  }
  out.push_back({"length_unit", "factor", {1e-3}, "the lengths are in millimetres"});
  // values: factor of swivels, factor of attitude
  out.push_back({"angle_unit", "factor", {kDegree, 1.0}, "the swivel angles are in degrees"});
  out.push_back({"angle_unit", "factor", {1.0, kDegree}, "the attitude is in degrees"});
  out.push_back({"angle_unit", "factor", {kDegree, kDegree}, "all angles are in degrees"});
  if (log.tension_N.cols() > 0) {
    constexpr double kKilogram_N = 9.80665, kPound_N = 4.4482216152605;
    const auto add_unit = [&](double factor, const char* unit) {
      out.push_back(
          {"tension_unit", "factor", {factor}, std::string("the tensions are in ") + unit});
    };
    add_unit(kKilogram_N, "kgf");
    add_unit(1e-3 * kKilogram_N, "gf");
    add_unit(kPound_N, "lbf");
    add_unit(1e3, "kN");
  }
  const std::vector<DiscreteFault> of_attitude = attitude_faults(robot, log);
  out.insert(out.end(), of_attitude.begin(), of_attitude.end());
  return out;
}

namespace {

/// The trials of one log: faults set right in a few of its poses.
class Trials {
 public:
  Trials(const Robot& robot, const Log& log) : robot_(robot), log_(log) {
    // Hundreds of trials: a few of the poses tell a wrong map as well as all of them do.
    if (std::optional<Log> brief = few_poses(robot, log, at_s_)) log_ = *std::move(brief);
    const Trial as_read = try_map(robot_, log_, at_s_, kAllStarts);
    cost_ = as_read.cost;
    expected_ = as_read.expected;
  }

  void consider_single() {
    forget();
    for (const DiscreteFault& fault : discrete_faults(robot_, log_)) consider({fault});
  }
  /// Cables in another order, and signs beside: neither alone says much.
  void consider_pairs() {
    forget();
    std::vector<DiscreteFault> orders, signs;
    for (const DiscreteFault& fault : discrete_faults(robot_, log_)) {
      if (fault.parameter == "order") orders.push_back(fault);
      if (fault.parameter == "sign") signs.push_back(fault);
    }
    if (orders.size() * signs.size() > kMostPairs) return;
    for (const DiscreteFault& order : orders) {
      for (const DiscreteFault& sign : signs) consider({sign, order});
    }
  }

  /// Whether the best considered helps a great deal: the small effects never do.
  [[nodiscard]] bool found() const { return best_cost_ * kOrdersOfMagnitude < cost_; }
  /// Whether there is room for two that help so much each: the small effects never need them.
  [[nodiscard]] bool may_hold_two() const {
    return cost_ > kOrdersOfMagnitude * kOrdersOfMagnitude * expected_;
  }
  /// Whether it makes the log agree.
  [[nodiscard]] bool agrees() const { return agrees_; }
  /// Sets the best right for good.
  void take(std::vector<DiscreteFault>& faults) {
    for (const DiscreteFault& fault : best_) {
      set_right(fault, robot_, log_);
      faults.push_back(fault);
    }
    cost_ = best_cost_;
  }

 private:
  void consider(const std::vector<DiscreteFault>& together) {
    Robot robot = robot_;
    Log log = log_;
    for (const DiscreteFault& fault : together) set_right(fault, robot, log);
    if (silences(robot_, log_, log)) return;
    // The right one comes down from the first start in a few steps.
    const Trial trial = try_map(robot, log, at_s_, 1);
    if (!trial.says_enough || !(trial.cost < best_cost_)) return;
    best_ = together;
    best_cost_ = trial.cost;
    agrees_ = trial.agrees;
  }
  void forget() {
    best_.clear();
    best_cost_ = cost_;
    agrees_ = false;
  }

  Robot robot_;
  Log log_;
  std::vector<double> at_s_;
  double cost_ = 0.0, expected_ = 0.0, best_cost_ = 0.0;
  std::vector<DiscreteFault> best_;
  bool agrees_ = false;
};

}  // namespace

DiscreteSearch find_discrete_faults(Robot& robot, Log& log) {
  DiscreteSearch search;
  const Trial as_given = try_map(robot, log, {}, kAllStarts);
  search.cost_before = search.cost_after = as_given.cost;
  if (as_given.agrees || !as_given.surprises) return search;
  Trials trials(robot, log);
  const Trials as_read = trials;
  while (static_cast<int>(search.faults.size()) < kMostFaults && !trials.agrees()) {
    trials.consider_single();
    if (!trials.found()) break;
    trials.take(search.faults);
  }
  if (!trials.agrees() && as_read.may_hold_two()) {
    Trials pairs = as_read;
    pairs.consider_pairs();
    if (pairs.found() && pairs.agrees()) {
      search.faults.clear();
      pairs.take(search.faults);
    }
  }
  for (const DiscreteFault& fault : search.faults) set_right(fault, robot, log);
  if (!search.faults.empty()) search.cost_after = try_map(robot, log, {}, 1).cost;
  return search;
}

}  // namespace cdprcal
