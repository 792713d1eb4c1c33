#include "cdprcal/diagnosis/discrete.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/diagnosis/fitted_faults.hpp"
#include "cdprcal/diagnosis/small_faults.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/evidence/model_average.hpp"
#include "cdprcal/motion/calibrate_in_motion.hpp"
#include "cdprcal/readings/lengths.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// A fault must lower the cost by this factor: the small effects never do. Or by the second one,
/// where it makes samples in motion agree.
constexpr double kOrdersOfMagnitude = 10.0, kMuch = 3.0;
/// One of the attitude must be more probable by this [nats], where nothing balances without it.
constexpr double kSure = 5.0;
/// Tensions that sway by more than this share of their level say little of where the platform is.
constexpr double kSteady = 0.3;
/// Nothing that hangs turns by more than this for long [rad].
constexpr double kMostTurning_rad = 0.5;
constexpr int kMostFaults = 6;
constexpr int kAllStarts = 8;
constexpr int kAllIterations = 50;
/// Rests that the trials look at, or samples where nothing says that the platform rests.
constexpr int kMostRests = 9, kMostSamples = 30;
/// Of the readings that count as they are read; what leaves out more of them proves nothing.
constexpr double kMostOfThem = 0.9;
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
      if (reversed) add_item(list, names[static_cast<std::size_t>(i)]);
    }
    out.push_back({fault, "sign", std::move(signs), before + list + after});
  }
}

/// A unit that readings come in, by its size in SI.
struct Unit {
  double factor;
  const char* name;
};
constexpr std::array kLengthUnits{Unit{1e-3, "millimetres"}, Unit{1e-2, "centimetres"},
                                  Unit{0.0254, "inches"}, Unit{0.3048, "feet"}};
constexpr double kKilogram_N = 9.80665, kPound_N = 4.4482216152605;
constexpr std::array kTensionUnits{Unit{kKilogram_N, "kgf"}, Unit{1e-3 * kKilogram_N, "gf"},
                                   Unit{kPound_N, "lbf"}, Unit{1e3, "kN"}};

DiscreteFault all_in(const Unit& unit, const char* fault, const std::string& sensors) {
  return {fault, "factor", {unit.factor}, sensors + unit.name};
}

DiscreteFault lengths_in(const Unit& unit) {
  return all_in(unit, "length_unit", "the lengths are in ");
}

/// One sensor of a kind that was set up otherwise than the others.
void add_one_in(const Unit& unit, const char* fault, const std::string& sensor, int cables,
                std::vector<DiscreteFault>& out) {
  constexpr double kOneOfThem = 0.1;
  for (int i = 0; i < cables; ++i) {
    std::vector<double> factors(static_cast<std::size_t>(cables), 1.0);
    factors[static_cast<std::size_t>(i)] = unit.factor;
    out.push_back({fault, "factor", std::move(factors),
                   sensor + std::to_string(i + 1) + " is in " + unit.name});
    out.back().prior *= kOneOfThem;
  }
}

/// Load cells most of whose readings are negative, as if cables pushed.
void add_reversed_load_cells(const Log& log, std::vector<DiscreteFault>& out) {
  std::string cables;
  std::vector<double> signs;
  for (Eigen::Index i = 0; i < log.tension_N.cols(); ++i) {
    const auto tension_N = log.tension_N.col(i).array();
    const bool reversed = (tension_N < 0.0).count() > (tension_N > 0.0).count();
    signs.push_back(reversed ? -1.0 : 1.0);
    if (reversed) add_item(cables, std::to_string(i + 1));
  }
  if (cables.empty()) return;
  out.push_back({"tension_sign", "sign", std::move(signs),
                 "the load cell of cable " + cables + " counts pulls as negative"});
}

/// `balanced`: tensions say something; otherwise the geometry of single samples alone.
CalibrateOptions options_for(bool balanced) {
  CalibrateOptions options;
  options.method = balanced ? Method::statics : Method::kinematic;
  options.noise = NoiseSource::specified;
  options.solve.max_iterations = kAllIterations;
  options.solve.explain = false;
  return options;
}

