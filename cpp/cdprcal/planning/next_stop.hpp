// Which stop of a plan to measure next, while the robot runs: what each would teach about the
// initial pose, per second of robot time.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "cdprcal/planning/known_effects.hpp"
#include "cdprcal/planning/legs.hpp"
#include "cdprcal/planning/plan.hpp"
#include "cdprcal/startup/startup.hpp"

namespace cdprcal {

/// Standard deviations of the initial pose that somebody wants, of the worst axis.
struct AskedAccuracy {
  double position_m = 5e-3;
  double rotation_rad = 0.5 * kDegree;
};

/// Whether a covariance of ζ0 (position [m], world-frame rotation vector [rad]) is good enough: no
/// axis, whichever way it points, has a larger standard deviation.
bool reached(const Matrix6& covariance, const AskedAccuracy& asked);

/// The stop to measure next and how to get there.
struct NextStop {
  int stop = 0;                 ///< which of the plan's poses, from 0
  StartUpPlan way;              ///< set-points to pass through, then the stop itself
  double time_s = 0.0;          ///< with settling and measuring
  Vector6 predicted_deviation;  ///< of ζ0 after it, from rests alone and a guess (10 m, 1 rad)
};

/// Chooses among the measured stops of a plan.
class NextStopChooser {
 public:
  /// Follows the ways between all stops, on `threads` cores (0: all), no closer to the tension
  /// limits than one σ of the load cells or than the plan's own stops are. Throws InputError as
  /// verify_plan does, and when a stop's tensions do not hold the platform.
  NextStopChooser(const Robot& robot, const Plan& plan, int threads = 0,
                  const ShareDone& progress = {});

  /// `progress` said stop: nothing can be chosen.
  [[nodiscard]] bool stopped() const { return legs_->stopped(); }

  /// `measured`: stops that were measured, in order; the robot is at the last of them, or at τ0
  /// when there are none. `initial`: the estimate of ζ0, `initial_reading_N` the load cells there.
  /// The criterion is the weighted trace Σ var/asked² (A-optimal, in the asker's units): the stop
  /// with the greatest relative decrease per second wins. Nothing when no stop is left that can be
  /// reached.
  [[nodiscard]] std::optional<NextStop> choose(const std::vector<int>& measured,
                                               const Pose& initial,
                                               const CableVector& initial_reading_N,
                                               const AskedAccuracy& asked) const;
  /// The stop of the greatest worth per second, of those that are worth anything; `worth`: of each
  /// of the plan's poses. Its predicted_deviation is NaN.
  [[nodiscard]] std::optional<NextStop> choose(const std::vector<int>& measured,
                                               const std::vector<double>& worth) const;

 private:
  [[nodiscard]] std::size_t place_of(int stop) const;
  /// The set-points from one place to another.
  [[nodiscard]] StartUpPlan way(std::size_t from, std::size_t to) const;
  /// The place with the greatest positive gain per second from where the last of `measured` is.
  template <class Gain>
  [[nodiscard]] std::optional<NextStop> best_stop(const std::vector<int>& measured,
                                                  Gain gain) const;

  KnownEffects effects_;
  SetPointSolver solver_;
  std::optional<PathChecker> checker_;
  std::optional<TransitionTimer> timer_;
  std::vector<int> stop_of_place_;      ///< place p ≥ 1 is this pose of the plan
  std::vector<CableVector> reading_N_;  ///< of the places, as the plan has them
  std::unique_ptr<LegTable> legs_;
};

}  // namespace cdprcal
