#include "cdprcal/motion/tracker.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/turn_over.hpp"
#include "cdprcal/statics/taut.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// A reading beyond this many σ of its innovation is left out.
constexpr double kOutlier = 6.0;
/// One that was left out for long agrees again within this many.
constexpr double kAgrees = 3.0;
/// More than this between samples, and counting may have been lost: as between segments of a log.
constexpr double kGap_s = 2.0;
/// A silence of so many samples and so long is one in which a platform that swings turns back.
constexpr double kSilent = 5.0, kSilent_s = 0.5;
/// Densities of jerk [m²/s⁵] that are believed: the least is that of a platform at rest, which may
/// begin to move at any time, the most one that starts to fall within 10 ms.
constexpr double kLeastJerk = 1e-2, kMostJerk = 1e4;
/// A platform whose state nobody knows moves about like this; one that begins to move, of a jerk
/// that is likely.
constexpr double kAnySpeed_m_s = 1.0, kAnyAcceleration_m_s2 = 10.0, kAnyJerk = 1e2,
                 kLikelyJerk = 1.0;
/// The share of the robot's size, and the angle [rad], from which on a pose is not determined.
constexpr double kVagueShift = 0.05, kVagueTurn = 0.2;
/// Sensors that are read in turn determine a pose together within this time.
constexpr double kSaidLately_s = 0.3;
constexpr int kMostIterations = 30;
/// Readings are held against one another as they are in the mean over a moment, and over longer
/// than a swing; not at every sample.
constexpr std::array<double, 2> kLately_s{0.1, 2.0};
constexpr double kCompare_s = 0.05;

/// One more value in a mean over the last so many, two at least.
void average(double value, double most, double& mean, double& count) {
  count = std::min(count + 1.0, std::max(2.0, most));
  mean += (value - mean) / count;
}

/// Of what was weighed; 0 where nothing was.
template <class Readings>
double median_size(Readings readings) {
  if (readings.empty()) return 0.0;
  const auto middle = readings.begin() + static_cast<std::ptrdiff_t>(readings.size() / 2);
  std::nth_element(readings.begin(), middle, readings.end(),
                   [](const auto& a, const auto& b) { return a.size < b.size; });
  return middle->size;
}

/// What drags along has turned over so far, in [−1, 1], after a step.
void turn_over(const CableVector& now, double distance, CableVector& at, CableVector& turned) {
  if (at.size() != now.size()) {
    turned.setZero(now.size());
  } else {
    for (Eigen::Index c = 0; c < now.size(); ++c) {
      turned[c] = turned_over(turned[c], now[c] - at[c], distance);
    }
  }
  at = now;
}

}  // namespace

Tracker::Tracker(const Calibration& calibration, double restless, std::optional<LateSensor> late,
                 const SensorTimes& ahead_s)
    : robot_(with_effects(calibration.problem.robot, calibration.problem.effects)),
      effects_(calibration.problem.effects),
      offsets_(known_offsets(calibration)),
      places_(calibration.problem.measurements),
      poses_(calibration.result.poses),
      free_(robot_),
      size_m_(robot_size_m(robot_)),
      turn_per_shift_(1.0 / characteristic_length_m(robot_)),
      taut_N_(taut_tension_N(robot_)),
      ahead_s_(ReadingVector::Zero(offsets_.offset.size())),
      jerk_(kLikelyJerk),
      restless_(restless),
      agreement_(offsets_, free_, size_m_),
      disagrees_(offsets_.rows.size()),
      disagreed_(offsets_.rows.size()),
      contradictions_(offsets_.rows.size()),
      lateness_(offsets_, free_),
      known_late_(late) {
  for (std::size_t r = 0; r < offsets_.rows.size(); ++r) {
    ahead_s_[static_cast<Eigen::Index>(r)] = ahead_s[offsets_.rows[r].label.channel];
  }
  by_rate_s_ = ahead_s_;
  if (!effects_.empty()) {
    allow_for_directions();
    agreement_ = Agreement(offsets_, free_, size_m_);
  }
  const ReadingVector root = offsets_.covariance.diagonal().cwiseSqrt().cwiseMax(1e-12);
  ReadingMatrix relative =
      root.cwiseInverse().asDiagonal() * offsets_.covariance * root.cwiseInverse().asDiagonal();
  relative.diagonal().array() += 1e-9;
  considered_ = root.cwiseInverse().asDiagonal() * ReadingMatrix(relative.inverse()) *
                root.cwiseInverse().asDiagonal();
}

