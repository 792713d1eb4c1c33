#include <Eigen/QR>
#include <algorithm>
#include <chrono>

#include "cdprcal/frame/determined.hpp"
#include "cdprcal/frame/poses.hpp"
#include "cdprcal/frame/start.hpp"
#include "cdprcal/model/yardstick.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace detail {
namespace {

/// How well a pulley's place is known where the file does not say [m]: as well as a tape measures
/// on irma4, whose frame it grows with.
constexpr double kTape_m = 0.002;
/// Where no pulley of the file says: to a decimetre, on bodies. Points need no guess.
constexpr double kDecimetre_m = 0.1;
/// As a share of the robot's size: a position known no better is not known.
constexpr double kUnknown = 0.25;
/// Starts that are solved to the end: the best few.
constexpr std::size_t kMostSolved = 3;
/// Of all poses together: chance that one that belongs is left out.
constexpr double kFalseAlarm = 0.01;
constexpr int kNoiseRounds = 4;
constexpr int kFolds = 5;
/// Tensions tell a stiffness where they differ by this share of their mean.
constexpr double kTensionSpread = 0.1;
/// Evidence from which on belts are said to run outside the plane [nat], as everywhere here.
constexpr double kEvidence = 3.0;

bool any_reading(const std::vector<FramePose>& poses, int log, const Sensor& sensor, int from = 0,
                 int count = kMaxCables) {
  return std::any_of(poses.begin(), poses.end(), [&](const FramePose& pose) {
    if (log >= 0 && pose.log != log) return false;
    Measurement reading = pose.reading;
    const std::span<double> read = readings_of(reading, sensor);
    for (int i = from; i < std::min(from + count, static_cast<int>(read.size())); ++i) {
      if (std::isfinite(read[static_cast<std::size_t>(i)])) return true;
    }
    return false;
  });
}
const Sensor& sensor_of(Channel channel) { return row_of(channel).of(); }

/// Axes along which pulleys are looked for: the first from pulley 1 to 2, the second towards 3.
Matrix3 unknown_axes(const Robot& robot) {
  const auto place = [&](std::size_t i) -> Vector3 {
    return i < robot.cables.size() ? robot.cables[i].pulley.position_m : Vector3::Zero();
  };
  const bool planar = row_of(robot.platform.motion).is_planar();
  Vector3 normal = planar ? robot.platform.motion_plane_normal
                          : Vector3((place(1) - place(0)).cross(place(2) - place(0)));
  if (!(normal.norm() > 1e-9)) normal = (place(1) - place(0)).norm() > 1e-9
                                            ? Vector3((place(1) - place(0)).unitOrthogonal())
                                            : Vector3::UnitZ();
  normal.normalize();
  Vector3 first = place(1) - place(0);
  first -= first.dot(normal) * normal;
  if (!(first.norm() > 1e-9)) first = normal.unitOrthogonal();
  Matrix3 axes;
  axes.col(0) = first.normalized();
  axes.col(1) = normal.cross(axes.col(0));
  axes.col(2) = normal;
  // A plane's normal may point either way: the file's third pulley is on the positive side.
  const double side = axes.col(1).dot(place(2) - place(0));
  if (side < 0.0 && planar) axes.col(1) *= -1.0;
  return axes;
}

bool tells_stiffness(const std::vector<FramePose>& poses) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (const FramePose& pose : poses) {
    for (const double tension : pose.reading.tension_N) {
      if (!std::isfinite(tension)) continue;
      sum += tension;
      squares += tension * tension;
      count += 1.0;
    }
  }
  const double mean = sum / count;
  return count > 2.0 && squares / count - mean * mean > std::pow(kTensionSpread * mean, 2.0);
}