/// An order that a slip makes: two exchanged, or all counted from another one or the other way
/// round.
bool is_one_slip(const std::vector<double>& order) {
  const auto n = static_cast<int>(order.size());
  int moved = 0;
  bool shifted = true, reversed = true;
  for (int i = 0; i < n; ++i) {
    const int from = static_cast<int>(order[static_cast<std::size_t>(i)]) - 1;
    moved += from != i ? 1 : 0;
    shifted = shifted && (from - i + n) % n == (static_cast<int>(order[0]) - 1) % n;
    reversed = reversed && (from + i) % n == (static_cast<int>(order[0]) - 1) % n;
  }
  return moved == 2 || shifted || reversed;
}

/// What a calibration says of a map of the readings.
struct Trial {
  double cost = std::numeric_limits<double>::infinity();
  int readings = 0, spare = 0;  ///< what is left of them to check a map by
  std::optional<InitialPose> initial;
  double expected = 0.0;    ///< cost of a right map, with errors as specified
  bool agrees = false;      ///< a pose is found, and the residuals are within their sigma
  bool says_enough = true;  ///< not when the pose is left open: whatever fits then proves nothing
  bool surprises = true;    ///< residuals that chance would not make
};

Trial try_map(const Robot& robot, const Log& log, const std::vector<double>& at_s, int most_starts,
              int most_iterations = kAllIterations) {
  constexpr double kChance = 1e-3;
  CalibrateOptions options = options_for(log.tension_N.cols() > 0);
  options.solve.max_iterations = most_iterations;
  options.most_starts = most_starts;
  options.at_s = at_s;
  const CalibrationResult result = calibrate(robot, log, options).result;
  Trial out;
  if (std::isfinite(result.cost)) out.cost = result.cost;
  out.readings = result.residual_count;
  out.spare = result.residual_count - result.parameter_count;
  if (result.covariance && !result.poses.empty()) {
    out.initial = {result.poses.front(), *result.covariance};
  }
  out.expected = 0.5 * std::max(1, out.spare);
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
  return std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(1, count)));
}

/// Root mean square of what was read.
double mean_size(const LogMatrix& readings) {
  const auto read = readings.array().isFinite();
  return std::sqrt(read.select(readings.array().square(), 0.0).sum() /
                   static_cast<double>(std::max<Eigen::Index>(1, read.count())));
}

/// The columns of one matrix that differ in another.
LogMatrix columns_that_differ(const LogMatrix& readings, const LogMatrix& other) {
  std::vector<Eigen::Index> which;
  for (Eigen::Index c = 0; c < readings.cols(); ++c) {
    const auto read = readings.col(c).array().isFinite();
    if ((read && readings.col(c).array() != other.col(c).array()).any()) which.push_back(c);
  }
  return readings(Eigen::all, which);
}

/// Whether setting a fault right (a unit) shrinks readings until they say nothing: whatever fits
/// then proves nothing. Of load cells, until they show no load.
bool silences(const Robot& robot, const Log& before, const Log& after, double sigmas = 1.0) {
  const auto silenced = [&](const LogMatrix& was, const LogMatrix& is, double sigma,
                            double (*size)(const LogMatrix&)) {
    const double left = size(columns_that_differ(is, was));
    return left < 0.5 * size(columns_that_differ(was, is)) && !(left > sigmas * sigma);
  };
  return silenced(before.length_m, after.length_m, robot.sigma.length_m, &variation) ||
         silenced(before.swivel_rad, after.swivel_rad, robot.sigma.swivel_rad, &variation) ||
         silenced(before.roll_pitch_yaw_rad, after.roll_pitch_yaw_rad, robot.sigma.attitude_rad,
                  &variation) ||
         silenced(before.tension_N, after.tension_N, robot.sigma.tension_N, &mean_size);
}

/// Of a sensor that reads another unit than its like: with as many values as sensors, less than
/// agreement proves nothing.
bool is_of_one_sensor(const DiscreteFault& fault) { return fault.name.ends_with("_factor"); }
bool is_of_lengths(const DiscreteFault& fault) {
  return fault.parameter == "factor" && fault.name.starts_with("length");
}
/// Whether lengths would say nothing in the finest unit. Each of the coarser ones lets them
/// contradict less: one that agrees is it, and only if it leaves them several σ.
bool may_say_nothing(Robot robot, const Log& log) {
  Log in_finest = log;
  set_right(lengths_in(kLengthUnits.front()), robot, in_finest);
  return silences(robot, log, in_finest);
}
constexpr double kSeveral = 3.0;

