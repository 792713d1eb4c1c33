#include "cdprcal/startup/rest_detector.hpp"

#include <algorithm>

#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Sample times that are summed up miss a window's edge by rounding. A sample this close to the
/// edge belongs to the window.
constexpr double kEdge_s = 1e-9;

}  // namespace

RestDetector::RestDetector(int cable_count, const SensorSigma& sigma, const RestOptions& options)
    : n_(cable_count), options_(options) {
  const auto channels = [&](Group& group, int count, double sigma_c, bool angle, bool tension) {
    for (int i = 0; i < count; ++i) {
      group.channels.push_back({options.tolerance * sigma_c, angle, tension, {}});
    }
  };
  channels(drives_, n_, sigma.length_m, false, false);
  channels(drives_, n_, sigma.swivel_rad, true, false);
  channels(drives_, n_, sigma.tension_N, false, true);
  channels(attitude_, 3, sigma.attitude_rad, true, false);
}

void RestDetector::clear() {
  for (Group* group : {&drives_, &attitude_}) {
    group->time_s.clear();
    for (Channel& channel : group->channels) channel.values.clear();
  }
  newest_s_ = begun_s_ = judged_s_ = ripple_ = kNaN;
  at_rest_ = false;
}

void RestDetector::add(Group& group, double time_s, const Eigen::Ref<const Eigen::VectorXd>& values,
                       std::size_t first) {
  for (std::size_t c = 0; c < static_cast<std::size_t>(values.size()); ++c) {
    Channel& channel = group.channels[first + c];
    double v = values[static_cast<Eigen::Index>(c)];
    if (channel.angle && std::isfinite(v)) {
      const auto last = std::find_if(channel.values.rbegin(), channel.values.rend(),
                                     [](double x) { return std::isfinite(x); });
      if (last != channel.values.rend()) v = *last + wrap_angle(v - *last);
    }
    channel.values.push_back(v);
  }
  if (group.time_s.size() == group.channels[first].values.size()) return;
  group.time_s.push_back(time_s);
}

void RestDetector::push(const RobotSample& sample) {
  newest_s_ = sample.time_s;
  if (std::isnan(begun_s_)) begun_s_ = sample.time_s;
  const double drives_s = std::isnan(sample.drives_time_s) ? sample.time_s : sample.drives_time_s;
  const double attitude_s =
      std::isnan(sample.attitude_time_s) ? sample.time_s : sample.attitude_time_s;
  // A reading that is repeated until the next one arrives counts once.
  if (drives_.time_s.empty() || drives_s > drives_.time_s.back()) {
    const auto n = static_cast<std::size_t>(n_);
    const CableVector none = CableVector::Constant(n_, kNaN);
    add(drives_, drives_s, sample.length_m.size() == n_ ? sample.length_m : none, 0);
    add(drives_, drives_s, sample.swivel_rad.size() == n_ ? sample.swivel_rad : none, n);
    add(drives_, drives_s, sample.tension_N.size() == n_ ? sample.tension_N : none, 2 * n);
  }
  if (attitude_.time_s.empty() || attitude_s > attitude_.time_s.back()) {
    add(attitude_, attitude_s, sample.roll_pitch_yaw_rad, 0);
  }
  // Twice the window is kept; dropped in bulk.
  for (Group* group : {&drives_, &attitude_}) {
    const auto keep = std::lower_bound(group->time_s.begin(), group->time_s.end(),
                                       newest_s_ - 2.0 * options_.window_s - kEdge_s);
    const auto drop = keep - group->time_s.begin();
    if (2 * drop < static_cast<std::ptrdiff_t>(group->time_s.size())) continue;
    group->time_s.erase(group->time_s.begin(), keep);
    for (Channel& c : group->channels) c.values.erase(c.values.begin(), c.values.begin() + drop);
  }
}

double RestDetector::judge(const Channel& channel, const Group& group, double begin_s) const {
  const auto first = static_cast<std::size_t>(
      std::lower_bound(group.time_s.begin(), group.time_s.end(), begin_s - kEdge_s) -
      group.time_s.begin());
  const std::size_t size = group.time_s.size();
  double count = 0.0, mean = 0.0, mean_t = 0.0;
  for (std::size_t i = first; i < size; ++i) {
    if (!std::isfinite(channel.values[i])) continue;
    ++count;
    mean += channel.values[i];
    mean_t += group.time_s[i];
  }
  if (count == 0.0) return 0.0;  // an absent sensor does not vote
  if (count < 4.0) return HUGE_VAL;
  mean /= count;
  mean_t /= count;
  double tt = 0.0, tv = 0.0, vv = 0.0;
  for (std::size_t i = first; i < size; ++i) {
    if (!std::isfinite(channel.values[i])) continue;
    const double t = group.time_s[i] - mean_t, v = channel.values[i] - mean;
    tt += t * t, tv += t * v, vv += v * v;
  }
  const Eigen::Map<const Eigen::VectorXd> all(channel.values.data(),
                                              static_cast<Eigen::Index>(size));
  const double white = channel_noise(all);
  const double z = normal_quantile(0.5 + 0.5 * options_.confidence);
  const double span = group.time_s.back() - group.time_s[first];
  const double scatter = vv / (count - 1.0);
  // Tensions may chatter at a platform at rest: what they scatter counts as their noise.
  const double noise = channel.tension ? std::max(white, std::sqrt(scatter)) : white;
  const double moved = std::abs(tv / tt) * span;
  const double ripple = moved / (z * noise / std::sqrt(tt) * span + channel.tolerance + 1e-300);
  if (channel.tension) return ripple;
  const double allowed =
      noise * noise * chi_square_quantile(options_.confidence, count - 1.0) / (count - 1.0) +
      channel.tolerance * channel.tolerance;
  return std::max(ripple, std::sqrt(scatter / (allowed + 1e-300)));
}

bool RestDetector::at_rest() {
  const double window = options_.window_s;
  if (!(newest_s_ - begun_s_ >= window - kEdge_s)) return false;
  if (newest_s_ - judged_s_ < 0.1 * window - kEdge_s) return at_rest_;
  judged_s_ = newest_s_;
  ripple_ = 0.0;
  for (Group* group : {&drives_, &attitude_}) {
    for (const Channel& channel : group->channels) {
      ripple_ = std::max(ripple_, judge(channel, *group, newest_s_ - window));
    }
  }
  return at_rest_ = ripple_ <= 1.0;
}

}  // namespace cdprcal
