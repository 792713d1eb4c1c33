#include <algorithm>
#include <chrono>

#include "cdprcal/frame/contradicted.hpp"
#include "cdprcal/frame/each_its_own.hpp"
#include "cdprcal/frame/minima.hpp"
#include "cdprcal/frame/poses.hpp"
#include "cdprcal/frame/solved.hpp"
#include "cdprcal/frame/start.hpp"
#include "cdprcal/frame/unknowns.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace detail {
namespace {

constexpr double kLeastSigma_m = 1e-6;
/// A pulley known to less than this share of the frame is not known.
constexpr double kKnown = 0.1;
/// A direction is weak that is known no better than so many times the noise of one length; a
/// millimetre is enough for anybody.
constexpr double kEnough = 5.0, kLeastEnough_m = 1e-3;
constexpr int kMostPasses = 5;
/// A compliance is told where it is so many σ from none: 95 %.
constexpr double kTold = 2.0;

Estimate estimate(const Solved& s, int column) {
  return {s.state.values[column], std::sqrt(std::max(0.0, s.known.covariance(column, column)))};
}

/// Mean of what the tensions hold up at rest.
std::optional<Estimate> weight(const Solved& s) {
  const Robot robot = moved(s.problem, s.state.values);
  std::vector<double> held;
  for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
    const CableVector& tension = s.problem.poses[i].reading.tension_N;
    if (tension.size() != s.problem.unknowns.cables || !tension.allFinite()) continue;
    const PlatformState state = platform_state(robot, s.state.poses[i]);
    double sum = 0.0;
    for (int c = 0; c < tension.size(); ++c) {
      sum -= tension[c] * state.cable[static_cast<std::size_t>(c)].direction.z();
    }
    held.push_back(sum);
  }
  const double level = std::abs(robot.platform.motion_plane_normal.z());
  if (held.empty() || level > 0.5) return std::nullopt;  // a lying plane shows no weight
  const auto count = static_cast<double>(held.size());
  const Eigen::Map<const Eigen::VectorXd> values(held.data(), static_cast<Eigen::Index>(count));
  const double mean = values.mean();
  const double spread = count > 1.0 ? (values.array() - mean).square().sum() / (count - 1.0) : kNaN;
  return Estimate{mean, std::sqrt(spread / count)};
}

/// At how many poses no pull of the cables holds the platform: it is taken to be elsewhere. Where
/// closed forms have all poses at once, the mirror image is chosen by that.
std::size_t cables_push(const Solved& s) {
  if (is_closed_form(s.problem)) return 0;
  const Robot robot = moved(s.problem, s.state.values);
  return static_cast<std::size_t>(
      std::count_if(s.state.poses.begin(), s.state.poses.end(),
                    [&](const Pose& pose) { return unheld_share(robot, pose) > kUnheld; }));
}

/// Everything that a solved problem says about the frame.
void fill_anchors(const Solved& s, FrameResult& out) {
  const FrameUnknowns& u = s.problem.unknowns;
  out.corrected = moved(s.problem, s.state.values);
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(3 * u.cables, u.size);
  for (int i = 0; i < u.cables; ++i) {
    for (int axis = 0; axis < u.axis_count; ++axis) {
      spread.block<3, 1>(3 * i, u.anchor(i, axis)) = u.axes.col(axis);
    }
  }
  out.covariance = spread * s.known.covariance * spread.transpose();
  for (int i = 0; i < u.cables; ++i) {
    Pulley& pulley = out.corrected.cables[static_cast<std::size_t>(i)].pulley;
    const Vector3 sigma = out.covariance.diagonal().segment<3>(3 * i).cwiseMax(0.0).cwiseSqrt();
    out.anchors_m.push_back(pulley.position_m);
    out.anchors_sigma_m.push_back(sigma);
    // What is not looked for stays known as it was; what a convention fixes is exact, but a file's
    // σ must be positive.
    Vector3 kept = Vector3::Zero();
    if (u.axis_count == 2 && !pulley.position_sigma_m.hasNaN()) {
      kept = u.axes.col(2).cwiseAbs().cwiseProduct(pulley.position_sigma_m);
    }
    pulley.position_sigma_m = (sigma + kept).cwiseMax(kLeastSigma_m);
  }
}