/// Whether a unit makes angles smaller of which none turned too far.
bool shrinks_in_vain(const Log& before, const Log& after) {
  bool shrinks = false;
  for (const auto channel : {&Log::swivel_rad, &Log::roll_pitch_yaw_rad}) {
    const double was_rad = variation(before.*channel);
    if (!(variation(after.*channel) < was_rad)) continue;
    if (was_rad > kMostTurning_rad) return false;
    shrinks = true;
  }
  return shrinks;
}

/// Whether most lengths change by many times a robot's size: whatever the map, they are in another
/// unit. Spikes are few.
bool are_too_long(const Robot& robot, const Log& log) {
  constexpr double kTimes = 10.0;
  const LogMatrix* const lengths = read_lengths(log);
  if (lengths == nullptr) return false;
  std::vector<double> changes_m;
  for (const auto& column : lengths->colwise()) {
    std::vector<double> read_m;
    std::ranges::copy_if(column, std::back_inserter(read_m), [](double m) { return m == m; });
    if (read_m.empty()) continue;
    const double middle_m = median(read_m);
    for (const double m : read_m) changes_m.push_back(std::abs(m - middle_m));
  }
  return !changes_m.empty() && median(std::move(changes_m)) > kTimes * robot_size_m(robot);
}

/// Whether load cells say, beyond their noise, that cables push: no map of the others mends that.
bool push(const Robot& robot, const Log& log) {
  constexpr double kSigmas = 3.0;
  return std::ranges::any_of(log.tension_N.colwise(), [&](const auto& cell) {
    const auto read = cell.array().isFinite();
    const auto count = static_cast<double>(read.count());
    return read.select(cell.array(), 0.0).sum() < -kSigmas * robot.sigma.tension_N * count;
  });
}

/// The robot with sigma for single samples in motion: sensors as sharp as it takes to see that a
/// reading follows another motion than the platform's (a tenth of what they vary by) and no sharper
/// than they are, and tensions that tell no more than their level, which the motion sways.
Robot with_sigma_in_motion(const Robot& given, const Log& log) {
  constexpr double kShare = 0.1;
  const Signals signals = prepare(without_reading_faults(given), log, options_for(false)).signals;
  Robot robot = given;
  // What the platform does at its size moves the cables, locked winches or not.
  const double turn_rad = std::min(1.0, variation(log.roll_pitch_yaw_rad));
  const auto sharpen = [&](const LogMatrix& readings, Channel channel, double moved,
                           double& sigma) {
    if (readings.cols() == 0) return;
    const double noise = signals[static_cast<std::size_t>(channel)].sigma;
    sigma = std::min(sigma, std::max(kShare * std::max(variation(readings), moved), noise));
  };
  sharpen(log.length_m, Channel::length, turn_rad * characteristic_length_m(given),
          robot.sigma.length_m);
  sharpen(log.swivel_rad, Channel::swivel, 0.0, robot.sigma.swivel_rad);
  sharpen(log.roll_pitch_yaw_rad, Channel::roll_pitch, 0.0, robot.sigma.attitude_rad);
  robot.sigma.tension_N = std::max(
      {robot.sigma.tension_N, kShare * mean_size(log.tension_N), variation(log.tension_N)});
  return robot;
}

/// A log of a few rows, each the mean over a rest, or a sample in motion where rests and load cells
/// are not to be had, spread over the run; and their times. Nothing when there are too few.
std::optional<Log> few_poses(const Robot& robot, const Log& log, bool at_rest,
                             std::vector<double>& at_s) {
  const CalibrateOptions options = options_for(at_rest);
  std::vector<Measurement> poses =
      prepare(without_reading_faults(robot), log, options).problem.measurements;
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
  if (!fault.swivel_order.empty()) {
    listed.parameters.push_back({"swivel_order", fault.swivel_order});
  }
  return listed;
}

void set_right(const DiscreteFault& fault, Robot& robot, Log& log) {
  if (fault.convention) {
    robot.euler_convention = *fault.convention;
  } else {
    set_right(as_listed(fault), robot, log);
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
                   {},
                   convention});
  }
  add_signs("attitude_sign", {"roll", "pitch", "yaw"}, "the AHRS counts ", " backwards", out);
  for (DiscreteFault& fault : out) {
    // Nearly every AHRS reports heading, then pitch, then roll, whatever order the model was
    // written in. Axes that point down or backwards reverse two angles; one alone, or all three,
    // make no right-handed frame: that takes a slip in a program.
    if (fault.convention) {
      fault.prior = *fault.convention == EulerConvention::ZYX ? 0.1 : 0.01;
    } else {
      fault.prior = std::ranges::count(fault.values, -1.0) % 2 == 0 ? 0.01 : 0.001;
    }
  }
  return out;
}