/// What effects do to readings while the platform moves: how each depends on its rate; and
/// which way cables and swivels last went, which is hardly known while they turn over.
void Tracker::allow_for_directions() {
  const Pose& pose = poses_.front();
  const int n = robot_.cable_count();
  const auto misfit_with = [&](double direction) {
    Measurement m = places_.front();
    m.length_direction = m.swivel_direction = CableVector::Constant(n, direction);
    m.length_rate_m_s = m.swivel_rate_rad_s = CableVector::Zero(n);
    m.attitude_rate_rad_s.setZero();
    GeometricReadings out;
    evaluate(robot_, effects_, m, pose, out);
    return out.misfit;
  };
  const ReadingVector at = misfit_with(0.0), turned = misfit_with(1.0);
  const ReadingVector by_rate_s = by_own_rate(robot_, effects_, places_.front(), pose);
  for (Eigen::Index r = 0; r < offsets_.offset.size(); ++r) {
    if (offsets_.rows[static_cast<std::size_t>(r)].inertial) continue;
    const Eigen::Index reading = offsets_.rows[static_cast<std::size_t>(r)].reading;
    by_rate_s_[r] += by_rate_s[reading];
    const double more = turned[reading] - at[reading];
    if (std::isfinite(more)) offsets_.covariance(r, r) += more * more;
  }
}

/// What a held sensor says again is no new reading, nor is what one repeats to the last digit for
/// longer than chance would have it at rest: it is stuck.
void Tracker::leave_out_held() {
  const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  constexpr double kNever = 1e-9;  // of a column each 10 ms, once in months
  std::size_t s = 0;
  for_each_sensor(
      [&](const Sensor& sensor, auto& field, const auto& before) {
        std::vector<int>& repeated = repeated_[s++];
        const auto now = numbers(field);
        const auto last = numbers(before);
        const auto channels = channels_of(sensor);
        if (channels.empty() || now.size() != last.size()) return;
        const Channel channel = channel_of(channels.front());
        if (channel == Channel::balance) return;  // tells what is slack, and no more
        const auto c = static_cast<std::size_t>(channel);
        if (offsets_.is_held[c] && std::ranges::equal(now, last, same)) {
          std::ranges::fill(now, kNaN);
          return;
        }
        repeated.resize(now.size());
        for (std::size_t k = 0; k < now.size(); ++k) {
          repeated[k] = now[k] == last[k] ? repeated[k] + 1 : 0;
          if (std::pow(offsets_.repeats[c], repeated[k]) < kNever) now[k] = kNaN;
        }
      },
      sample_, read_);
}

/// Slack cables say nothing (as gate_slack() has it).
void Tracker::leave_out_slack() {
  for (Eigen::Index c = 0; c < sample_.tension_N.size(); ++c) {
    if (!(sample_.tension_N[c] < taut_N_)) continue;
    if (c < sample_.length_m.size()) sample_.length_m[c] = kNaN;
    if (c < sample_.swivel_rad.size()) sample_.swivel_rad[c] = kNaN;
  }
}

/// From nothing but the readings: near the pose nearest in time of those that are known.
void Tracker::start() {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < places_.size(); ++i) {
    const auto away_s = [&](std::size_t k) { return std::abs(places_[k].time_s - sample_.time_s); };
    if (away_s(i) < away_s(nearest)) nearest = i;
  }
  now_.state = {poses_[nearest]};
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(turn_per_shift_);
  const Matrix6 one = free_.of_square(scale.cwiseAbs2().asDiagonal());
  covariance_.setZero();
  covariance_.topLeftCorner<6, 6>() = size_m_ * size_m_ * one;
  covariance_.block<6, 6>(6, 6) = kAnySpeed_m_s * kAnySpeed_m_s * one;
  covariance_.block<6, 6>(12, 12) = kAnyAcceleration_m_s2 * kAnyAcceleration_m_s2 * one;
  shared_.setZero(kMotionUnknowns, offsets_.covariance.cols());
  if (!at_rest_) jerk_ = std::max(kLikelyJerk, kAnyJerk / restless_);
  lateness_.interrupt();
  forget();
  swivel_rad_.resize(0);
  length_m_.resize(0);
}

/// What readings said of late is of another motion.
void Tracker::forget() {
  lasting_.resize(0);
  lately_ = {};
  disagreed_.assign(disagreed_.size(), false);
  quarrels_ = false;
  compared_s_ = now_.time_s;
}