void fill_texts(const Solved& s, double enough_m, FrameResult& out) {
  const FrameUnknowns& u = s.problem.unknowns;
  out.gauge = gauge_in_words(s.problem, s.known, s.image);
  if (u.by_convention() || s.known.free_motions > 0) {
    out.not_determined.push_back(
        "where the frame is in the world and how it is turned, by convention: " + out.gauge);
  }
  if (u.scale < 0) {
    out.not_determined.push_back(
        "the scale of all lengths: readings that are 1 % too long make the frame 1 % larger; one "
        "distance between two pulleys by tape, or a tracker, settles it");
  }
  if (u.axis_count == 2) {
    out.not_determined.push_back(
        "how far each pulley is from the plane of motion: as the robot file has it");
  }
  for (std::string& text : weak_directions(s.problem, s.known, enough_m)) {
    out.not_determined.push_back(std::move(text));
  }
  for (std::string& text : stretched_repeats(s.problem)) {
    out.not_determined.push_back(std::move(text));
  }
  out.next = further_poses(s.problem, s.state, s.known);
}

/// What the file says of each cable by an effect of this name.
CableVector said_by_file(const Robot& robot, const std::string& effect) {
  CableVector out = CableVector::Zero(robot.cable_count());
  for (const AppliedEffect& said : robot.effects) {
    if (said.name != effect || !said.run.empty()) continue;
    const std::vector<double>& values = said.parameters.front().values;
    out += Eigen::Map<const Eigen::VectorXd>(values.data(), out.size());
  }
  return out;
}

constexpr const char* kOffset = "whole_length_offset";
/// What changes of length and whole lengths read too much by the metre, and by their tension.
constexpr const char *kRatio = "transmission_ratio", *kScale = "whole_length_scale";
constexpr const char *kElasticity = "cable_elasticity", *kStretch = "whole_length_stretch";

/// Adds `found`, one for all cables or one a cable, to what the robot file says by that effect.
void add_effect(const char* name, const char* parameter, const std::vector<Estimate>& found,
                Robot& robot) {
  if (found.empty()) return;
  CableVector sum = said_by_file(robot, name);
  for (int i = 0; i < sum.size(); ++i) {
    sum[i] += found[found.size() == 1 ? 0 : static_cast<std::size_t>(i)].value;
  }
  std::erase_if(robot.effects,
                [&](const AppliedEffect& e) { return e.name == name && e.run.empty(); });
  robot.effects.push_back({name, "", {{parameter, {sum.begin(), sum.end()}}}});
}

/// The stretch of whole lengths beside that which the file took off them already; that of winches,
/// of which nothing was taken off, where the file has none.
void add_stiffness(double stiffness_N, bool whole, Robot& robot) {
  const char* const name = whole ? kStretch : kElasticity;
  const auto is_said = [&](const AppliedEffect& e) { return e.name == name && e.run.empty(); };
  const auto said = std::ranges::find_if(robot.effects, is_said);
  if (said == robot.effects.end()) {
    robot.effects.push_back({name, "", {{"axial_stiffness_N", {stiffness_N}}}});
  } else if (whole) {
    double& sum_N = said->parameters.front().values.front();
    sum_N = 1.0 / (1.0 / sum_N + 1.0 / stiffness_N);
  }
}

/// By how much each cable's readings a metre differ from the mean of all; none where it is not
/// asked.
std::vector<Estimate> own_scales(const Solved& s) {
  const FrameUnknowns& u = s.problem.unknowns;
  const int at = u.own_column(Own::scale);
  std::vector<Estimate> out;
  for (int i = 0; at >= 0 && i < u.cables; ++i) {
    const Eigen::RowVectorXd row = u.contrasts.row(i);
    const auto block = s.known.covariance.block(at, at, u.cables - 1, u.cables - 1);
    out.push_back({u.own_value(s.state.values, Own::scale, i),
                   std::sqrt(std::max(0.0, (row * block * row.transpose())(0, 0)))});
  }
  return out;
}

/// Whole lengths, where any were read; else changes of length.
std::size_t length_channel(const Solved& s) {
  const bool whole = any_reading(s.problem.poses, -1, Channel::direct_length);
  return static_cast<std::size_t>(whole ? Channel::direct_length : Channel::length);
}