std::vector<DiscreteFault> discrete_faults(const Robot& robot, const Log& log) {
  const int n = robot.cable_count();
  std::vector<DiscreteFault> out;
  std::vector<std::string> numbers;
  for (int i = 1; i <= n; ++i) numbers.push_back(std::to_string(i));
  if (read_lengths(log) != nullptr) {
    add_signs("length_sign", numbers, "the length of cable ", " counts backwards", out);
  }
  if (log.swivel_rad.cols() > 0) {
    add_signs("swivel_sign", numbers, "the swivel of cable ", " counts backwards", out);
  }
  std::vector<double> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 1.0);
  // The drives are in another order, or the encoders alone, or one kind of sensor alone.
  const std::vector<double> as_it_is = order;
  const auto add_order = [&](const std::vector<double>& wrong, const std::string& cables) {
    constexpr double kPartOfThem = 0.1, kScrambled = 0.03;
    const std::string in_another = cables + " are read in another order";
    const auto first = static_cast<std::ptrdiff_t>(out.size());
    out.push_back({"cable_order", "order", wrong, in_another});
    const auto first_half = first + 1;
    if (log.tension_N.cols() > 0) {
      out.push_back({"cable_order", "order", wrong,
                     "the length and swivel encoders of " + in_another + ", the load cells are not",
                     as_it_is});
      out.push_back({"cable_order", "order", as_it_is, "the load cells of " + in_another, wrong});
    }
    if (log.length_m.cols() > 0 && log.swivel_rad.cols() > 0) {
      out.push_back({"cable_order", "order", wrong, "the length encoders of " + in_another,
                     as_it_is, as_it_is});
      out.push_back({"cable_order", "order", as_it_is, "the swivel encoders of " + in_another,
                     as_it_is, wrong});
    }
    for (auto half = out.begin() + first_half; half != out.end(); ++half) {
      half->prior *= kPartOfThem;
    }
    if (is_one_slip(wrong)) return;
    for (auto fault = out.begin() + first; fault != out.end(); ++fault) fault->prior *= kScrambled;
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
  if (read_lengths(log) != nullptr) {
    for (const Unit& unit : kLengthUnits) {
      out.push_back(lengths_in(unit));
      add_one_in(unit, "length_factor", "the length of cable ", n, out);
    }
  }
  if (log.swivel_rad.cols() > 0) {
    add_one_in({kDegree, "degrees"}, "swivel_factor", "the swivel of cable ", n, out);
  }
  // values: factor of swivels, factor of attitude
  out.push_back({"angle_unit", "factor", {kDegree, 1.0}, "the swivel angles are in degrees"});
  out.push_back({"angle_unit", "factor", {1.0, kDegree}, "the attitude is in degrees"});
  out.push_back({"angle_unit", "factor", {kDegree, kDegree}, "all angles are in degrees"});
  if (log.tension_N.cols() > 0) {
    add_reversed_load_cells(log, out);
    for (const Unit& unit : kTensionUnits) {
      out.push_back(all_in(unit, "tension_unit", "the tensions are in "));
      add_one_in(unit, "tension_factor", "the load cell of cable ", n, out);
    }
  }
  const std::vector<DiscreteFault> of_attitude = attitude_faults(robot, log);
  out.insert(out.end(), of_attitude.begin(), of_attitude.end());
  return out;
}

namespace {

/// Of an order, which one: there are many. Of the others the text says all.
std::string in_numbers(const DiscreteFault& fault) {
  if (fault.parameter != "order") return "";
  std::string list;
  for (const double channel : fault.values) add_item(list, printed("%.0f", channel), " ");
  return " (" + list + ")";
}

/// The trials of one log: faults set right in a few of its poses.
class Trials {
 public:
  /// `moving`: of samples in motion though there are load cells.
  Trials(const Robot& robot, const Log& log, bool moving)
      : robot_(moving ? with_sigma_in_motion(robot, log) : robot), log_(log) {
    if (moving) moving_ = log;
    if (moving && variation(log.tension_N) > kSteady * mean_size(log.tension_N)) {
      log_.tension_N.resize(log.time_s.size(), 0);
    }
    const bool at_rest = !moving && log.tension_N.cols() > 0;
    // Hundreds of trials: a few of the poses tell a wrong map as well as all of them do.
    std::optional<Log> brief = few_poses(robot, log_, at_rest, at_s_);
    if (!brief && at_rest) brief = few_poses(robot, log_, false, at_s_);  // it never rests
    if (brief) log_ = *std::move(brief);
    const Trial as_read = try_map(robot_, log_, at_s_, kAllStarts);
    cost_ = as_read.cost;
    readings_ = as_read.readings;
    expected_ = as_read.expected;
    agrees_ = as_read.agrees || !as_read.surprises;
  }