/// What is unknown, and what is known of it beforehand.
FrameUnknowns unknowns_of(const Robot& robot, const std::vector<FramePose>& poses, int logs,
                          const FrameOptions& options) {
  FrameUnknowns u;
  const bool is_point = row_of(robot.platform.motion).is_point();
  u.cables = robot.cable_count();
  u.axis_count = row_of(robot.platform.motion).is_planar() ? 2 : 3;
  const bool tracked = any_reading(poses, -1, sensor_of(Channel::position));
  const bool fixed = is_point && !tracked;  // by a convention
  u.axes = fixed || u.axis_count == 2 ? unknown_axes(robot) : Matrix3(Matrix3::Identity());
  u.size = u.axis_count * u.cables;
  const auto add = [&](int count) {
    const int begin = u.size;
    u.size += count;
    return begin;
  };
  const bool whole = any_reading(poses, -1, sensor_of(Channel::direct_length));
  if (whole && options.offset != LengthOffset::none) {
    u.direct_offset_count = options.offset == LengthOffset::common ? 1 : u.cables;
    u.direct_offsets = add(u.direct_offset_count);
  }
  for (int log = 0; log < logs; ++log) {
    const auto offsets = [&](Channel channel, int count) {
      const ChannelRow& row = row_of(channel);
      const bool read = any_reading(poses, log, row.of(), row.first, row.count);
      return read ? add(count) : -1;
    };
    u.length_offsets.push_back(offsets(Channel::length, u.cables));
    u.swivel_offsets.push_back(offsets(Channel::swivel, u.cables));
    u.yaw_offset.push_back(offsets(Channel::yaw, 1));
  }
  if (tracked) u.scale = add(1);
  if (tells_stiffness(poses)) u.compliance = add(1);
  u.precision = Eigen::VectorXd::Zero(u.size);
  u.held.assign(static_cast<std::size_t>(u.size), false);
  const double size = robot_size_m(robot), grown = times_reference(Yardstick::frame, robot);
  const bool said = std::any_of(robot.cables.begin(), robot.cables.end(), [](const Cable& cable) {
    return !cable.pulley.position_sigma_m.hasNaN();
  });
  for (int i = 0; i < u.cables; ++i) {
    const Vector3& sigma = robot.cables[static_cast<std::size_t>(i)].pulley.position_sigma_m;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      double own = sigma.cwiseProduct(u.axes.col(axis)).norm();
      if (sigma.hasNaN()) own = grown * (said ? kTape_m : kDecimetre_m);
      const bool unknown = own >= kUnknown * size || (is_point && !said);
      u.precision[u.anchor(i, axis)] = unknown && is_point ? 0.0 : 1.0 / (own * own);
    }
  }
  if (!fixed) return u;
  for (int i = 0; i < u.axis_count; ++i) {
    for (int axis = i; axis < u.axis_count; ++axis) {
      u.held[static_cast<std::size_t>(u.anchor(i, axis))] = true;
    }
  }
  return u;
}

ChannelSigma specified(const SensorSigma& sigma) {
  ChannelSigma out;
  out.fill(1.0);
  for (const ChannelRow& row : kChannelTable) {
    if (row.of().sigma) out[static_cast<std::size_t>(channel_of(row))] = sigma.*row.of().sigma;
  }
  return out;
}

/// Noise of each channel from what its rows leave over, their leverages counted.
void estimate_noise(FrameProblem& problem, const FrameInformation& information,
                    const Knowledge& known) {
  const Eigen::MatrixXd covariance =
      known.covariance / (known.lack_of_fit * known.lack_of_fit);
  ChannelSigma squares{}, freedom{};
  for (const FrameRows& rows : information.rows) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows.by_pose);
    qr.setThreshold(1e-7);
    const Eigen::Index size = rows.residual.size(), left = size - qr.rank();
    const Eigen::MatrixXd q = qr.householderQ();
    const Eigen::MatrixXd free = q.rightCols(left);
    const Eigen::MatrixXd common = free.transpose() * rows.by_common;
    const Eigen::MatrixXd own =
        free * (Eigen::MatrixXd::Identity(left, left) - common * covariance * common.transpose()) *
        free.transpose();
    for (Eigen::Index row = 0; row < size; ++row) {
      const auto channel = static_cast<std::size_t>(rows.channel[static_cast<std::size_t>(row)]);
      squares[channel] += rows.residual[row] * rows.residual[row];
      freedom[channel] += std::max(0.0, own(row, row));
    }
  }
  for (std::size_t channel = 0; channel < squares.size(); ++channel) {
    if (freedom[channel] < 1.0) continue;
    problem.sigma[channel] *= std::sqrt(std::max(squares[channel] / freedom[channel], 1e-12));
  }
}

