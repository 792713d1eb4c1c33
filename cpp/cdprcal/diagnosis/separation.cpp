#include "cdprcal/diagnosis/separation.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

/// Share of the workspace's box that candidates come from, and their number along its sides.
constexpr double kShare = 0.7;
constexpr std::array<int, 3> kCounts{4, 4, 3};
/// A pose that adds less is not worth going to.
constexpr double kLeastGain = 0.5;

/// A rest that might be added, with the way that cables and swivels turned on arriving.
struct Candidate {
  SeparatingPose pose;
  Pose at;
  CableVector length_direction, swivel_direction;
};

/// Equilibria with tensions of one distribution, each approached from both sides.
void add_equilibria(const Robot& robot, TensionDistribution distribution,
                    std::vector<Candidate>& out) {
  InverseOptions options;
  options.distribution = distribution;
  options.stability = StabilityNotion::constant_tensions;
  const InverseSolver solver(robot, options);
  const Box box = workspace_box(robot);
  const Vector3 middle = 0.5 * (box.lower_m + box.upper_m);
  const Vector3 half = 0.5 * kShare * (box.upper_m - box.lower_m);
  std::optional<Eigen::Quaterniond> last;
  for (int k = 0; k < kCounts[2]; ++k) {
    for (int j = 0; j < kCounts[1]; ++j) {
      for (int i = 0; i < kCounts[0]; ++i) {
        const Vector3 fraction(2.0 * i / (kCounts[0] - 1) - 1.0, 2.0 * j / (kCounts[1] - 1) - 1.0,
                               2.0 * k / (kCounts[2] - 1) - 1.0);
        const Vector3 position_m = middle + half.cwiseProduct(fraction);
        InverseSolver::Point point;
        if (last) point = solver.continue_from(position_m, *last);
        if (point.status != EquilibriumStatus::found) point = solver.solve(position_m);
        if (point.status != EquilibriumStatus::found) continue;
        last = point.rotation;
        for (const bool from_above : {true, false}) {
          const CableVector turned =
              CableVector::Constant(robot.cable_count(), from_above ? 1 : -1);
          out.push_back({{position_m, point.tension_N, from_above, 0.0},
                         {position_m, point.rotation},
                         turned,
                         turned});
        }
      }
    }
  }
}

std::vector<Candidate> equilibria_of(const Robot& robot) {
  std::vector<Candidate> out;
  const int n = robot.cable_count();
  if (n < 3 || n > 5) return out;
  add_equilibria(robot, TensionDistribution::barycentre, out);
  // Some effects grow with the tension and some do not: another level tells them apart.
  if (n > 3) add_equilibria(robot, TensionDistribution::mid_range, out);
  return out;
}

/// What would be read at a candidate, without noise.
Measurement reading_at(const DiagnosisModel& model, const Candidate& candidate, double time_s) {
  const DiagnosisRun& run = model.runs.front();
  Measurement m;
  m.kind = PoseKind::static_pose;
  m.samples = static_cast<int>(std::max(1.0, std::round(model.rest_samples)));
  m.run_time_s = m.time_s = time_s;
  m.tension_N = candidate.pose.tension_N;
  m.length_direction = candidate.length_direction;
  m.swivel_direction = candidate.swivel_direction;
  const int n = model.robot.cable_count();
  PoseEvaluation e;
  evaluate_geometry(model.robot, platform_state(model.robot, candidate.at), candidate.at, false, e);
  m.length_m = e.length_m + run.offsets.head(n);
  m.swivel_rad = e.swivel_rad + run.offsets.segment(n, n);
  m.roll_pitch_yaw_rad = e.roll_pitch_yaw_rad;
  m.roll_pitch_yaw_rad[2] += run.offsets[2 * n];
  return m;
}

/// Sums over poses of what decides between the two: half the squares of the true effect's signature
/// that nuisance and rival cannot take over.
struct Sums {
  Eigen::MatrixXd hessian;  ///< with the priors of nuisance and rival
  Eigen::VectorXd prior, cross;
  double squares = 0.0;
  Eigen::Index nuisance = 0;  ///< the first of the columns

  void add(const Eigen::MatrixXd& columns, const Eigen::VectorXd& signature) {
    hessian.noalias() += columns.transpose() * columns;
    cross.noalias() += columns.transpose() * signature;
    squares += signature.squaredNorm();
  }
  [[nodiscard]] double nats() const {
    return 0.5 * std::max(0.0, squares - cross.dot(solve_symmetric(hessian, cross)));
  }
  /// Of what nuisance leaves of the signature, the share that the rival does too.
  [[nodiscard]] double imitated() const {
    const auto left_by = [&](Eigen::Index columns) {
      const Eigen::MatrixXd h = hessian.topLeftCorner(columns, columns);
      const Eigen::VectorXd value = solve_symmetric(h, cross.head(columns).eval());
      return squares - 2.0 * cross.head(columns).dot(value) + value.dot(h * value) -
             value.dot(prior.head(columns).cwiseProduct(value));
    };
    const double total = left_by(nuisance);
    return total > 0.0 ? 1.0 - left_by(cross.size()) / total : 1.0;
  }
};