  void consider_single() {
    forget();
    std::vector<Faults> singles;
    for (DiscreteFault& fault : discrete_faults(robot_, log_)) {
      singles.push_back({std::move(fault)});
    }
    consider_likeliest(singles, [](std::size_t) { return true; });
    if (moving_) return;
    // With values as free as these, less than agreement proves nothing.
    const auto agrees = [&](const DiscreteFault& fault) {
      Robot robot = robot_;
      Log log = log_;
      set_right(fault, robot, log);
      return try_map(robot, log, at_s_, kAllStarts).agrees;
    };
    const CalibrateOptions options = options_for(log_.tension_N.cols() > 0);
    for (const DiscreteFault& fault : fitted_faults(robot_, log_, options, at_s_)) {
      if (agrees(fault) && outdoes_effects(fault)) consider({fault});
    }
  }
  /// Cables in another order, and signs beside: neither alone says much. False when `go_on` said
  /// so.
  bool consider_pairs(const GoOn& go_on) {
    constexpr std::size_t kBetweenWords = 200;
    forget();
    std::vector<DiscreteFault> orders, signs;
    for (const DiscreteFault& fault : discrete_faults(robot_, log_)) {
      if (fault.parameter == "order" && fault.swivel_order.empty()) orders.push_back(fault);
      if (fault.parameter == "sign") signs.push_back(fault);
    }
    if (orders.size() * signs.size() > kMostPairs) return true;
    std::vector<Faults> pairs;
    for (const DiscreteFault& order : orders) {
      for (const DiscreteFault& sign : signs) pairs.push_back({sign, order});
    }
    return consider_likeliest(pairs, [&](std::size_t tried) {
      return tried % kBetweenWords != 0 ||
             go_on("discrete faults: an order and signs together, " + std::to_string(tried) +
                   " of " + std::to_string(pairs.size()) + " tried");
    });
  }

  /// Whether the best considered helps a great deal: the small effects never do. Nor do they make
  /// a log in motion agree, whose sigma is coarse against them.
  [[nodiscard]] bool found() const {
    return best_cost_ * (moving_ && agrees_ ? kMuch : kOrdersOfMagnitude) < cost_;
  }
  /// Whether the best considered agrees and is more probable than none. Single samples share
  /// errors with their neighbours: half of them count.
  [[nodiscard]] bool is_more_probable() const {
    if (best_.empty() || !agrees_) return false;
    const double log_prior = surprise_of(best_cost_) - best_surprise_;
    return 0.5 * (surprise_of(cost_) - surprise_of(best_cost_)) + log_prior > kSure;
  }
  /// Whether there is room for two that help so much each: the small effects never need them.
  [[nodiscard]] bool may_hold_two() const {
    return cost_ > kOrdersOfMagnitude * kOrdersOfMagnitude * expected_;
  }
  /// Whether it makes the log agree; before any is considered: whether the log does.
  [[nodiscard]] bool agrees() const { return agrees_; }
  /// Faults of the attitude with which its geometry fits much better, the most probable first.
  [[nodiscard]] std::vector<DiscreteFault> likely_of_attitude() const {
    std::vector<std::pair<double, DiscreteFault>> likely;
    Log geometry = log_;
    geometry.tension_N.resize(log_.time_s.size(), 0);
    const double as_read = surprise_of(try_map(robot_, geometry, at_s_, kAllStarts).cost);
    for (const DiscreteFault& fault : attitude_faults(robot_, log_)) {
      Robot robot = robot_;
      Log log = geometry;
      set_right(fault, robot, log);
      const double surprise = surprise_of(try_map(robot, log, at_s_, kAllStarts).cost);
      const double log_posterior = as_read - surprise + std::log(fault.prior);
      if (log_posterior > kSure) likely.emplace_back(log_posterior, fault);
    }
    std::ranges::stable_sort(likely, std::ranges::greater(),
                             &std::pair<double, DiscreteFault>::first);
    std::vector<DiscreteFault> out;
    for (auto& [log_posterior, fault] : likely) out.push_back(std::move(fault));
    return out;
  }
  /// Sets the best right for good.
  void take(std::vector<DiscreteFault>& faults) {
    if (!best_.empty()) best_.front().rivals = rivals();
    for (const DiscreteFault& fault : best_) take(fault, faults);
    cost_ = best_cost_;
  }