/// Whether the platform goes somewhere during a silence: on and on as it began to, it goes as far
/// as from where on a pose is not determined.
bool Tracker::goes_unseen(double silence_s) const {
  if (!(silence_s > kSilent_s)) return false;
  const Vector6 gone = silence_s * now_.state.twist.cwiseAbs() +
                       0.5 * silence_s * silence_s * now_.state.acceleration.cwiseAbs();
  return gone.head<3>().norm() > kVagueShift * size_m_ || gone.tail<3>().norm() > kVagueTurn;
}

void Tracker::predict() {
  const double dt_s = dt_s_;
  const MotionMatrix& f = step_.transition = transition(now_.state, dt_s);
  now_.state = moved(now_.state, dt_s);
  // All but the turns goes axis by axis.
  const auto go = [&](auto& rows) {
    const double half = 0.5 * dt_s * dt_s;
    rows.template topRows<3>() +=
        dt_s * rows.template middleRows<3>(6) + half * rows.template middleRows<3>(12);
    rows.template middleRows<3>(3) = (f.block<3, 3>(3, 3) * rows.template middleRows<3>(3) +
                                      f.block<3, 3>(3, 9) * rows.template middleRows<3>(9) +
                                      f.block<3, 3>(3, 15) * rows.template middleRows<3>(15))
                                         .eval();
    rows.template middleRows<6>(6) += dt_s * rows.template middleRows<6>(12);
  };
  go(covariance_);
  covariance_.transposeInPlace();
  go(covariance_);
  go(shared_);
  covariance_ += restless_ * jerk_ * of_jerk();
}

/// What jerk of unit density adds over the last step.
MotionMatrix Tracker::of_jerk() const {
  const Matrix3 q = jerk_covariance(dt_s_);
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(turn_per_shift_ * turn_per_shift_);
  const Matrix6 one = free_.of_square(scale.asDiagonal());
  MotionMatrix out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out.block<6, 6>(6 * r, 6 * c) = q(r, c) * one;
  }
  return out;
}

template <typename F>
void Tracker::over_seen(Eigen::Index row, const F& f) const {
  const RowLabel& label = offsets_.rows[static_cast<std::size_t>(row)].label;
  if (label.channel == Channel::specific_force) {
    f(std::integral_constant<int, kMotionUnknowns>());
  } else {
    f(std::integral_constant<int, kSeen>());
  }
}

double Tracker::misfit(Eigen::Index row) const {
  const KnownOffsets::Row& known = offsets_.rows[static_cast<std::size_t>(row)];
  if (known.inertial) return inertial_.misfit[known.reading] + offsets_.offset[row];
  double plain = readings_.misfit[known.reading] + offsets_.offset[row];
  if (!at_rest_ && ahead_s_[row] > 0.0) {
    plain += ahead_s_[row] * readings_.by_pose.row(known.reading).dot(now_.state.twist);
  }
  return known.angle ? wrap_angle(plain) : plain;
}

Tracker::ByState Tracker::by_state(Eigen::Index row) const {
  const KnownOffsets::Row& known = offsets_.rows[static_cast<std::size_t>(row)];
  if (known.inertial) return inertial_.by_state.row(known.reading);
  ByState out = ByState::Zero();
  out.head<6>() = readings_.by_pose.row(known.reading);
  if (!at_rest_) out.segment<6>(6) = by_rate_s_[row] * readings_.by_pose.row(known.reading);
  return out;
}

/// What the readings should be at the present state.
bool Tracker::evaluate_now() {
  if (!effects_.empty()) {
    sample_.length_direction = length_turn_;
    sample_.swivel_direction = swivel_turn_;
    if (readings_.model.valid && !at_rest_) {
      sample_.length_rate_m_s = readings_.model.length_by_twist * now_.state.twist;
      sample_.swivel_rate_rad_s = readings_.model.swivel_by_twist * now_.state.twist;
      sample_.attitude_rate_rad_s = readings_.model.attitude_by_twist * now_.state.twist;
    }
  }
  if (!offsets_.rows.empty() && offsets_.rows.back().inertial) {
    evaluate(robot_, sample_, now_.state, inertial_);
  }
  return evaluate(robot_, effects_, sample_, now_.state.pose, readings_);
}

