#include "cdprcal/motion/late_sensors.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// The rate at a sample is the difference of poses so much before and after: a twist of one sample
/// is noise for the most part.
constexpr double kAside_s = 0.1;

}  // namespace

LateSensors::LateSensors(const KnownOffsets& offsets, const FreeMotion& free)
    : rows_(offsets.rows), free_(free) {
  weight_ = (offsets.covariance.diagonal() + offsets.sample_variance).cwiseInverse();
  for (const KnownOffsets::Row& row : rows_) {
    const int sensor = row_of(row.label.channel).sensor;
    const bool is_known =
        std::ranges::any_of(delays_, [&](const Delay& delay) { return delay.sensor == sensor; });
    if (!row.inertial && !is_known) delays_.emplace_back().sensor = sensor;
  }
  if (delays_.size() < 2) delays_.clear();  // late beside what?
}

void LateSensors::interrupt() {
  moments_.clear();
  next_ = 0;
}

void LateSensors::add(double time_s, const Pose& pose, const ReadingVector& misfit,
                      const GeometricReadings& readings) {
  if (delays_.empty()) return;
  Moment& now = moments_.emplace_back(Moment{time_s, pose, misfit, {}});
  now.by_pose.setZero(misfit.size(), 6);
  for (Eigen::Index r = 0; r < misfit.size(); ++r) {
    const KnownOffsets::Row& row = rows_[static_cast<std::size_t>(r)];
    if (row.inertial) {
      now.misfit[r] = kNaN;
    } else {
      now.by_pose.row(r) = readings.by_pose.row(row.reading);
    }
  }
  for (; next_ < moments_.size(); ++next_) {
    const Moment& at = moments_[next_];
    const auto after =
        std::find_if(moments_.begin() + static_cast<std::ptrdiff_t>(next_) + 1, moments_.end(),
                     [&](const Moment& later) { return later.time_s >= at.time_s + kAside_s; });
    if (after == moments_.end()) break;
    while (next_ > 0 && moments_[1].time_s <= at.time_s - kAside_s) {
      moments_.pop_front();
      --next_;
    }
    const Moment& before = moments_.front();
    if (before.time_s > at.time_s - kAside_s) continue;
    look_at(at, minus(after->pose, before.pose) / (after->time_s - before.time_s));
  }
}

bool LateSensors::is_of(Eigen::Index row, int sensor) const {
  return row_of(rows_[static_cast<std::size_t>(row)].label.channel).sensor == sensor;
}

/// About the pose, of the readings that there are.
Eigen::LDLT<Matrix6> LateSensors::information(const Moment& at) const {
  Matrix6 out = Matrix6::Zero();
  for (Eigen::Index r = 0; r < at.misfit.size(); ++r) {
    if (!std::isfinite(at.misfit[r])) continue;
    out += weight_[r] * at.by_pose.row(r).transpose() * at.by_pose.row(r);
  }
  out = free_.of_stiffness(out);
  out.diagonal().array() += 1e-12 * out.trace();
  return out.ldlt();
}

/// How the pose goes with a second of a sensor's delay, with the sign of the twist.
Vector6 LateSensors::pulled(const Moment& at, const Eigen::LDLT<Matrix6>& information,
                            const Vector6& twist, int sensor) const {
  Vector6 pull = Vector6::Zero();
  for (Eigen::Index r = 0; r < at.misfit.size(); ++r) {
    if (!std::isfinite(at.misfit[r]) || !is_of(r, sensor)) continue;
    pull += weight_[r] * at.by_pose.row(r).dot(twist) * at.by_pose.row(r).transpose();
  }
  return information.solve(free_.of(pull));
}

void LateSensors::look_at(const Moment& at, const Vector6& twist) {
  constexpr double kStretch_s = 2.0;  // longer than a swing
  if (!(at.time_s - stretch_began_s_ < kStretch_s)) {
    end_stretch();
    stretch_began_s_ = at.time_s;
  }
  const Eigen::LDLT<Matrix6> known = information(at);
  for (Delay& delay : delays_) {
    const Vector6 pose = pulled(at, known, twist, delay.sensor);
    for (Eigen::Index r = 0; r < at.misfit.size(); ++r) {
      if (!std::isfinite(at.misfit[r])) continue;
      double by_delay = -at.by_pose.row(r).dot(pose);
      if (is_of(r, delay.sensor)) by_delay += at.by_pose.row(r).dot(twist);
      delay.said += weight_[r] * by_delay * at.misfit[r];
      delay.known += weight_[r] * by_delay * by_delay;
    }
  }
}

void LateSensors::end_stretch() {
  constexpr double kChance = 3e-4;  // asked after every stretch
  double most = 0.0;
  found_.reset();
  for (Delay& delay : delays_) {
    delay.sum_said += delay.said;
    delay.sum_known += delay.known;
    delay.said_said += delay.said * delay.said;
    delay.said_known += delay.said * delay.known;
    delay.known_known += delay.known * delay.known;
    delay.said = delay.known = 0.0;
    if (!(delay.known_known > 0.0)) continue;
    const double delay_s = delay.sum_said / delay.sum_known;
    // As many stretches of equal weight (Kish 1965) say it.
    const double stretches = delay.sum_known * delay.sum_known / delay.known_known;
    if (!(stretches > 2.0)) continue;
    // Between stretches (clustered: Liang and Zeger 1986), and at least as readings scatter.
    const double scatter =
        delay.said_said - 2.0 * delay_s * delay.said_known + delay_s * delay_s * delay.known_known;
    const double variance = std::max(scatter * stretches / (stretches - 1.0), delay.sum_known);
    const double least = student_quantile(1.0 - 0.5 * kChance, stretches - 1.0);
    const double sigmas = std::abs(delay.sum_said) / std::sqrt(variance);
    if (!(sigmas > least && sigmas > most)) continue;
    most = sigmas;
    found_ = {delay.sensor, delay_s};
  }
}

Vector6 LateSensors::pose_error(const LateSensor& late) const {
  if (moments_.size() < 2) return Vector6::Zero();
  const Moment &now = moments_.back(), &before = moments_.front();
  const Vector6 twist = minus(now.pose, before.pose) / (now.time_s - before.time_s);
  const Vector6 pull = pulled(now, information(now), twist, late.sensor);
  // Nothing is read before it is so: what seems early is on time, and the others are late.
  return -std::abs(late.delay_s) * (late.delay_s > 0.0 ? pull : Vector6(twist - pull));
}

}  // namespace cdprcal