/// One problem solved: state, what is known, noise.
struct Solved {
  FrameProblem problem;
  FrameState state;
  FrameInformation information;
  Knowledge known;
};

/// The minimum from where the state is, noise from its residuals.
void solve(Solved& s, int max_iterations) {
  for (int round = 0; round < kNoiseRounds; ++round) {
    minimise(s.problem, s.state, max_iterations);
    if (!std::isfinite(s.state.cost)) return;
    s.information = information(s.problem, s.state);
    s.known = knowledge(s.problem, s.information);
    if (!s.known.valid) return;
    if (round + 1 < kNoiseRounds) {
      estimate_noise(s.problem, s.information, s.known);
      s.information = information(s.problem, s.state);
      s.known = knowledge(s.problem, s.information);
    }
  }
}

/// By which reading of one cable a pose that does not fit is off, where one alone explains it.
LeftOutPose suspect(const Solved& s, std::size_t index) {
  const FramePose& pose = s.problem.poses[index];
  LeftOutPose out{pose.log, pose.sample, -1, kNaN};
  const Robot robot = moved(s.problem, s.state.values);
  double least = kNaN;
  int fitting = 0;
  for (int cable = 0; cable < s.problem.unknowns.cables; ++cable) {
    FramePose without = pose;
    double read = kNaN;
    for (const Channel channel : {Channel::direct_length, Channel::length}) {
      const std::span<double> all = readings_of(without.reading, sensor_of(channel));
      if (static_cast<int>(all.size()) <= cable) continue;
      double& own = all[static_cast<std::size_t>(cable)];
      if (!std::isfinite(own)) continue;
      if (std::isnan(read)) read = own;
      own = kNaN;
    }
    Pose at = s.state.poses[index];
    const double cost = settle_pose(s.problem, robot, s.state.values, without, at);
    const FrameRows rows = frame_rows(s.problem, robot, s.state.values, without, at, false);
    const double freedom =
        static_cast<double>(rows.residual.size()) - static_cast<double>(s.problem.basis.cols());
    if (!(freedom >= 1.0) || chi_square_survival(2.0 * cost, freedom) < kFalseAlarm) continue;
    ++fitting;
    if (cost >= least) continue;
    least = cost;
    out.cable = cable;
    const FrameRows all = frame_rows(s.problem, robot, s.state.values, pose, at, false);
    for (std::size_t row = 0; row < all.channel.size(); ++row) {
      const bool length =
          all.channel[row] == Channel::direct_length || all.channel[row] == Channel::length;
      if (!length || all.component[row] != cable) continue;
      out.error_m = -all.residual[static_cast<Eigen::Index>(row)] *
                    s.problem.sigma[static_cast<std::size_t>(all.channel[row])];
      break;
    }
  }
  if (fitting != 1) out.cable = -1;  // several would do: none is named
  if (out.cable < 0) out.error_m = kNaN;
  return out;
}

/// Leaves out poses whose misfit no pose in so many has by chance, beside the median of all.
std::vector<LeftOutPose> leave_out(Solved& s) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (s.information.freedom[at] < 1) continue;
    shares.push_back(s.information.misfit[at] /
                     chi_square_quantile(0.5, s.information.freedom[at]));
  }
  std::vector<LeftOutPose> out;
  if (shares.size() < 8) return out;
  const double level = std::max(median(shares), 1e-12);
  const double chance = kFalseAlarm / static_cast<double>(shares.size());
  std::vector<FramePose> poses;
  std::vector<Pose> states;
  for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const int freedom = s.information.freedom[at];
    const bool belongs =
        freedom < 1 || chi_square_survival(s.information.misfit[at] / level, freedom) > chance;
    if (belongs) {
      poses.push_back(s.problem.poses[i]);
      states.push_back(s.state.poses[i]);
    } else {
      out.push_back(suspect(s, i));
    }
  }
  s.problem.poses = std::move(poses);
  s.state.poses = std::move(states);
  return out;
}

bool is_length(Channel channel) {
  return channel == Channel::direct_length || channel == Channel::length;
}

