#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/diagnosis/model.hpp"

namespace cdprcal {
namespace {

/// What the poses cannot explain, of all poses: residuals, and their derivatives by the nuisance
/// unknowns. One tall product costs less than many small ones.
struct Stacked {
  Eigen::VectorXd residual;
  Eigen::MatrixXd by_nuisance;
};

Stacked stacked(const DiagnosisSystem& system) {
  Eigen::Index rows = 0;
  for (const PoseSystem& pose : system.poses) rows += pose.reduced.size();
  Stacked out{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, system.layout.nuisance())};
  Eigen::Index row = 0;
  for (const PoseSystem& pose : system.poses) {
    const Eigen::Index count = pose.reduced.size();
    out.residual.segment(row, count) = pose.reduced;
    out.by_nuisance.middleRows(row, count) =
        pose.reduced_by_common.leftCols(system.layout.nuisance());
    row += count;
  }
  return out;
}

Eigen::MatrixXd information_of(const Stacked& rows, const DiagnosisSystem& system) {
  const Eigen::Index size = system.layout.nuisance();
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows.by_nuisance.transpose());
  hessian.triangularView<Eigen::StrictlyUpper>() = hessian.transpose();
  hessian.diagonal() += system.prior_precision;
  return hessian;
}

/// Normal equations of the nuisance unknowns with their prior.
void normal_equations(const DiagnosisSystem& system, Eigen::MatrixXd& hessian,
                      Eigen::VectorXd& gradient) {
  const Stacked rows = stacked(system);
  hessian = information_of(rows, system);
  gradient = rows.by_nuisance.transpose() * rows.residual;
  gradient += system.prior_precision.cwiseSqrt().cwiseProduct(system.prior_residual);
}

/// Moves the state by a step of the nuisance unknowns; poses follow.
void move(DiagnosisModel& model, const DiagnosisSystem& system, const Eigen::VectorXd& step,
          double fraction) {
  const int n = model.robot.cable_count();
  for (const PoseSystem& pose : system.poses) {
    const PoseRowValues rest =
        pose.residual + pose.by_common.leftCols(system.layout.nuisance()) * step;
    const Vector6 twist = -pose.factor.solve(rest);
    Pose& estimate = model.runs[pose.run].poses[pose.pose];
    estimate = plus(estimate, fraction * twist);
  }
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    model.runs[r].offsets +=
        fraction * step.segment(static_cast<Eigen::Index>(r) * (2 * n + 1), 2 * n + 1);
  }
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    model.effects[k].values +=
        fraction * step.segment(system.layout.accepted_begin[k], system.layout.accepted_size[k]);
  }
}

}  // namespace

Eigen::MatrixXd information(const DiagnosisSystem& system) {
  return information_of(stacked(system), system);
}

Eigen::MatrixXd covariance(const DiagnosisSystem& system) {
  return information(system).completeOrthogonalDecomposition().pseudoInverse();
}

double penalised_cost(const DiagnosisSystem& system) {
  double cost = 0.5 * system.prior_residual.squaredNorm();
  for (const PoseSystem& pose : system.poses) cost += 0.5 * pose.residual.squaredNorm();
  return cost;
}

