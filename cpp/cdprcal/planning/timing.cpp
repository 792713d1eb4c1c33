#include "cdprcal/planning/timing.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/startup/length_controller.hpp"
#include "cdprcal/startup/startup_checks.hpp"

namespace cdprcal {
namespace {

/// What rings at one end of a path: modes and how the equilibrium sets out in (or arrives) in each.
struct End {
  ModeVector omega_rad_s;
  ModeVector by_fraction;  ///< |d/ds| of the equilibrium's coordinate in each mode
  ModeVector excursion;    ///< farthest that the path's equilibria are away in each mode
  ModeVector reading;      ///< readings_by_mode
};

End end_of(const Robot& robot, const PathPoint& here, const std::vector<PathPoint>& path) {
  const PlatformState state = platform_state(robot, here.pose);
  const Modes modes = constant_tension_modes(robot, state, here.tension_N);
  // vᵀMv = 1, so vᵀM reads a twist's coordinate in the mode.
  const Matrix6 coordinates = modes.shape.transpose() * mass_matrix(robot, state);
  End end;
  end.omega_rad_s = 2.0 * kPi * modes.natural_frequency_hz;
  end.by_fraction = (coordinates * here.twist_by_fraction).cwiseAbs();
  end.excursion = ModeVector::Zero(6);
  for (const PathPoint& point : path) {
    const Vector6 away = (coordinates * minus(point.pose, here.pose)).cwiseAbs();
    end.excursion = end.excursion.cwiseMax(away);
  }
  end.reading = readings_by_mode(robot, state, modes);
  return end;
}

/// Ringing of each mode just after a transition of T, in σ of the reading it moves most. What the
/// start excited has decayed meanwhile; modes change their shapes on the way and mix, so all of it
/// decays as the slowest does.
ModeVector ringing(const End& start, const End& end, double T, double damping) {
  const double slowest = 0.5 * (start.omega_rad_s.minCoeff() + end.omega_rad_s.minCoeff());
  const double decay = std::exp(-damping * slowest * T);
  const auto excited = [T](const End& at, Eigen::Index k) {
    return std::min(at.excursion[k],
                    at.by_fraction[k] * fifth_degree_residual(at.omega_rad_s[k] * T));
  };
  ModeVector out(end.reading.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    out[k] = excited(end, k) * end.reading[k] + decay * excited(start, k) * start.reading[k];
  }
  return out;
}

/// When the sum of all modes' ringing has come down to the tolerance.
double settling_time_s(const ModeVector& ringing, const End& end, double damping,
                       double tolerance) {
  const auto left = [&](double t) {
    return ringing.dot(ModeVector((-damping * end.omega_rad_s * t).array().exp().matrix()));
  };
  if (left(0.0) <= tolerance) return 0.0;
  double high = 1.0 / (damping * end.omega_rad_s.minCoeff());
  while (left(high) > tolerance) high *= 2.0;
  double low = 0.0;
  while (high - low > 1e-6 * high) {
    const double middle = 0.5 * (low + high);
    (left(middle) > tolerance ? low : high) = middle;
  }
  return high;
}

/// To tenths of a second, as plans are read by people and logged at 10 Hz.
double rounded_up(double time_s) { return std::max(0.0, std::ceil(10.0 * time_s - 1e-3) / 10.0); }

/// d²ζ/ds² at a point of a path, by differences of dζ/ds.
Vector6 curvature(const std::vector<PathPoint>& points, std::size_t i) {
  const PathPoint& before = points[i > 0 ? i - 1 : 0];
  const PathPoint& after = points[std::min(i + 1, points.size() - 1)];
  const double step = after.fraction - before.fraction;
  if (!(step > 0.0)) return Vector6::Zero();
  return (after.twist_by_fraction - before.twist_by_fraction) / step;
}

/// How far the platform lags behind a moving equilibrium, times T² [m·s²]: (K + Q)⁻¹ M ζ̈.
Vector3 lag_by_time(const Robot& robot, const std::vector<PathPoint>& points, std::size_t i) {
  const PathPoint& at = points[i];
  const double x = FifthDegree::inverse(at.fraction);
  const double velocity = FifthDegree::velocity(x);
  const Vector6 acceleration = curvature(points, i) * velocity * velocity +
                               at.twist_by_fraction * FifthDegree::acceleration(x);
  const PlatformState state = platform_state(robot, at.pose);
  const Matrix6 hessian = stiffness(robot, state, at.tension_N);
  const Vector6 lag = solve_square(hessian, Vector6(mass_matrix(robot, state) * acceleration));
  return lag.head<3>();
}

}  // namespace

double fifth_degree_residual(double omega_T) {
  const double square = omega_T * omega_T;
  const double residual =
      60.0 / (square * omega_T) * std::sqrt(1.0 + 12.0 / square + 144.0 / (square * square));
  return std::min(1.0, residual);
}

ModeVector readings_by_mode(const Robot& robot, const PlatformState& state, const Modes& modes) {
  const SensorSigma& sigma = robot.sigma;
  const CableJacobian lengths = length_jacobian(state) / sigma.length_m;
  const CableJacobian swivels = swivel_jacobian(state) / sigma.swivel_rad;
  ModeVector out(modes.shape.cols());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    const Vector6 shape = modes.shape.col(k);
    out[k] =
        std::max({(lengths * shape).cwiseAbs().maxCoeff(), (swivels * shape).cwiseAbs().maxCoeff(),
                  shape.tail<3>().cwiseAbs().maxCoeff() / sigma.attitude_rad});
  }
  return out;
}