/// A motion that begins surprises all readings, a spike one of them: the median tells them apart,
/// and where a channel of several is beyond belief as a whole, that does.
bool Tracker::surprised(const std::vector<Reading>& readings) const {
  constexpr double kMedian = 4.0, kWhole = 9.0;
  constexpr std::ptrdiff_t kFewest = 3;
  if (median_size(readings) > kMedian) return true;
  const auto channel = [&](const Reading& reading) {
    return offsets_.rows[static_cast<std::size_t>(reading.row)].label.channel;
  };
  for (auto begin = readings.begin(); begin != readings.end();) {
    const auto end = std::find_if(begin, readings.end(), [&](const Reading& other) {
      return channel(other) != channel(*begin);
    });
    const bool whole = std::all_of(begin, end, [](const Reading& r) { return r.size > kWhole; });
    if (whole && end - begin >= kFewest) return true;
    begin = end;
  }
  return false;
}

/// All readings of the sample, and how large each innovation is beside what is expected of it.
std::vector<Tracker::Reading> Tracker::weigh() const {
  std::vector<Reading> out;
  out.reserve(offsets_.rows.size());
  for (Eigen::Index row = 0; row < offsets_.offset.size(); ++row) {
    const double innovation = misfit(row);
    if (!std::isfinite(innovation) || disagrees_[static_cast<std::size_t>(row)]) continue;
    over_seen(row, [&](auto seen) {
      constexpr int k = decltype(seen)::value;
      const Eigen::Matrix<double, 1, k> h = by_state(row).template head<k>();
      const double by_motion = h * covariance_.topLeftCorner<k, k>() * h.transpose();
      const double expected = by_motion +
                              2.0 * h.dot(shared_.col(row).template head<k>().transpose()) +
                              offsets_.covariance(row, row) + offsets_.sample_variance[row];
      const ReadingVector together =
          shared_.template topRows<k>().transpose().lazyProduct(h.transpose());
      const double lasts = together.dot(considered_.lazyProduct(together));
      out.push_back({row, innovation * innovation / expected, innovation,
                     std::max(by_motion - lasts, 0.0) + offsets_.sample_variance[row]});
    });
  }
  return out;
}

/// Motion that begins along one direction may show in one reading alone. It does not contradict the
/// others as a spike does: where any motion explains all readings together, it is allowed for.
bool Tracker::quickens(const std::vector<Reading>& readings) {
  constexpr double kDoubt = 4.0, kMore = 4.0, kChance = 1e-3;
  std::vector<Reading> counting;
  counting.reserve(readings.size());
  bool any = false;
  for (const Reading& r : readings) {
    // What no motion explained at first none explains because it goes on for a while.
    if (contradictions_.against_s(static_cast<std::size_t>(r.row)) > 0.0) continue;
    counting.push_back(r);
    any = any || r.size > kDoubt * kDoubt;
  }
  if (!any) return false;
  const auto count = static_cast<Eigen::Index>(counting.size());
  const MotionMatrix jerk = of_jerk();
  ReadingMatrix expected(count, count), by_jerk(count, count);
  ReadingVector innovation(count);
  std::vector<ByState> by_state;
  for (const Reading& r : counting) by_state.push_back(this->by_state(r.row));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Reading& r = counting[static_cast<std::size_t>(i)];
    innovation[i] = r.innovation;
    const ByState& h = by_state[static_cast<std::size_t>(i)];
    const ByState hp = h * covariance_, hq = h * jerk;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::Index row = counting[static_cast<std::size_t>(k)].row;
      const ByState& g = by_state[static_cast<std::size_t>(k)];
      expected(i, k) = hp.dot(g) + h.dot(shared_.col(row).transpose()) +
                       g.dot(shared_.col(r.row).transpose()) + offsets_.covariance(r.row, row);
      by_jerk(i, k) = hq.dot(g);
    }
    expected(i, i) += offsets_.sample_variance[r.row];
  }
  const double most = chi_square_quantile(1.0 - kChance, static_cast<double>(count));
  for (double density = jerk_; density <= kMostJerk; density *= kMore) {
    const ReadingMatrix all = expected + (density - jerk_) * by_jerk;
    if (!(innovation.dot(all.ldlt().solve(innovation)) < most)) continue;
    if (density == jerk_) return false;
    covariance_ += (density - jerk_) * jerk;
    jerk_ = density;
    return true;
  }
  return false;
}

