#include "cdprcal/motion/pushes.hpp"

#include <algorithm>
#include <numeric>

#include "cdprcal/motion/locked.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Growth that is one: of what there was, and of what errors of the twists look like.
constexpr double kGrowth = 1.0 / 3.0, kErrors = 3.0;
/// A push is over when so much of the energy is gone again, or it has not grown for so many
/// periods.
constexpr double kGone = 0.2, kOver = 4.0;
constexpr double kFewestPeriods = 3.0;

/// Energy of the swing, and what errors of the twists alone would show as such.
struct SwingEnergy {
  double time_s = kNaN, swing_J = 0.0, error_J = 0.0;
};

/// Each the mean, or the median, of all within a period about it, or of the nearest such time
/// within the stretch.
template <typename Middle>
std::vector<SwingEnergy> over_periods(const std::vector<SwingEnergy>& each, double period_s,
                                      const Middle& middle_of) {
  std::vector<SwingEnergy> out;
  std::vector<double> swing_J, error_J;
  const double first_s = each.front().time_s, last_s = each.back().time_s - period_s;
  auto begin = each.begin(), end = begin;
  for (const SwingEnergy& at : each) {
    const double from_s = std::max(first_s, std::min(at.time_s - 0.5 * period_s, last_s));
    while (end != each.end() && end->time_s <= from_s + period_s) ++end;
    while (begin->time_s < from_s) ++begin;
    swing_J.clear(), error_J.clear();
    for (auto one = begin; one != end; ++one) {
      swing_J.push_back(one->swing_J);
      error_J.push_back(one->error_J);
    }
    out.push_back({at.time_s, middle_of(swing_J), middle_of(error_J)});
  }
  return out;
}

double mean(const std::vector<double>& values) {
  return std::reduce(values.begin(), values.end()) / static_cast<double>(values.size());
}

void find(const std::vector<SwingEnergy>& energy, double period_s, std::vector<Push>& out) {
  for (std::size_t k = 0, low = 0; k < energy.size(); ++k) {
    if (energy[k].swing_J < energy[low].swing_J) low = k;
    const double before = energy[low].swing_J;
    const double errors = std::max(energy[low].error_J, energy[k].error_J);
    if (!(energy[k].swing_J > (1.0 + kGrowth) * before + kErrors * errors)) continue;
    std::size_t high = k;
    const auto goes_on = [&] {
      return k < energy.size() && energy[k].swing_J > (1.0 - kGone) * energy[high].swing_J &&
             energy[k].time_s - energy[high].time_s < kOver * period_s;
    };
    for (; goes_on(); ++k) {
      if (energy[k].swing_J > energy[high].swing_J) high = k;
    }
    out.push_back({energy[low].time_s, energy[high].time_s, before, energy[high].swing_J});
    low = k;
    if (k == energy.size()) break;
  }
}

}  // namespace

std::vector<Push> pushes(const Calibration& calibration, const CorrectedRun& run,
                         std::span<const SmoothedSample> path) {
  const Robot robot = with_effects(calibration.problem.robot, calibration.problem.effects);
  std::vector<Push> out;
  const auto moves = [&](std::size_t, std::size_t i) {
    return !is_resting(calibration, path[i].time_s);
  };
  for (const LockedStretch& stretch : locked_stretches(calibration, run, path, moves)) {
    const Modes modes = modes_at(robot, path[(stretch.begin + stretch.end) / 2].state.pose);
    double slowest_hz = HUGE_VAL;
    for (const double hz : modes.natural_frequency_hz) slowest_hz = std::fmin(slowest_hz, hz);
    const double period_s = 1.0 / slowest_hz;
    if (!(period_s > 0.0) || !(lasts_s(stretch, path) > kFewestPeriods * period_s)) continue;
    // A winch that sets off has moved the platform before its own reading tells.
    const bool to_the_end = stretch.end == path.size();
    const double until_s = path[stretch.end - 1].time_s - (to_the_end ? 0.0 : period_s);
    std::vector<SwingEnergy> energy;
    for (std::size_t i = stretch.begin; i < stretch.end && path[i].time_s <= until_s; ++i) {
      const MotionState& state = path[i].state;
      const Matrix6 mass = mass_matrix(robot, platform_state(robot, state.pose));
      const Matrix6 known = path[i].covariance.block<6, 6>(6, 6);
      const double twice_J = state.twist.dot(mass * state.twist), error_J = (mass * known).trace();
      if (std::isfinite(twice_J + error_J)) energy.push_back({path[i].time_s, twice_J, error_J});
    }
    if (energy.empty()) continue;
    // Half of a swing's time its kinetic energy is above the mean: the median is that, whatever the
    // path does for a moment. The mean of these takes out what ripple is left, since large swings
    // are slower or faster than their mode.
    energy = over_periods(energy, period_s, &median);
    energy = over_periods(energy, period_s, &mean);
    find(energy, period_s, out);
  }
  return out;
}

void add(const std::vector<Push>& more, std::vector<Push>& pushes) {
  pushes.insert(pushes.end(), more.begin(), more.end());
  std::ranges::sort(pushes, {}, &Push::begin_s);
  std::vector<Push> out;
  for (const Push& next : pushes) {
    if (out.empty() || next.begin_s > out.back().end_s) {
      out.push_back(next);
      continue;
    }
    Push& last = out.back();
    const bool larger = next.after_J - next.before_J > last.after_J - last.before_J;
    const Push& shown = larger ? next : last;
    last = {last.begin_s, std::max(last.end_s, next.end_s), shown.before_J, shown.after_J};
  }
  pushes = std::move(out);
}

bool is_pushed(const std::vector<Push>& pushes, double time_s, double around_s) {
  return std::ranges::any_of(pushes, [&](const Push& push) {
    return time_s >= push.begin_s - around_s && time_s <= push.end_s + around_s;
  });
}

std::string in_words(const std::vector<Push>& pushes) {
  std::string out;
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    add_item(out, printed("%.1f to %.1f s", pushes[i].begin_s, pushes[i].end_s),
             i + 1 < pushes.size() ? ", " : " and ");
  }
  return out;
}

}  // namespace cdprcal