void fill(const Solved& s, FrameResult& out) {
  const FrameUnknowns& u = s.problem.unknowns;
  fill_anchors(s, out);
  for (int i = 0; i < u.direct_offset_count; ++i) {
    out.offset_m.push_back(estimate(s, u.direct_offsets + i));
  }
  add_effect(kOffset, "offset_m", out.offset_m, out.corrected);
  const bool whole = any_reading(s.problem.poses, -1, Channel::direct_length);
  const bool changes = any_reading(s.problem.poses, -1, Channel::length);
  const auto add_scale = [&](const std::vector<Estimate>& found) {
    if (whole) add_effect(kScale, "ratio_error", found, out.corrected);
    if (changes) add_effect(kRatio, "ratio_error", found, out.corrected);
  };
  out.own_scale = own_scales(s);
  add_scale(out.own_scale);
  if (u.scale >= 0) {
    out.scale = estimate(s, u.scale);
    add_scale({*out.scale});
  }
  if (u.compliance >= 0) {
    const Estimate k = estimate(s, u.compliance);
    const bool told = k.value > kTold * k.sigma;  // else it may as well be infinite
    out.stiffness_N = told ? Estimate{1.0 / k.value, k.sigma / (k.value * k.value)} : Estimate{};
    if (told && whole) add_stiffness(out.stiffness_N->value, true, out.corrected);
    if (told && changes) add_stiffness(out.stiffness_N->value, false, out.corrected);
  }
  if (u.off_plane >= 0) {
    const Estimate square = estimate(s, u.off_plane);
    const double distance = std::sqrt(std::max(square.value, 0.0));
    out.off_plane_m = Estimate{distance, square.sigma / (2.0 * distance)};
  }
  out.weight_N = weight(s);
  out.residual_m = length_residuals(s);
  out.rms_m = rms(out.residual_m);
  out.noise_m = s.problem.sigma[length_channel(s)];
  out.lack_of_fit = s.known.lack_of_fit;
  out.poses = s.state.poses;
  for (const FramePose& pose : s.problem.poses) out.measurements.push_back(pose.reading);
  out.iterations = s.state.iterations;
}

/// Noise that few readings tell is known badly itself: Student's quantiles in place of normal ones.
void widen_for_few(Solved& s) {
  constexpr double kBelow = 0.975;
  const double freedom = static_cast<double>(s.information.freedom.sum()) - s.known.parameters;
  if (!(freedom >= 1.0)) return;
  const double wider = student_quantile(kBelow, freedom) / normal_quantile(kBelow);
  s.known.covariance *= wider * wider;
}

/// Noise so far beyond the robot file's σ that no sensor has it; empty where it is not.
std::string beyond_any_noise(const Solved& s, double noise_m, std::size_t left_out) {
  constexpr double kTimes = 10.0, kMostLeftOut = 0.25;
  const double sigma_m = specified_sigma(s.problem.robot.sigma)[length_channel(s)];
  const auto mm = [](double m) { return std::to_string(std::lround(1e3 * m)) + " mm"; };
  if (noise_m > kTimes * sigma_m) {
    return "the lengths agree to " + mm(noise_m) + " only, and the robot file's sigma is " +
           mm(sigma_m) + ": check units, the order of the cables and their corners of the platform";
  }
  const auto all = static_cast<double>(left_out + s.problem.poses.size());
  if (static_cast<double>(left_out) > kMostLeftOut * all) {
    return std::to_string(left_out) + " of " + std::to_string(std::lround(all)) +
           " poses fit no frame that the others fit: check the order of the cables and the readings";
  }
  return "";
}

/// Which pulleys may as well be on the other side of all poses; empty where none may.
std::string sides_in_words(const Solved& s, double noise_m) {
  const FrameUnknowns& u = s.problem.unknowns;
  if (!row_of(s.problem.robot.platform.motion).is_point() || u.scale >= 0) return "";
  std::string pulleys;
  for (const int i : untold_sides(s.problem, s.state, noise_m)) {
    add_item(pulleys, std::to_string(i + 1));
  }
  if (pulleys.empty()) return "";
  const char* const where = u.axis_count == 2 ? "line" : "plane";
  return std::string("these poses do not determine the frame: they lie in one ") + where +
         ", and on which side of it pulley " + pulleys +
         " is they do not tell; add poses beside it, or give position_m to a quarter of the "
         "distance";
}