bool Tracker::correct() {
  now_.left_out = 0;
  innovation_.setConstant(offsets_.offset.size(), kNaN);
  if (!evaluate_now()) return false;
  disagrees_.assign(disagrees_.size(), false);
  std::vector<Reading> readings = weigh();
  for (const Reading& r : readings) innovation_[r.row] = r.size;
  if (!step_.starts) {
    leave_out_strangers(readings);
    constexpr double kMore = 4.0;
    while (surprised(readings) && jerk_ < kMostJerk) {
      covariance_ += (kMore - 1.0) * jerk_ * of_jerk();
      jerk_ *= kMore;
      readings = weigh();
    }
    if (quickens(readings)) readings = weigh();
    learn_jerk(readings);
  }
  for (const Reading& r : readings) innovation_[r.row] = r.size;
  now_.left_out += static_cast<int>(std::erase_if(readings, [&](const Reading& r) {
    return contradictions_.is_out(static_cast<std::size_t>(r.row)) ||
           (!step_.starts && r.size > largest(static_cast<std::size_t>(r.row)));
  }));
  return update(readings);
}

/// Up to which square of its innovation over σ a reading counts. Without it the pose is known less
/// and less: what has been an outlier is none again only where it agrees. (A restless smoother,
/// which starts from what is hardly known, follows everything.)
double Tracker::largest(std::size_t reading) const {
  const bool was_one = contradictions_.against_s(reading) > 0.0 && !(restless_ > 1.0);
  const double most = was_one ? kAgrees : kOutlier;
  return most * most;
}

/// The filter's correction, iterated where the readings are no straight lines over it.
bool Tracker::update(const std::vector<Reading>& readings) {
  const bool starts = step_.starts;
  const MotionState& before = step_.predicted = now_.state;
  const MotionMatrix& covariance = step_.predicted_covariance = covariance_;
  const Shared shared = shared_;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    if (iteration > 0) {
      if (!evaluate_now()) return false;
      covariance_ = covariance;
      shared_ = shared;
    }
    MotionVector from_before;
    from_before << minus(now_.state.pose, before.pose), now_.state.twist - before.twist,
        now_.state.acceleration - before.acceleration;
    MotionVector change = MotionVector::Zero();
    for (const Reading& reading : readings) {
      over_seen(reading.row, [&](auto seen) {
        constexpr int k = decltype(seen)::value;
        const Eigen::Matrix<double, 1, k> h = by_state(reading.row).template head<k>();
        const auto considered = offsets_.covariance.col(reading.row);
        const MotionVector ph =
            covariance_.leftCols<k>().lazyProduct(h.transpose()) + shared_.col(reading.row);
        const double expected = h.dot(ph.head<k>().transpose()) +
                                h.dot(shared_.col(reading.row).template head<k>().transpose()) +
                                considered[reading.row] + offsets_.sample_variance[reading.row];
        const double innovation =
            -misfit(reading.row) + h * (from_before.head<k>() - change.head<k>());
        const MotionVector gain = ph / expected;
        change += gain * innovation;
        const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kMostReadings> with =
            h.lazyProduct(shared_.template topRows<k>()) + considered.transpose();
        covariance_ -= gain.lazyProduct(ph.transpose());
        shared_ -= gain.lazyProduct(with);
      });
    }
    const MotionState next = plus(before, change);
    const Vector6 step = minus(next.pose, now_.state.pose);
    now_.state = next;
    const double step_m = step.head<3>().norm() + step.tail<3>().norm() / turn_per_shift_;
    // Readings are straight lines over a step of a thousandth of the robot.
    if (step_m < (starts ? 1e-6 : 1e-3) * size_m_) break;
  }
  return evaluate_now();
}

/// However the platform moves, its readings belong to one pose: what surprises a sample and belongs
/// to none is not its motion. What contradicted of late is left out, too.
void Tracker::leave_out_strangers(std::vector<Reading>& readings) {
  constexpr double kSurprises = 4.0;
  disagrees_ = disagreed_;
  const bool surprises = std::ranges::any_of(
      readings, [](const Reading& r) { return r.size > kSurprises * kSurprises; });
  if (surprises) {
    ReadingVector misfits = ReadingVector::Constant(offsets_.offset.size(), kNaN);
    for (const Reading& r : readings) misfits[r.row] = r.innovation;
    const Disagreement now =
        agreement_.of(misfits, readings_.by_pose, offsets_.sample_variance, pose_sigma());
    for (const Eigen::Index row : now.rows) disagrees_[static_cast<std::size_t>(row)] = true;
  }
  now_.left_out = static_cast<int>(std::erase_if(
      readings, [&](const Reading& r) { return disagrees_[static_cast<std::size_t>(r.row)]; }));
}

