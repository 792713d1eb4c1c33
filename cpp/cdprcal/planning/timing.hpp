// How long a transition takes and how long to wait after it, from the platform's own dynamics: what
// the paper tunes by trial and error (§3.2.2).
//
// A fifth-degree transition of duration T moves the equilibrium; the platform follows and rings in
// its six modes at constant tensions. The jerk at both ends is what excites a mode of frequency ω,
// by about 60 (ωT)⁻³ of the distance that the equilibrium moves in that mode. Then
// the ringing decays as e^{−ζωt}. A longer transition needs a shorter wait: T makes the sum least.
//
// Where lengths hold the whole pose (six cables and more) nothing swings: speed and the winches'
// ramp say how long a transition takes, and the wait is one window in which rest is seen.
#pragma once

#include <optional>

#include "cdprcal/geometry/fifth_degree.hpp"
#include "cdprcal/planning/path.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"

namespace cdprcal {

struct TimingOptions {
  double max_platform_speed_m_s = 0.5;  ///< peak speed of P
  double max_cable_speed_m_s = 0.5;     ///< peak speed of any cable
  /// ζ of every mode. Winches under tension control and pulleys damp strongly (0.1 and more in
  /// recorded runs); take less for a free-running platform.
  double damping_ratio = 0.1;
  /// Ringing that counts as rest, in σ of each sensor: what equilibrium detection accepts.
  double rest_tolerance = DetectionOptions{}.tolerance;
  /// Rest that is left for measuring: two windows of equilibrium detection.
  double measuring_s = 2.0 * DetectionOptions{}.window_s;
};

struct Timing {
  double transition_s = 0.0;
  double settling_s = 0.0;  ///< until the ringing is below the tolerance
  double dwell_s = 0.0;     ///< settling and measuring
  [[nodiscard]] double total_s() const { return transition_s + dwell_s; }
};

/// How much a mode rings after a fifth-degree transition of its equilibrium, relative to the
/// distance, when the two ends do not help each other: what one end alone excites, for ωT > 0.
/// 60 (ωT)⁻³ √(1 + 12 (ωT)⁻² + 144 (ωT)⁻⁴), and no more than 1.
double fifth_degree_residual(double omega_T);

/// Times of a clear path. Nothing when no duration keeps the platform inside the workspace (the
/// path runs along its edge and the platform lags behind the equilibrium).
class TransitionTimer {
 public:
  /// `checker` must outlive the timer. Throws InputError for limits, damping or tolerance that are
  /// not positive, a damping ratio of 1 or more, or a negative measuring time.
  TransitionTimer(const PathChecker& checker, const TimingOptions& options = {});

  [[nodiscard]] std::optional<Timing> time(const Path& path) const;

 private:
  [[nodiscard]] double least_by_speed_s(const Path& path) const;
  [[nodiscard]] Timing held_time(const Path& path) const;
  [[nodiscard]] std::optional<double> least_by_workspace_s(const Path& path,
                                                           double at_least_s) const;

  const PathChecker& checker_;
  TimingOptions options_;
};

/// Largest reading, in σ, that one unit of each mode moves: lengths, swivels and attitude.
ModeVector readings_by_mode(const Robot& robot, const PlatformState& state, const Modes& modes);

}  // namespace cdprcal