 private:
  /// Of maps tried together.
  using Faults = std::vector<DiscreteFault>;

  /// Considers those of some that a few steps bring furthest down: the right map is among them, and
  /// of the others few need be followed to their minimum. `go_on` is told how many were looked at;
  /// false when it said so.
  template <class GoOnAt>
  bool consider_likeliest(const std::vector<Faults>& all, GoOnAt go_on) {
    constexpr std::size_t kMostFollowed = 60;
    constexpr int kFewSteps = 8;
    std::vector<std::pair<double, const Faults*>> likely;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (!go_on(k)) return false;
      if (const std::optional<Trial> sketch = trial_of(all[k], kFewSteps)) {
        likely.emplace_back(surprise_of(all[k], *sketch), &all[k]);
      }
    }
    std::ranges::stable_sort(likely, {}, &std::pair<double, const Faults*>::first);
    likely.resize(std::min(likely.size(), kMostFollowed));
    for (const auto& [surprise, faults] : likely) consider(*faults);
    return true;
  }
  /// (Of samples in motion σ is as large as the unit makes them.)
  [[nodiscard]] bool must_agree(const Faults& together) const {
    return !moving_ && is_of_lengths(together.front()) && may_say_nothing(robot_, log_);
  }
  /// Nothing where it says nothing of the map.
  [[nodiscard]] std::optional<Trial> trial_of(const Faults& together, int most_iterations) const {
    Robot robot = robot_;
    Log log = log_;
    for (const DiscreteFault& fault : together) set_right(fault, robot, log);
    if (moving_ && together.front().parameter == "factor") {  // other units, another sigma
      Robot scratch = robot_;
      Log moving = *moving_;
      set_right(together.front(), scratch, moving);
      if (shrinks_in_vain(*moving_, moving)) return std::nullopt;
      robot.sigma = with_sigma_in_motion(robot, moving).sigma;
    }
    const double sigmas = must_agree(together) ? kSeveral : 1.0;
    if (silences(robot, log_, log, sigmas) || push(robot, log)) return std::nullopt;
    // The right one comes down from the first start in a few steps, and leaves no readings out.
    Trial trial = try_map(robot, log, at_s_, 1, most_iterations);
    if (!trial.says_enough || trial.spare <= 0) return std::nullopt;
    if (trial.readings < kMostOfThem * readings_) return std::nullopt;
    return trial;
  }
  void consider(const Faults& together) {
    const std::optional<Trial> found = trial_of(together, kAllIterations);
    if (!found || !(found->cost < cost_)) return;
    const Trial& trial = *found;
    const bool one = std::ranges::any_of(together, is_of_one_sensor);
    if ((one || must_agree(together)) && !trial.agrees) return;
    const double surprise = surprise_of(together, trial);
    if (trial.agrees && trial.initial) {
      std::string text;
      for (const DiscreteFault& fault : together) add_item(text, fault.text, " and ");
      agreeing_.push_back({surprise, *trial.initial, text + in_numbers(together.back())});
    }
    if (!best_.empty() && surprise >= best_surprise_) return;
    best_ = together;
    best_surprise_ = surprise;
    best_cost_ = trial.cost;
    agrees_ = trial.agrees;
  }
  /// The poses as a model of errors of unknown size, a fault set right; nothing where none settles.
  [[nodiscard]] std::optional<DiagnosisModel> model_with(const DiscreteFault* fault) const {
    Robot robot = robot_;
    Log log = log_;
    if (fault != nullptr) set_right(*fault, robot, log);
    CalibrateOptions options = options_for(log.tension_N.cols() > 0);
    options.most_starts = kAllStarts;
    options.at_s = at_s_;
    DiagnosisModel model = model_of(calibrate(robot, log, options));
    start_noise(model, {});  // rows are rests: they have no ripple
    return fit_with_noise(model) ? std::optional(std::move(model)) : std::nullopt;
  }
  /// Whether a fault with values of its own explains more than effects do: a centre of mass that is
  /// far off tilts the platform as a wrong zero of the attitude would have it.
  [[nodiscard]] bool outdoes_effects(const DiscreteFault& fault) const {
    const std::optional<DiagnosisModel> as_read = model_with(nullptr), with = model_with(&fault);
    if (!as_read || !with) return true;
    Unfaulted without(*as_read);
    const double alone = EvidenceAgainst(*as_read).of(*with);
    return without.evidence_for(alone, without.with_best(*with)) + std::log(fault.prior) > 0.0;
  }
  void take(const DiscreteFault& fault, std::vector<DiscreteFault>& faults) {
    set_right(fault, robot_, log_);
    if (moving_) set_right(fault, robot_, *moving_);
    faults.push_back(fault);
  }
  /// What agrees about as well as the best, and has the initial pose elsewhere: a frame that looks
  /// the same from another side has cables that can be counted from there.
  [[nodiscard]] std::vector<std::string> rivals() const {
    constexpr double kAsWell = 3.0;  // nats, as everywhere
    constexpr double kElsewhere = 4.0;
    std::vector<std::string> out;
    const auto best = std::ranges::min_element(agreeing_, {}, &Agreeing::surprise);
    if (best == agreeing_.end() || best->surprise > best_surprise_) return out;
    for (const Agreeing& other : agreeing_) {
      if (&other == &*best || other.surprise > best->surprise + kAsWell) continue;
      const Vector6 apart = minus(other.initial.pose, best->initial.pose).cwiseAbs();
      const Vector6 sigma = best->initial.covariance.diagonal().cwiseSqrt();
      if ((apart.array() > kElsewhere * sigma.array()).any()) out.push_back(other.text);
    }
    return out;
  }
  /// Minus the log-likelihood of errors of unknown size.
  [[nodiscard]] double surprise_of(double cost) const { return expected_ * std::log(cost); }
  /// With what was known of the faults before.
  [[nodiscard]] double surprise_of(const Faults& faults, const Trial& trial) const {
    double out = surprise_of(trial.cost);
    for (const DiscreteFault& fault : faults) out -= std::log(fault.prior);
    return out;
  }
  void forget() {
    best_.clear();
    agreeing_.clear();
    best_cost_ = cost_;
    agrees_ = false;
  }