/// What contradicts little but long shows in the means of late.
void Tracker::compare_of_late(const ReadingVector& misfits) {
  const std::optional<LateSensor>& late = known_late_ ? known_late_ : lateness_.found();
  for (std::size_t window = 0; window < lately_.size(); ++window) {
    auto& [mean, count, last_s] = lately_[window];
    if (mean.size() != misfits.size()) {
      mean = count = ReadingVector::Zero(misfits.size());
      last_s = ReadingVector::Constant(misfits.size(), kNaN);
    }
    // Means are compared that are of the same time.
    const bool returns =
        (misfits.array().isFinite() && now_.time_s - last_s.array() > kSilent_s).any();
    if (returns) count.setZero();
    for (Eigen::Index row = 0; row < misfits.size(); ++row) {
      if (!std::isfinite(misfits[row]) || !(innovation_[row] < kOutlier * kOutlier)) continue;
      const KnownOffsets::Row& known = offsets_.rows[static_cast<std::size_t>(row)];
      if (known.inertial) continue;
      double misfit = misfits[row];
      if (late && row_of(known.label.channel).sensor == late->sensor) {
        misfit -= late->delay_s * readings_.by_pose.row(known.reading).dot(now_.state.twist);
      }
      const double each_s = std::isfinite(last_s[row]) ? now_.time_s - last_s[row] : dt_s_;
      average(misfit, kLately_s[window] / each_s, mean[row], count[row]);
      last_s[row] = now_.time_s;
    }
  }
  if (!(now_.time_s - compared_s_ >= kCompare_s)) return;
  compared_s_ = now_.time_s;
  disagreed_.assign(disagreed_.size(), false);
  quarrels_ = false;
  for (std::size_t window = 0; window < lately_.size(); ++window) {
    const auto& [mean, count, last_s] = lately_[window];
    const auto fresh = count.array() > 0.0 && now_.time_s - last_s.array() <= kSilent_s;
    const Disagreement of = agreement_.of(
        fresh.select(mean, kNaN), readings_.by_pose,
        offsets_.rounding_variance + offsets_.sample_variance.cwiseQuotient(count.cwiseMax(1.0)),
        pose_sigma());
    for (const Eigen::Index row : of.rows) disagreed_[static_cast<std::size_t>(row)] = true;
    quarrels_ = quarrels_ || (of.contradicts && of.rows.empty());
  }
}

/// As dense as the innovations say: their mean square is 1 at the right density. What is considered
/// is not known, but lasts: it hides in the mean of late, and what is left is motion and noise.
void Tracker::learn_jerk(const std::vector<Reading>& readings) {
  if (readings.empty()) return;
  if (lasting_.size() != offsets_.offset.size()) {
    lasting_.setZero(offsets_.offset.size());
    lasted_.setZero(offsets_.offset.size());
  }
  // A little less than the mean of χ² so clipped (0.995): too dense costs less than too thin.
  constexpr double kClip = 9.0, kExpected = 0.98, kRate = 0.2, kMost = 0.7;
  double sum = 0.0;
  for (const Reading& r : readings) {
    average(r.innovation, kLately_s.back() / dt_s_, lasting_[r.row], lasted_[r.row]);
    const double changed = r.innovation - lasting_[r.row];
    sum += std::min(changed * changed / r.of_motion, kClip);
  }
  const double excess = sum / static_cast<double>(readings.size()) - kExpected;
  jerk_ *= std::exp(std::clamp(kRate * excess, -kMost, kMost));
  jerk_ = std::clamp(jerk_, kLeastJerk, kMostJerk);
}

void Tracker::follow_directions() {
  turn_over(readings_.model.length_m, turn_over_m(robot_), length_m_, length_turn_);
  turn_over(readings_.model.swivel_rad, kTurnOver_rad, swivel_rad_, swivel_turn_);
}

bool Tracker::is_vague(const Vector6& variance) const {
  return !(std::sqrt(variance.head<3>().maxCoeff()) < kVagueShift * size_m_ &&
           std::sqrt(variance.tail<3>().maxCoeff()) < kVagueTurn);
}