bool fit(DiagnosisModel& model, int max_steps) {
  DiagnosisSystem system = linearise(model);
  if (!system.valid) return false;
  double cost = penalised_cost(system);
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  for (int iteration = 0; iteration < max_steps; ++iteration) {
    normal_equations(system, hessian, gradient);
    const Eigen::VectorXd step = -hessian.completeOrthogonalDecomposition().solve(gradient);
    const DiagnosisModel before = model;
    double fraction = 1.0;
    double trial_cost = cost;
    DiagnosisSystem trial;
    for (int halving = 0; halving < 12; ++halving, fraction *= 0.5) {
      model = before;
      move(model, system, step, fraction);
      trial = linearise(model);
      trial_cost = trial.valid ? penalised_cost(trial) : kNaN;
      if (trial_cost <= cost * (1.0 + 1e-12)) break;
    }
    if (!(trial_cost <= cost * (1.0 + 1e-12))) {
      model = before;
      // No descent along the Gauss–Newton step: at a minimum, but for what the derivatives leave
      // out (the balance's weight changes with the pose), if the step promised next to nothing, or
      // lost.
      constexpr double kNothing_nats = 0.01;  // 0.14 σ
      return -0.5 * step.dot(gradient) < kNothing_nats;
    }
    const double gain = cost - trial_cost;
    system = std::move(trial);
    cost = trial_cost;
    if (gain < 1e-9 * (1.0 + cost)) return true;
  }
  return false;
}

ChannelSums channel_sums(const DiagnosisSystem& system) {
  const Eigen::MatrixXd spread = covariance(system);
  const int size = system.layout.nuisance();
  ChannelSums sums;
  for (const PoseSystem& pose : system.poses) {
    const PoseProjection projection = pose.projection();
    const PoseRowValues residual = projection * pose.reduced;
    const Eigen::MatrixXd lifted = projection * pose.reduced_by_common.leftCols(size);
    const PoseRowValues taken = (lifted * spread).cwiseProduct(lifted).rowwise().sum();
    for (Eigen::Index row = 0; row < residual.size(); ++row) {
      const double freedom = projection.row(row).squaredNorm() - taken[row];
      const auto c = static_cast<std::size_t>(pose.channel[static_cast<std::size_t>(row)]);
      sums.freedom[c] += std::max(0.0, freedom);
      sums.squares[c] += residual[row] * residual[row];
    }
  }
  return sums;
}

void start_noise(DiagnosisModel& model, const std::array<double, kChannels>& ripple) {
  double samples = 0.0;
  int rests = 0;
  for (const DiagnosisRun& run : model.runs) {
    for (const Measurement& m : run.measurements) {
      if (m.kind == PoseKind::kinematic_pose && m.samples == 1) continue;
      samples += m.samples;
      ++rests;
    }
  }
  model.rest_samples = rests > 0 ? samples / rests : 1.0;
  const NoiseModel specified = specified_noise(model.robot.sigma);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double sigma = specified.channel[c].pose;
    const double least = 1e-3 * sigma;  // exact readings would be weighed infinitely
    const bool balance = c == static_cast<std::size_t>(NoiseGroup::balance);
    const double unit = balance ? sigma : 1.0;  // its level is relative to its covariance
    model.floor[c] = std::max(ripple[c] / std::sqrt(model.rest_samples), least) / unit;
    model.noise[c] = sigma / unit;
    if (!balance) {  // single readings in motion: groups of their own
      model.floor[c + kRestGroups] = std::max(ripple[c], least);
      model.noise[c + kRestGroups] = sigma;
    }
  }
}

double estimate_noise(DiagnosisModel& model) {
  const DiagnosisSystem system = linearise(model);
  if (!system.valid) return 0.0;
  const ChannelSums sums = channel_sums(system);
  double change = 0.0;
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (sums.freedom[c] < 1.0) continue;  // too few rows to say anything: keep what was assumed
    const double factor = std::sqrt(sums.squares[c] / sums.freedom[c]);
    const double level = std::max(model.floor[c], model.noise[c] * factor);
    change = std::max(change, std::abs(std::log(level / model.noise[c])));
    model.noise[c] = level;
  }
  return change;
}

bool fit_with_noise(DiagnosisModel& model) {
  constexpr int kMostRounds = 15;
  bool settled = false;
  for (int round = 0; round < kMostRounds; ++round) {
    settled = fit(model);
    // Of a fit that did not settle, too: its residuals tell how far it is off.
    const double change = estimate_noise(model);
    if (!settled || change < 0.01) break;
  }
  return settled;
}

}  // namespace cdprcal