  Robot robot_;
  Log log_;
  std::optional<Log> moving_;  ///< all of it, of single samples
  std::vector<double> at_s_;
  double cost_ = 0.0, expected_ = 0.0, best_cost_ = 0.0, best_surprise_ = 0.0;
  int readings_ = 0;  ///< in the cost
  struct Agreeing {
    double surprise;
    InitialPose initial;
    std::string text;
  };
  std::vector<Agreeing> agreeing_;
  std::vector<DiscreteFault> best_;
  bool agrees_ = false;
};

/// The unit of lengths that are too long as they are read; nothing where none makes them less so.
std::optional<DiscreteFault> likely_unit(Robot robot, const Log& log) {
  const bool must_agree = may_say_nothing(robot, log);
  std::optional<DiscreteFault> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Unit& unit : kLengthUnits) {
    const DiscreteFault fault = lengths_in(unit);
    Log in_metres = log;
    set_right(fault, robot, in_metres);
    const double sigmas = must_agree ? kSeveral : 1.0;
    if (are_too_long(robot, in_metres) || silences(robot, log, in_metres, sigmas)) continue;
    const Trial trial = try_map(robot, in_metres, {}, kAllStarts);
    if (must_agree && !trial.agrees) continue;
    if (!best || trial.cost < least) best = fault, least = trial.cost;
  }
  return best;
}

/// Whether poses misfit what load cells do not check by more than it scatters: exchanged or
/// reversed columns may hide in what σ allows.
bool may_hide_one(const Robot& robot, const Log& log) {
  if (log.tension_N.cols() > 0) return false;
  CalibrateOptions options = options_for(false);
  options.noise = NoiseSource::from_data;
  options.allow_for_effects = false;
  return !misfit(calibrate(robot, log, options)).empty();
}

/// Whether a log stands still often enough for rests to say what agrees.
bool rests(const Robot& robot, const Log& log) {
  constexpr int kFewRests = 2;
  return prepare(without_reading_faults(robot), log, options_for(true)).static_poses >= kFewRests;
}