/// What the log, and rests that might be added to it, tell between an effect of a model and a
/// rival.
class Rivalry {
 public:
  Rivalry(const DiagnosisModel& model, std::size_t k, const std::shared_ptr<const Effect>& rival,
          const std::vector<Candidate>& candidates) {
    const auto& truth = model.effects[k].effect;
    const EffectValues typical = truth->typical(model.robot);
    Eigen::VectorXd values = model.effects[k].values;
    for (Eigen::Index j = 0; j < values.size(); ++j) values[j] /= typical[j % typical.size()];

    DiagnosisModel extended = model;
    extended.effects.erase(extended.effects.begin() + static_cast<std::ptrdiff_t>(k));
    DiagnosisRun& run = extended.runs.front();
    double last_s = 0.0;
    for (const Measurement& m : run.measurements) last_s = std::max(last_s, m.run_time_s);
    const std::size_t measured = run.measurements.size();
    for (const Candidate& candidate : candidates) {
      run.measurements.push_back(reading_at(model, candidate, last_s));
      run.rows.push_back({});
      run.poses.push_back(candidate.at);
    }
    const DiagnosisSystem system = linearise(extended, {rival, truth});
    if (!system.valid) return;
    const int known = system.layout.nuisance() + system.layout.candidate_size[0];
    sums_.nuisance = system.layout.nuisance();
    sums_.cross.setZero(known);
    sums_.prior.setOnes(known);  // a candidate's values count in typical sizes
    sums_.prior.head(sums_.nuisance) = system.prior_precision;
    sums_.prior.array() += 1e-9;  // an offset that no reading shows
    sums_.hessian = sums_.prior.asDiagonal();
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      const auto rows = system.free_by_common.middleRows(pose.begin, pose.size);
      Eigen::MatrixXd columns = rows.leftCols(known);
      Eigen::VectorXd signature = rows.rightCols(system.layout.candidate_size[1]) * values;
      if (pose.run == 0 && pose.pose >= measured) {
        offered_.emplace_back(std::move(columns), std::move(signature));
      } else {
        sums_.add(columns, signature);
      }
    }
  }
  /// Of the candidates; 0 where the model cannot be evaluated.
  [[nodiscard]] std::size_t count() const { return offered_.size(); }
  /// Expected evidence, with what was taken.
  [[nodiscard]] double nats() const { return sums_.hessian.size() > 0 ? sums_.nats() : 0.0; }
  [[nodiscard]] double nats_with(std::size_t i) const {
    Sums with = sums_;
    with.add(offered_[i].first, offered_[i].second);
    return with.nats();
  }
  [[nodiscard]] double imitated() const {
    return sums_.hessian.size() > 0 ? sums_.imitated() : 1.0;
  }
  void take(std::size_t i) { sums_.add(offered_[i].first, offered_[i].second); }

 private:
  Sums sums_;
  std::vector<std::pair<Eigen::MatrixXd, Eigen::VectorXd>> offered_;
};

/// −1, 0 or 1 where a reading falls, stays or grows.
CableVector turned(const CableVector& from, const CableVector& to) {
  CableVector out(to.size());
  for (Eigen::Index i = 0; i < to.size(); ++i) {
    const double by = to[i] - from[i];
    out[i] = by > 0.0 ? 1.0 : by < 0.0 ? -1.0 : 0.0;
  }
  return out;
}

}  // namespace

Separation separating_poses(const DiagnosisModel& model, std::size_t k,
                            const std::shared_ptr<const Effect>& rival, int most) {
  const std::vector<Candidate> candidates = equilibria_of(model.robot);
  Rivalry rivalry(model, k, rival, candidates);
  Separation out;
  out.nats = rivalry.nats();
  double reached = out.nats;
  std::vector<bool> taken(rivalry.count(), false);
  while (static_cast<int>(out.poses.size()) < most) {
    std::size_t best = rivalry.count();
    double best_nats = reached + kLeastGain;
    for (std::size_t i = 0; i < rivalry.count(); ++i) {
      if (taken[i]) continue;
      if (const double nats = rivalry.nats_with(i); nats > best_nats) best = i, best_nats = nats;
    }
    if (best == rivalry.count()) break;
    rivalry.take(best);
    taken[best] = true;
    reached = best_nats;
    out.poses.push_back(candidates[best].pose);
    out.poses.back().nats = best_nats;
  }
  return out;
}

StopSeparation separation_by_stops(const DiagnosisModel& model, std::size_t k,
                                   const std::shared_ptr<const Effect>& rival,
                                   const std::vector<OfferedRest>& stops) {
  const DiagnosisRun& run = model.runs.front();
  const PlatformState last = platform_state(model.robot, run.poses.back());
  std::vector<Candidate> candidates;
  for (const OfferedRest& stop : stops) {
    const PlatformState there = platform_state(model.robot, stop.pose);
    candidates.push_back({{stop.pose.position_m, stop.tension_N, false, 0.0},
                          stop.pose,
                          turned(last.length_m(), there.length_m()),
                          turned(last.swivel_rad(), there.swivel_rad())});
  }
  Rivalry rivalry(model, k, rival, candidates);
  StopSeparation out;
  out.nats = rivalry.nats();
  out.nats_with.assign(stops.size(), out.nats);
  for (std::size_t i = 0; i < rivalry.count(); ++i) out.nats_with[i] = rivalry.nats_with(i);
  for (std::size_t i = 0; i < rivalry.count(); ++i) rivalry.take(i);
  out.nats_with_all = rivalry.nats();
  out.apart_with_all = told_apart(out.nats_with_all, rivalry.imitated());
  return out;
}

}  // namespace cdprcal
