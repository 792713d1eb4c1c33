#include "cdprcal/diagnosis/separation.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

/// Share of the workspace's box that candidates come from, and their number along its sides.
constexpr double kShare = 0.7;
constexpr std::array<int, 3> kCounts{4, 4, 3};
/// A pose that adds less is not worth going to.
constexpr double kLeastGain = 0.5;

struct Candidate {
  SeparatingPose pose;
  Pose at;
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
          out.push_back(
              {{position_m, point.tension_N, from_above, 0.0}, {position_m, point.rotation}});
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
  const int n = model.robot.cable_count();
  Measurement m;
  m.kind = PoseKind::static_pose;
  m.samples = static_cast<int>(std::max(1.0, std::round(model.rest_samples)));
  m.run_time_s = m.time_s = time_s;
  m.tension_N = candidate.pose.tension_N;
  m.length_direction = m.swivel_direction =
      CableVector::Constant(n, candidate.pose.from_above ? 1.0 : -1.0);
  PoseEvaluation e;
  evaluate_pose(model.robot, m, candidate.at, StaticsModel::none, {}, {}, false, e);
  m.length_m = e.length_m + run.offsets.head(n);
  m.swivel_rad = e.swivel_rad + run.offsets.segment(n, n);
  m.roll_pitch_yaw_rad = e.roll_pitch_yaw_rad;
  m.roll_pitch_yaw_rad[2] += run.offsets[2 * n];
  return m;
}

/// Sums over poses of what decides between the two: half the squares of the true effect's signature
/// that nuisance and rival cannot take over.
struct Sums {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd cross;
  double squares = 0.0;

  void add(const Eigen::MatrixXd& columns, const Eigen::VectorXd& signature) {
    hessian.noalias() += columns.transpose() * columns;
    cross.noalias() += columns.transpose() * signature;
    squares += signature.squaredNorm();
  }
  [[nodiscard]] double nats() const {
    return 0.5 * std::max(0.0, squares - cross.dot(hessian.ldlt().solve(cross)));
  }
};

}  // namespace

Separation separating_poses(const DiagnosisModel& model, std::size_t k,
                            const std::shared_ptr<const Effect>& rival, int most) {
  const auto& truth = model.effects[k].effect;
  const EffectValues typical = truth->typical(model.robot);
  Eigen::VectorXd values = model.effects[k].values;
  for (Eigen::Index j = 0; j < values.size(); ++j) values[j] /= typical[j % typical.size()];

  DiagnosisModel extended = model;
  extended.effects.erase(extended.effects.begin() + static_cast<std::ptrdiff_t>(k));
  double last_s = 0.0;
  for (const Measurement& m : model.runs.front().measurements)
    last_s = std::max(last_s, m.run_time_s);
  const std::vector<Candidate> candidates = equilibria_of(model.robot);
  const std::size_t measured = extended.runs.front().measurements.size();
  for (const Candidate& candidate : candidates) {
    extended.runs.front().measurements.push_back(reading_at(model, candidate, last_s));
    extended.runs.front().rows.push_back({});
    extended.runs.front().poses.push_back(candidate.at);
  }
  Separation out;
  const DiagnosisSystem system = linearise(extended, {rival, truth});
  if (!system.valid) return out;
  const int known = system.layout.nuisance() + system.layout.candidate_size[0];
  Sums sums;
  sums.cross.setZero(known);
  sums.hessian.setZero(known, known);
  sums.hessian.diagonal().head(system.layout.nuisance()) = system.prior_precision;
  sums.hessian.diagonal().array() += 1e-9;  // an offset that no reading shows
  sums.hessian.diagonal().tail(system.layout.candidate_size[0]).array() += 1.0;
  std::vector<std::pair<Eigen::MatrixXd, Eigen::VectorXd>> offered;
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const auto rows = system.free_by_common.middleRows(pose.begin, pose.size);
    Eigen::MatrixXd columns = rows.leftCols(known);
    Eigen::VectorXd signature = rows.rightCols(system.layout.candidate_size[1]) * values;
    if (pose.run == 0 && pose.pose >= measured) {
      offered.emplace_back(std::move(columns), std::move(signature));
    } else {
      sums.add(columns, signature);
    }
  }
  out.nats = sums.nats();
  double reached = out.nats;
  while (static_cast<int>(out.poses.size()) < most) {
    std::size_t best = offered.size();
    double best_nats = reached + kLeastGain;
    for (std::size_t i = 0; i < offered.size(); ++i) {
      if (offered[i].second.size() == 0) continue;  // chosen already
      Sums with = sums;
      with.add(offered[i].first, offered[i].second);
      if (const double nats = with.nats(); nats > best_nats) best = i, best_nats = nats;
    }
    if (best == offered.size()) break;
    sums.add(offered[best].first, offered[best].second);
    offered[best].second.resize(0);
    reached = best_nats;
    out.poses.push_back(candidates[best].pose);
    out.poses.back().nats = best_nats;
  }
  return out;
}

}  // namespace cdprcal