TransitionTimer::TransitionTimer(const PathChecker& checker, const TimingOptions& options)
    : checker_(checker), options_(options) {
  const auto require = [](bool fine, const char* what) {
    if (!fine) throw InputError(std::string("timing: ") + what);
  };
  require(options.max_platform_speed_m_s > 0.0, "max_platform_speed_m_s must be positive");
  require(options.max_cable_speed_m_s > 0.0, "max_cable_speed_m_s must be positive");
  require(options.damping_ratio > 0.0 && options.damping_ratio < 1.0,
          "damping_ratio must be above 0 and below 1");
  require(options.rest_tolerance > 0.0, "rest_tolerance must be positive (in sigma)");
  require(options.measuring_s >= 0.0 && std::isfinite(options.measuring_s),
          "measuring_s must be at least 0");
}

double TransitionTimer::least_by_speed_s(const Path& path) const {
  double least = 0.0;
  for (const PathPoint& point : path.points) {
    const double velocity = FifthDegree::velocity(FifthDegree::inverse(point.fraction));
    const double platform = point.twist_by_fraction.head<3>().norm();
    const double cable = point.length_by_fraction_m.cwiseAbs().maxCoeff();
    least = std::max({least, platform * velocity / options_.max_platform_speed_m_s,
                      cable * velocity / options_.max_cable_speed_m_s});
  }
  return least;
}

Timing TransitionTimer::held_time(const Path& path) const {
  Timing timing;
  const PathPoint &from = path.points.front(), &to = path.points.back();
  const HeldMotion motion(from.pose, from.tension_N, to.pose, to.tension_N);
  // As fast as the start-up's winches run, unless they are told to.
  const double least_s =
      held_transition_time_s(checker_.robot(), motion, derived_velocity_m_s(checker_.robot()));
  timing.transition_s = rounded_up(std::max(least_by_speed_s(path), least_s));
  timing.settling_s = DetectionOptions{}.window_s;
  timing.dwell_s = timing.settling_s + options_.measuring_s;
  return timing;
}

std::optional<double> TransitionTimer::least_by_workspace_s(const Path& path,
                                                            double at_least_s) const {
  constexpr double kLonger = 1.25;
  constexpr double kTooSlow = 20.0;
  double T = at_least_s;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    const Vector3 lag = lag_by_time(checker_.robot(), path.points, i);
    const PathPoint& point = path.points[i];
    const auto stays = [&](double sign) {
      return checker_.allows(point.pose.position_m + sign * lag / (T * T), point.pose.rotation);
    };
    while (!stays(-1.0) || !stays(1.0)) {
      T *= kLonger;
      if (T > kTooSlow * at_least_s) return std::nullopt;
    }
  }
  return T;
}

std::optional<Timing> TransitionTimer::time(const Path& path) const {
  const Robot& robot = checker_.robot();
  if (holds_orientation(robot)) return held_time(path);
  const End start = end_of(robot, path.points.front(), path.points);
  const End end = end_of(robot, path.points.back(), path.points);
  // The equilibrium must move slowly against the slowest swing for all of this to hold.
  const double slowest = std::min(start.omega_rad_s.minCoeff(), end.omega_rad_s.minCoeff());
  const double period_s = 2.0 * kPi / slowest;
  const auto least = least_by_workspace_s(path, std::max(least_by_speed_s(path), period_s));
  if (!least) return std::nullopt;

  const auto settling = [&](double T) {
    return settling_time_s(ringing(start, end, T, options_.damping_ratio), end,
                           options_.damping_ratio, options_.rest_tolerance);
  };
  // T + settling(T) falls, then rises: a coarse scan, then golden section.
  constexpr int kScan = 40;
  constexpr double kRatio = 1.08;
  double best = *least;
  for (int i = 1; i <= kScan; ++i) {
    const double T = *least * std::pow(kRatio, i);
    if (T + settling(T) < best + settling(best)) best = T;
  }
  double low = std::max(*least, best / kRatio), high = best * kRatio;
  constexpr double kGolden = 0.6180339887498949;
  while (high - low > 1e-3) {
    const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    (a + settling(a) <= b + settling(b) ? high : low) = a + settling(a) <= b + settling(b) ? b : a;
  }
  const double refined = 0.5 * (low + high);
  if (refined + settling(refined) < best + settling(best)) best = refined;

  Timing timing;
  timing.transition_s = rounded_up(best);
  timing.settling_s = rounded_up(settling(timing.transition_s));
  timing.dwell_s = timing.settling_s + options_.measuring_s;
  return timing;
}

}  // namespace cdprcal