/// How badly a log balances in motion.
struct MisfitInMotion {
  double of_one = 0.0;  ///< minus the log-likelihood of an error of unknown size in each channel
  double errors = 0.0;  ///< that are independent
};
/// Nothing where it does not balance.
std::optional<MisfitInMotion> misfit_in_motion(const Robot& robot, const Log& log) {
  InMotionOptions options = for_a_search();
  options.contradicted = options.calibrate.solve.explain = false;
  const InMotion found = calibrate_in_motion(robot, log, options);
  if (!found.in_motion) return std::nullopt;
  const CalibrationResult& result = found.calibration.result;
  double sum = 0.0;
  for (const double rms : {result.residual_rms.roll_pitch_rad, result.residual_rms.yaw_rad,
                           result.residual_rms.length_m, result.residual_rms.swivel_rad,
                           result.residual_rms.wrench_force_N}) {
    if (rms > 0.0) sum += std::log(rms);
  }
  return MisfitInMotion{sum, 2.0 * found.calibration.kinematic_poses / found.moments_a_reading};
}

/// Of the attitude: the one with which the log balances best in motion, where it does so much
/// better than as it is read.
std::optional<DiscreteFault> fault_of_balance(const Trials& trials, const Robot& robot,
                                              const Log& log) {
  const std::vector<DiscreteFault> likely = trials.likely_of_attitude();
  if (likely.empty()) return std::nullopt;
  const std::optional<MisfitInMotion> as_read = misfit_in_motion(robot, log);
  std::vector<std::pair<MisfitInMotion, DiscreteFault>> balancing;
  for (const DiscreteFault& fault : likely) {
    Robot other = robot;
    Log read = log;
    set_right(fault, other, read);
    if (const auto misfit = misfit_in_motion(other, read)) balancing.emplace_back(*misfit, fault);
  }
  if (balancing.empty()) return std::nullopt;
  // What hangs together where a fault is not set right does so for that reason: the same readings
  // are as many in all.
  double errors = as_read ? as_read->errors : std::numeric_limits<double>::infinity();
  for (const auto& [misfit, fault] : balancing) errors = std::min(errors, misfit.errors);
  const auto surprise = [&](const std::pair<MisfitInMotion, DiscreteFault>& one) {
    return errors * one.first.of_one - std::log(one.second.prior);
  };
  const auto best = std::ranges::min_element(balancing, {}, surprise);
  if (as_read && surprise(*best) + kSure > errors * as_read->of_one) return std::nullopt;
  return best->second;
}

}  // namespace

std::vector<DiscreteFault> find_discrete_faults(Robot& robot, Log& log, bool motion,
                                                const GoOn& go_on) {
  const bool moving = motion && !(log.tension_N.cols() > 0 && rests(robot, log));
  std::vector<DiscreteFault> faults;
  if (!go_on("discrete faults: signs, order, units, conventions")) return faults;
  if (are_too_long(robot, log)) {  // of which no fit says anything
    if (std::optional<DiscreteFault> unit = likely_unit(robot, log)) {
      set_right(*unit, robot, log);
      faults.push_back(*std::move(unit));
      if (!go_on("found: " + faults.back().text)) return faults;
    }
  }
  const std::size_t known = faults.size();
  bool contradicted = true;
  if (!moving) {
    const Trial as_given = try_map(robot, log, {}, kAllStarts);
    contradicted = !as_given.agrees && as_given.surprises;
    if (!contradicted && !may_hide_one(robot, log)) return faults;
  }
  Trials trials(robot, log, moving);
  const Trials as_read = trials;
  bool looking = !contradicted || !trials.agrees();
  while (static_cast<int>(faults.size()) < kMostFaults && looking) {
    trials.consider_single();
    if (!(contradicted ? trials.found() : trials.is_more_probable())) break;
    trials.take(faults);
    if (!go_on("found: " + faults.back().text)) break;
    looking = !trials.agrees();
  }
  if (!trials.agrees() && as_read.may_hold_two()) {
    Trials pairs = as_read;
    if (pairs.consider_pairs(go_on) && pairs.found() && pairs.agrees()) {
      faults.resize(known);
      pairs.take(faults);
      trials = std::move(pairs);
    }
  }
  for (std::size_t k = known; k < faults.size(); ++k) set_right(faults[k], robot, log);
  if (moving) {
    if (const std::optional<DiscreteFault> fault = fault_of_balance(trials, robot, log)) {
      set_right(*fault, robot, log);
      faults.push_back(*fault);
    }
  }
  return faults;
}

}  // namespace cdprcal