/// Residuals of lengths in metres, one vector a pose.
std::vector<Eigen::VectorXd> length_residuals(const Solved& s) {
  std::vector<Eigen::VectorXd> out;
  for (const FrameRows& rows : s.information.rows) {
    Eigen::VectorXd own = Eigen::VectorXd::Constant(s.problem.unknowns.cables, kNaN);
    for (std::size_t row = 0; row < rows.channel.size(); ++row) {
      double& residual = own[rows.component[row] % s.problem.unknowns.cables];
      if (!is_length(rows.channel[row]) || std::isfinite(residual)) continue;
      residual = rows.residual[static_cast<Eigen::Index>(row)] *
                 s.problem.sigma[static_cast<std::size_t>(rows.channel[row])];
    }
    out.push_back(own);
  }
  return out;
}

double rms(const std::vector<Eigen::VectorXd>& residuals) {
  double sum = 0.0, count = 0.0;
  for (const Eigen::VectorXd& own : residuals) {
    for (const double value : own) {
      if (!std::isfinite(value)) continue;
      sum += value * value;
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

/// Rms of the lengths at poses that the frame was not fitted to: every fifth at a time.
double held_out_rms(const Solved& s, int max_iterations) {
  std::vector<Eigen::VectorXd> all;
  for (int fold = 0; fold < kFolds; ++fold) {
    Solved part{s.problem, s.state, {}, {}};
    part.problem.poses.clear();
    part.state.poses.clear();
    Solved rest = part;
    for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
      Solved& to = static_cast<int>(i) % kFolds == fold ? rest : part;
      to.problem.poses.push_back(s.problem.poses[i]);
      to.state.poses.push_back(s.state.poses[i]);
    }
    if (rest.problem.poses.empty() || part.problem.poses.empty()) return kNaN;
    minimise(part.problem, part.state, max_iterations);
    rest.state.values = part.state.values;
    const Robot robot = moved(rest.problem, rest.state.values);
    for (std::size_t i = 0; i < rest.problem.poses.size(); ++i) {
      settle_pose(rest.problem, robot, rest.state.values, rest.problem.poses[i],
                  rest.state.poses[i]);
    }
    rest.information = information(rest.problem, rest.state);
    if (!rest.information.valid) return kNaN;
    for (Eigen::VectorXd& own : length_residuals(rest)) all.push_back(std::move(own));
  }
  return rms(all);
}

/// Belts outside the plane at a common distance: the problem with one more unknown, where the
/// readings say so.
void try_off_plane(Solved& s, int max_iterations) {
  FrameUnknowns& u = s.problem.unknowns;
  Solved more = s;
  FrameUnknowns& with = more.problem.unknowns;
  with.off_plane = with.size++;
  with.precision.conservativeResize(with.size);
  with.precision[with.off_plane] = 0.0;
  with.held.push_back(false);
  more.state.values.conservativeResize(with.size);
  more.state.values[with.off_plane] = 0.0;
  minimise(more.problem, more.state, max_iterations);
  const double gain = s.state.cost - more.state.cost;
  // Residuals that hang together are worth fewer readings.
  const double evidence = gain / (s.known.lack_of_fit * s.known.lack_of_fit);
  if (!(evidence > kEvidence) || !(more.state.values[u.size] > 0.0)) return;
  solve(more, max_iterations);
  if (more.known.valid) s = std::move(more);
}

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
    // What a convention fixes is exact, but no file says so: σ of nothing is not positive.
    pulley.position_sigma_m = sigma.cwiseMax(1e-6);
  }
}