/// Which columns are exchanged, by the file's pulleys; empty where none are.
std::string order_in_words(const Solved& s) {
  if (!row_of(s.problem.robot.platform.motion).is_point()) return "";
  const auto pair = exchanged(s.problem, s.state);
  if (!pair) return "";
  const std::string first = std::to_string((*pair)[0] + 1), other = std::to_string((*pair)[1] + 1);
  return "pulleys " + first + " and " + other +
         " stand as the robot file has them when they change places: check the order of the "
         "columns, or correct their position_m";
}

/// How much farther apart two pulleys are in another frame that fits as well, beyond what `sigma_m`
/// says of a pulley; 0: none does. `problem`: with all poses, and noise as the residuals have it.
double alike_m(const FrameProblem& problem, const Minima& found, double sigma_m,
               int max_iterations) {
  constexpr double kAlike = 3.0;   // nat, as for all evidence here
  constexpr double kSigmas = 2.0;  // of another minimum: a normal error has one alone
  double most = 0.0;
  FrameState best = found.each.front();
  minimise(problem, best, max_iterations);
  for (std::size_t k = 1; k < found.each.size(); ++k) {
    FrameState other = found.each[k];
    minimise(problem, other, max_iterations);
    if (!(other.cost - best.cost < kAlike)) continue;
    const double apart = apart_m(problem, best, other);
    if (apart > kSigmas * sigma_m) most = std::max(most, apart);
  }
  return most;
}

/// What else makes pulleys seem to be elsewhere.
std::string looks_so_too(const FrameUnknowns& u) {
  std::string others;
  const auto add = [&](const char* what) { add_item(others, what, " or "); };
  if (u.direct_offset_count == 1) add("an offset of each length's own (--offset each)");
  if (u.own_column(Own::scale) < 0) add("a scale of each length's own (--scale each)");
  if (u.scale >= 0) add("a tracker that measures another point, or in another world,");
  add("columns in another order");
  return "; " + others + " looks so, too";
}

/// Whether the frame can be trusted, and why not. `all`: the problem with all poses.
void judge(const Solved& s, const FrameProblem& all, const Minima& found, int max_iterations,
           FrameResult& out) {
  const double freedom = static_cast<double>(s.information.freedom.sum());
  const double worst = out.covariance.diagonal().cwiseMax(0.0).cwiseSqrt().maxCoeff();
  if (freedom < s.known.parameters + 1.0) {
    out.status = FrameStatus::unobservable;
    out.reason = "these poses do not determine the frame: they hold no more readings than unknowns";
    if (s.information.freedom.maxCoeff() <= 0) {
      out.reason +=
          ", and no further pose would add one: its readings are as many as its own coordinates; "
          "a tracker, or one more cable or sensor, would";
    }
  } else if (!(worst < kKnown * robot_size_m(out.corrected))) {
    out.status = FrameStatus::unobservable;
    out.reason = "these poses do not determine the frame: a pulley is known to " +
                 std::to_string(std::lround(std::min(1e5, 1e3 * worst))) + " mm only";
  } else if (const std::string sides = sides_in_words(s, out.noise_m); !sides.empty()) {
    out.status = FrameStatus::unobservable;
    out.reason = sides;
  } else if (!s.state.settled) {
    out.reason =
        "the steps did not settle: check the units and the order of the columns, or give better "
        "position_m";
  } else if (const std::string order = order_in_words(s); !order.empty()) {
    out.reason = order;
  } else if (const double apart = alike_m(all, found, worst, max_iterations); apart > 0.0) {
    out.status = FrameStatus::unobservable;
    out.reason = "these poses do not determine the frame: another one, with two pulleys " +
                 std::to_string(std::lround(1e3 * apart)) +
                 " mm closer or farther apart, fits as well; add readings of the attitude, or give "
                 "position_m and position_sigma_m of more pulleys";
  } else if (!found.is_sure()) {
    out.reason = std::to_string(found.starts) + " frames that the robot file allows end in " +
                 std::to_string(found.each.size()) +
                 " different ones, and a better one may be missing: give better position_m, or add "
                 "readings of the attitude";
  } else if (const auto pushed = cables_push(s); pushed > 0) {
    out.reason = "at " + std::to_string(pushed) + " of " + std::to_string(s.state.poses.size()) +
                 " poses the cables would have to push: give pulleys better position_m, or more "
                 "readings";
  } else if (const auto wrong = contradicted(s, max_iterations); !wrong.empty()) {
    out.reason = in_words(wrong, robot_size_m(s.problem.robot)) + looks_so_too(s.problem.unknowns);
  } else if (const std::string why = beyond_any_noise(s, out.noise_m, out.left_out.size());
             !why.empty()) {
    out.reason = why;
  } else {
    out.held_out_rms_m = held_out_rms(s, max_iterations);
    out.status = FrameStatus::converged;
    out.reason = "the lengths at " + std::to_string(s.problem.poses.size()) + " poses agree";
  }
}