/// How long the readings have not determined the pose by themselves. Those of a whole sample are
/// taken to; of sensors that are read in turn, or that are gone, it is asked.
void Tracker::note_what_is_said() {
  const auto rows = offsets_.rows.size();
  const auto is_silent = [&](std::size_t r) {
    return !offsets_.rows[r].inertial && !std::isfinite(innovation_[static_cast<Eigen::Index>(r)]);
  };
  std::size_t row = 0;
  while (row < rows && !is_silent(row)) ++row;
  const bool whole = row == rows;
  if (whole || step_.starts || now_.time_s - said_since_s_ > kSaidLately_s) {
    said_before_ = whole || step_.starts ? Matrix6(Matrix6::Zero()) : said_;
    said_.setZero();
    said_since_s_ = now_.time_s;
  }
  unsaid_s_ = whole || std::isnan(dt_s_) ? 0.0 : unsaid_s_ + dt_s_;
  if (whole) return;
  Vector6 scale;
  scale << Vector3::Constant(size_m_), Vector3::Ones();
  for (std::size_t r = 0; r < rows; ++r) {
    if (offsets_.rows[r].inertial || is_silent(r)) continue;
    const auto i = static_cast<Eigen::Index>(r);
    const Vector6 by_pose =
        scale.cwiseProduct(readings_.by_pose.row(offsets_.rows[r].reading).transpose());
    said_ +=
        by_pose * by_pose.transpose() / (offsets_.covariance(i, i) + offsets_.sample_variance[i]);
  }
  constexpr double kNothing = 1e-6;  // singular where nothing is said
  const Matrix6 known = free_.of_stiffness(said_before_ + said_) + kNothing * Matrix6::Identity();
  const Matrix6 covariance = free_.of_square(known.inverse());
  if (!is_vague(covariance.diagonal().cwiseProduct(scale.cwiseAbs2()))) unsaid_s_ = 0.0;
}

/// A filter that lost one direction linearises about a pose that is far off there, and what it then
/// takes for information about that direction is none (Huang, Mourikis and Roumeliotis 2010). A
/// pose that was left open is found anew, from nothing, once readings determine it by themselves.
void Tracker::watch_open() {
  note_what_is_said();
  const bool vague = is_vague(covariance_.diagonal().head<6>()) || goes_unseen(unsaid_s_);
  if (vague && !left_open_) {
    left_open_ = true;
    anew_ = false;
  }
  if (!left_open_) return;
  if (unsaid_s_ > 0.0) {
    anew_ = anew_ && step_.starts;
  } else if (!anew_ && !step_.starts) {
    lost_ = anew_ = true;
  } else {
    left_open_ = vague;
  }
}

void Tracker::judge(bool corrected) {
  now_.trusted = step_.agrees = false;
  if (!corrected) {
    now_.reason = "no pose near the last one has these readings";
    return;
  }
  for (std::size_t r = 0; r < offsets_.rows.size(); ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    // What hums says nothing against the pose.
    if (offsets_.rows[r].inertial || !std::isfinite(innovation_[row])) continue;
    const double misfit = this->misfit(row);
    const double expected = offsets_.covariance(row, row) + offsets_.sample_variance[row];
    const bool surprises = !step_.starts && innovation_[row] > largest(r);
    const bool remains = misfit * misfit > kOutlier * kOutlier * expected;
    const bool agrees = innovation_[row] < kAgrees * kAgrees && !disagrees_[r] && !quarrels_;
    contradictions_.note(r, surprises || remains || disagrees_[r], std::abs(misfit), agrees,
                         disagrees_[r], dt_s_, step_.starts);
  }
  quarrels_for_s_ = quarrels_ ? quarrels_for_s_ + dt_s_ : 0.0;
  // One reading, that is: of several it is rather the motion, or a whole sensor, that is not as it
  // is taken for.
  const bool one = contradictions_.out() == 1;
  for (std::size_t r = 0; r < offsets_.rows.size(); ++r) {
    if (!contradictions_.is_out(r) || (one && contradictions_.is_told(r))) continue;
    const double misfit = this->misfit(static_cast<Eigen::Index>(r));
    const Quantity shown = quantity_of(row_of(offsets_.rows[r].label.channel).of());
    const std::string by = std::isfinite(misfit)
                               ? printed(" by %.3g %s", shown.scale * misfit, shown.unit)
                               : "";  // not read just now: the last is what counts
    now_.reason =
        printed("%s contradicts the other readings%s for %.1f s",
                in_words(offsets_.rows[r].label).c_str(), by.c_str(), contradictions_.against_s(r));
    return;
  }
  if (quarrels_for_s_ > Contradictions::kDoubt_s) {
    now_.reason = printed("the readings contradict one another for %.1f s", quarrels_for_s_);
    return;
  }
  watch_open();
  now_.trusted = !left_open_;
  // One reading may be a spike; of a motion that several contradict nobody should make more.
  step_.agrees = now_.trusted && std::ranges::count(disagrees_, true) < 2;
  now_.reason.clear();
  if (now_.trusted) return judge_lateness();
  const Vector6 sigma = pose_sigma();
  now_.reason =
      printed("the readings leave the pose open (sigma %.3g mm, %.3g deg); it takes more sensors",
              1e3 * sigma.head<3>().maxCoeff(), sigma.tail<3>().maxCoeff() / kDegree);
}

