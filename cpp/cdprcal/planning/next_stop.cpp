#include "cdprcal/planning/next_stop.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/planning/observability.hpp"

namespace cdprcal {
namespace {

double largest_deviation(const Matrix3& covariance) {
  return std::sqrt(symmetric_eigenvalues(covariance).maxCoeff());
}

/// Covariance of ζ0 under a guess of it as wide as the frame (10 m, 1 rad), so that sets of poses
/// which leave it unobservable can be compared too.
Matrix6 covariance_of(const Eigen::MatrixXd& information) {
  Matrix6 own = Observability::on_initial_pose(information);
  own.diagonal().head<3>().array() += 1e-2;
  own.diagonal().tail<3>().array() += 1.0;
  return inverse(own);
}

double weighted_trace(const Matrix6& covariance, const AskedAccuracy& asked) {
  return covariance.topLeftCorner<3, 3>().trace() / (asked.position_m * asked.position_m) +
         covariance.bottomRightCorner<3, 3>().trace() / (asked.rotation_rad * asked.rotation_rad);
}

}  // namespace

bool reached(const Matrix6& covariance, const AskedAccuracy& asked) {
  return largest_deviation(covariance.topLeftCorner<3, 3>()) <= asked.position_m &&
         largest_deviation(covariance.bottomRightCorner<3, 3>()) <= asked.rotation_rad;
}

NextStopChooser::NextStopChooser(const Robot& robot, const Plan& plan, int threads,
                                 const ShareDone& progress)
    : effects_(robot), solver_(effects_.robot()) {
  std::vector<SetPoint> places;
  PathOptions options;
  options.tension_margin_N = tension_margin_N(effects_.robot(), SetPointOptions{});
  const auto add = [&](const Pose& pose, const CableVector& reading_N, const std::string& name) {
    require_tensions_of(effects_.robot(), reading_N, name);
    const double margin_N =
        margin_within_limits_N(effects_.robot(), effects_.tension_N(pose, reading_N), name);
    const std::optional<SetPoint> planned = effects_.as_planned({pose, reading_N});
    if (!planned) {
      throw InputError("plan: " + name +
                       ": its tensions do not hold the platform; make the plan anew");
    }
    options.tension_margin_N = std::min(options.tension_margin_N, margin_N);
    places.push_back(*planned);
    reading_N_.push_back(reading_N);
  };
  add(plan.start_pose, plan.start_tension_N, "the start");
  stop_of_place_.push_back(-1);
  for (std::size_t i = 0; i < plan.poses.size(); ++i) {
    if (!plan.poses[i].measured) continue;
    add(plan.poses[i].pose, plan.poses[i].tension_N, "stop " + std::to_string(i + 1));
    stop_of_place_.push_back(static_cast<int>(i));
  }
  checker_.emplace(solver_, options);
  timer_.emplace(*checker_);
  legs_ = std::make_unique<LegTable>(*checker_, *timer_, std::move(places), threads, progress);
}

std::size_t NextStopChooser::place_of(int stop) const {
  const auto found = std::find(stop_of_place_.begin() + 1, stop_of_place_.end(), stop);
  if (found == stop_of_place_.end()) {
    throw InputError("next stop: pose " + std::to_string(stop + 1) +
                     " of the plan is none that is measured; give one that is");
  }
  return static_cast<std::size_t>(found - stop_of_place_.begin());
}

StartUpPlan NextStopChooser::way(std::size_t from, std::size_t to) const {
  StartUpPlan out;
  for (const Leg& leg : legs_->way(static_cast<int>(from), static_cast<int>(to))) {
    const auto at = static_cast<std::size_t>(leg.to);
    const SetPoint& place = legs_->places()[at];
    out.setpoint_N.push_back(at < reading_N_.size() ? reading_N_[at]
                             : effects_.any() ? effects_.reading_N(place.pose, place.tension_N)
                                              : place.tension_N);
    out.transition_s.push_back(leg.timing.transition_s);
    out.via.push_back(at != to);
    if (holds_orientation(effects_.robot())) out.pose.push_back(place.pose);
  }
  return out;
}

template <class Gain>
std::optional<NextStop> NextStopChooser::best_stop(const std::vector<int>& measured,
                                                   Gain gain) const {
  if (stopped()) return std::nullopt;
  std::vector<bool> done(stop_of_place_.size(), false);
  std::size_t at = 0;
  for (const int stop : measured) done[at = place_of(stop)] = true;
  const Eigen::MatrixXd time_s = legs_->time_s();
  std::optional<NextStop> best;
  double best_rate = 0.0;
  std::size_t best_place = 0;
  for (std::size_t place = 1; place < stop_of_place_.size(); ++place) {
    const double needed_s = time_s(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(place));
    if (done[place] || !std::isfinite(needed_s) || !(needed_s > 0.0)) continue;
    NextStop next{stop_of_place_[place], {}, needed_s, Vector6::Constant(kNaN)};
    const std::optional<double> gained = gain(place, next);
    if (!gained || (best && !(*gained / needed_s > best_rate))) continue;
    best_rate = *gained / needed_s;
    best_place = place;
    best = std::move(next);
  }
  if (best) best->way = way(at, best_place);
  return best;
}

std::optional<NextStop> NextStopChooser::choose(const std::vector<int>& measured,
                                                const Pose& initial,
                                                const CableVector& initial_reading_N,
                                                const AskedAccuracy& asked) const {
  if (initial_reading_N.size() != effects_.robot().cable_count()) {
    throw InputError("initial_reading_N: give one value a cable");
  }
  if (stopped()) return std::nullopt;
  const CableVector tension_N =
      effects_.any() ? effects_.tension_N(initial, initial_reading_N) : initial_reading_N;
  const Observability observability(effects_.robot(), {initial, tension_N});
  Eigen::MatrixXd sum = observability.of_start();
  // τ0 itself is measured, before any stop.
  sum += observability.added_by(legs_->places().front());
  for (const int stop : measured) sum += observability.added_by(legs_->places()[place_of(stop)]);
  const double now = weighted_trace(covariance_of(sum), asked);
  return best_stop(measured, [&](std::size_t place, NextStop& next) -> std::optional<double> {
    const Matrix6 covariance = covariance_of(sum + observability.added_by(legs_->places()[place]));
    next.predicted_deviation = covariance.diagonal().cwiseSqrt();
    return std::log(now / weighted_trace(covariance, asked));
  });
}

std::optional<NextStop> NextStopChooser::choose(const std::vector<int>& measured,
                                                const std::vector<double>& worth) const {
  return best_stop(measured, [&](std::size_t place, NextStop&) -> std::optional<double> {
    const auto stop = static_cast<std::size_t>(stop_of_place_[place]);
    if (stop >= worth.size() || !(worth[stop] > 0.0)) return std::nullopt;
    return worth[stop];
  });
}

}  // namespace cdprcal