/// Where readings agree far better than the robot file's σ say, frames that fitted alike by these
/// do not by the noise that was found: the best is looked for again, until that is no less.
void search_again(Solved& s, Minima& found, int max_iterations) {
  constexpr double kFarLess = 0.5;  // of the noise
  constexpr int kMostTimes = 3;
  ChannelSigma before = specified_sigma(s.problem.robot.sigma);
  for (int k = 0; k < kMostTimes && found.drawn && s.known.valid; ++k) {
    const ChannelSigma& now = s.problem.sigma;
    if (std::ranges::equal(now, before, [](double a, double b) { return !(a < kFarLess * b); })) {
      return;
    }
    before = now;
    std::vector<FrameState> begin = std::move(found.each);
    begin.push_back(s.state);
    for (FrameState& state : begin) state.cost = frame_cost(s.problem, state);
    found = minima(s.problem, std::move(begin), true, max_iterations);
    if (found.each.empty()) return;
    s.state = found.each.front();
    solve(s, max_iterations);
  }
}

void solve_frame(const Robot& robot, FramePoseSet set, const FrameOptions& options,
                 FrameResult& out) {
  Solved s;
  s.problem.robot = robot;
  s.problem.ratio = said_by_file(robot, kRatio);
  s.problem.poses = std::move(set.poses);
  s.problem.unknowns = unknowns_of(robot, s.problem.poses, set.logs, options);
  s.problem.sigma = specified_sigma(robot.sigma);
  s.problem.basis = motion_basis(robot);
  const bool guessed = !set.guess.empty();
  Minima found = minima(s.problem, guessed ? starts_at(s.problem, set.guess) : starts(s.problem),
                        !guessed, options.max_iterations);
  if (found.each.empty()) {
    out.reason = "no start fits the readings: check units and the order of the cables";
    return;
  }
  s.state = found.each.front();
  FrameProblem all = s.problem;
  solve(s, options.max_iterations);
  search_again(s, found, options.max_iterations);
  const FrameUnknowns& u = s.problem.unknowns;
  if (s.known.valid && row_of(robot.platform.motion).is_point() && u.scale < 0) {
    choose_sides(s.problem, s.state, s.problem.sigma[length_channel(s)], options.max_iterations);
    s.image = choose_image(s.problem, s.state, options.max_iterations);
    solve(s, options.max_iterations);
  }
  for (int pass = 0; pass < kMostPasses && options.leave_out && s.known.valid; ++pass) {
    const std::vector<LeftOutPose> more = leave_out(s);
    if (more.empty()) break;
    out.left_out.insert(out.left_out.end(), more.begin(), more.end());
    solve(s, options.max_iterations);
  }
  if (s.known.valid && options.off_plane && row_of(robot.platform.motion).is_planar()) {
    try_off_plane(s, options.max_iterations);
  }
  if (!s.known.valid) {
    out.reason = "the readings fit no frame: check units and the order of the cables";
    return;
  }
  widen_for_few(s);
  hold_unshown(s.problem, s.known, s.state);
  all.sigma = s.problem.sigma;
  all.untold_stretch = s.problem.untold_stretch;
  std::vector<std::string> each_its_own = allow_for_own(options, s);
  fill(s, out);
  fill_texts(s, std::max(kEnough * out.noise_m, kLeastEnough_m), out);
  judge(s, all, found, options.max_iterations, out);
  out.next.insert(out.next.begin(), std::make_move_iterator(each_its_own.begin()),
                  std::make_move_iterator(each_its_own.end()));
}

}  // namespace
}  // namespace detail

FrameResult find_frame(const Robot& robot, const std::vector<Log>& logs,
                       const FrameOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  FrameResult out;
  out.corrected = robot;
  finalise(out.corrected);
  detail::solve_frame(out.corrected, detail::frame_poses(out.corrected, logs, options), options,
                      out);
  out.solve_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return out;
}

}  // namespace cdprcal