/// Whether a late sensor makes the pose wrong by more than is said of it.
void Tracker::judge_lateness() {
  constexpr double kMost = 2.0;  // σ
  const std::optional<LateSensor>& late = known_late_ ? known_late_ : lateness_.found();
  if (!late) return;
  const Vector6 error = lateness_.pose_error(*late).cwiseAbs();
  const Vector6 sigma = pose_sigma();
  if (!(error.cwiseQuotient(sigma).maxCoeff() > kMost)) return;
  now_.trusted = false;
  now_.reason = printed(
      "the readings of the %s come %.3g ms %s than the others, by which the pose is off by "
      "up to %.3g mm, %.3g deg",
      kSensorTable[static_cast<std::size_t>(late->sensor)].in_words, 1e3 * std::abs(late->delay_s),
      late->delay_s > 0.0 ? "later" : "earlier", 1e3 * error.head<3>().maxCoeff(),
      error.tail<3>().maxCoeff() / kDegree);
}

const TrackedSample& Tracker::add(const Measurement& sample) {
  if (!std::isfinite(sample.time_s)) {
    throw InputError("track: a sample's time must be a finite number of seconds");
  }
  const int n = robot_.cable_count();
  for_each_sensor(
      [&](const Sensor& sensor, const auto& field) {
        const std::size_t read = numbers(field).size();
        if (sensor.width != kOneACable || read == 0 || read == static_cast<std::size_t>(n)) return;
        throw InputError("track: a sample reads " + std::to_string(read) + " cables, robot '" +
                         robot_.name + "' has " + std::to_string(n) +
                         "; give samples of this robot");
      },
      sample);
  const double usual_s = std::exchange(dt_s_, sample.time_s - last_s_);
  if (!(dt_s_ > 0.0) && std::isfinite(last_s_)) {
    throw InputError("track: a sample at " + std::to_string(sample.time_s) +
                     " s comes after one at " + std::to_string(last_s_) +
                     " s; give them in order, each once");
  }
  last_s_ = now_.time_s = sample.time_s;
  sample_ = sample;
  sample_.kind = PoseKind::kinematic_pose;
  sample_.run_time_s = sample.time_s - offsets_.run_start_s;
  leave_out_held();
  read_ = sample;
  leave_out_slack();
  const bool follows = dt_s_ <= kGap_s;
  if (!follows) contradictions_.forget();
  const bool anew = !follows || lost_ || (dt_s_ > kSilent * usual_s && goes_unseen(dt_s_));
  if (!anew) predict();
  // After a silence what was known is no better than nothing.
  step_.starts = anew || !(covariance_.diagonal().head<3>().maxCoeff() < size_m_ * size_m_);
  at_rest_ = std::isnan(dt_s_) && places_.front().kind == PoseKind::static_pose;
  if (step_.starts) start();
  const bool corrected = correct();
  lost_ = !corrected;
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  step_.covariance = covariance_;
  now_.pose_covariance = covariance_.topLeftCorner<6, 6>();
  now_.twist_covariance = covariance_.block<6, 6>(6, 6);
  if (corrected) {
    ReadingVector misfits(offsets_.offset.size());
    for (Eigen::Index row = 0; row < misfits.size(); ++row) misfits[row] = misfit(row);
    lateness_.add(now_.time_s, now_.state.pose, misfits, readings_);
    if (!step_.starts) compare_of_late(misfits);
  }
  if (corrected && !effects_.empty()) follow_directions();
  judge(corrected);
  return now_;
}

Track track(const Calibration& calibration, const Log& log, int segment) {
  const Robot& robot = calibration.problem.robot;
  const CorrectedRun run(robot, log, segment);
  Track out{robot.euler_convention, {}};
  const LateReadings read(calibration, run);
  const auto follow = [&](const std::optional<LateSensor>& late) {
    Tracker tracker(calibration, 1.0, late, read.ahead_s);
    out.samples.clear();
    for (Eigen::Index row = run.rows.begin; row < run.rows.end; ++row) {
      out.samples.push_back(tracker.add(
          measurement_at(read.run.log, row, PoseKind::kinematic_pose, robot.cable_count())));
    }
    return tracker.late();
  };
  out.samples.reserve(static_cast<std::size_t>(run.rows.size()));
  if (const auto late = follow({})) follow(late);  // it was so from the beginning
  return out;
}

}  // namespace cdprcal