void fill_texts(const Solved& s, double enough_m, FrameResult& out) {
  const FrameUnknowns& u = s.problem.unknowns;
  out.gauge = gauge_in_words(s.problem, s.known);
  if (u.held[0] || s.known.free_motions > 0) {
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

void fill(const Solved& s, FrameResult& out) {
  const FrameUnknowns& u = s.problem.unknowns;
  fill_anchors(s, out);
  for (int i = 0; i < u.direct_offset_count; ++i) {
    out.offset_m.push_back(estimate(s, u.direct_offsets + i));
  }
  if (u.scale >= 0) out.scale = estimate(s, u.scale);
  if (u.compliance >= 0) {
    const Estimate k = estimate(s, u.compliance);
    out.stiffness_N = Estimate{1.0 / k.value, k.sigma / (k.value * k.value)};
  }
  if (u.off_plane >= 0) {
    const Estimate square = estimate(s, u.off_plane);
    const double distance = std::sqrt(std::max(square.value, 0.0));
    out.off_plane_m = Estimate{distance, square.sigma / (2.0 * distance)};
  }
  out.weight_N = weight(s);
  out.residual_m = length_residuals(s);
  out.rms_m = rms(out.residual_m);
  const bool whole = u.direct_offset_count > 0 ||
                     any_reading(s.problem.poses, -1, sensor_of(Channel::direct_length));
  out.noise_m = s.problem.sigma[static_cast<std::size_t>(whole ? Channel::direct_length
                                                               : Channel::length)];
  out.lack_of_fit = s.known.lack_of_fit;
  out.poses = s.state.poses;
  for (const FramePose& pose : s.problem.poses) out.measurements.push_back(pose.reading);
  out.iterations = s.state.iterations;
}

/// The best of the minima from several starts, the noise as specified.
bool solve_from_starts(Solved& s, std::vector<FrameState> begin, int max_iterations) {
  std::sort(begin.begin(), begin.end(), [](const FrameState& a, const FrameState& b) {
    return std::isfinite(a.cost) && !(b.cost <= a.cost);
  });
  double least = kNaN;
  for (std::size_t i = 0; i < std::min(begin.size(), kMostSolved); ++i) {
    if (!std::isfinite(begin[i].cost)) continue;
    minimise(s.problem, begin[i], max_iterations);
    if (!std::isfinite(begin[i].cost) || begin[i].cost >= least) continue;
    least = begin[i].cost;
    s.state = begin[i];
  }
  return std::isfinite(least);
}

}  // namespace

namespace {

void solve_frame(const Robot& robot, FramePoseSet set, const FrameOptions& options,
                 FrameResult& out) {
  Solved s;
  s.problem.robot = robot;
  s.problem.poses = std::move(set.poses);
  s.problem.unknowns = unknowns_of(robot, s.problem.poses, set.logs, options);
  s.problem.sigma = specified(robot.sigma);
  s.problem.basis = motion_basis(robot);
  std::vector<FrameState> begin;
  if (set.guess.empty()) {
    begin = starts(s.problem);
  } else {
    begin = starts_at(s.problem, set.guess);
  }
  if (!solve_from_starts(s, std::move(begin), options.max_iterations)) {
    out.reason = "no start fits the readings: check units and the order of the cables";
    return;
  }
  solve(s, options.max_iterations);
  for (int pass = 0; pass < 5 && options.leave_out && s.known.valid; ++pass) {
    const std::vector<LeftOutPose> more = leave_out(s);
    if (more.empty()) break;
    out.left_out.insert(out.left_out.end(), more.begin(), more.end());
    solve(s, options.max_iterations);
  }
  if (s.known.valid && options.off_plane && row_of(robot.platform.motion).is_planar()) {
    try_off_plane(s, options.max_iterations);
  }
  if (!s.known.valid || !s.state.settled) {
    out.reason = "the steps did not settle";
    return;
  }
  fill(s, out);
  const double freedom = s.information.freedom.sum();
  const double parameters = static_cast<double>(s.problem.unknowns.size);
  const double worst = out.covariance.diagonal().cwiseMax(0.0).cwiseSqrt().maxCoeff();
  const double size = robot_size_m(out.corrected);
  fill_texts(s, std::max(5.0 * out.noise_m, 1e-3), out);
  if (freedom < 0.5 * parameters || !(worst < 0.1 * size)) {
    out.status = FrameStatus::unobservable;
    out.reason = "these poses do not determine the frame: a pulley is known to " +
                 std::to_string(static_cast<int>(std::min(1e3 * worst, 1e6))) + " mm only";
    return;
  }
  out.held_out_rms_m = held_out_rms(s, options.max_iterations);
  out.status = FrameStatus::converged;
  out.reason = "the lengths at " + std::to_string(s.problem.poses.size()) + " poses agree";
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
