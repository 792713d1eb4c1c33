#include "cdprcal/diagnosis/model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/calibration/pose_cache.hpp"

namespace cdprcal {
namespace {

CommonLayout layout_of(const DiagnosisModel& model, const Candidates& candidates) {
  const int n = model.robot.cable_count();
  const int runs = static_cast<int>(model.runs.size());
  CommonLayout layout;
  layout.offsets = (2 * n + 1) * runs;
  int column = layout.offsets;
  for (const EffectTerm& term : model.effects) {
    layout.accepted_begin.push_back(column);
    layout.accepted_size.push_back(static_cast<int>(term.values.size()));
    column += layout.accepted_size.back();
  }
  layout.accepted = column - layout.offsets;
  for (const auto& effect : candidates) {
    const bool by_run = effect->info().scope == EffectScope::run;
    layout.candidate_begin.push_back(column);
    layout.candidate_size.push_back(effect->size(n) * (by_run ? runs : 1));
    column += layout.candidate_size.back();
  }
  layout.candidates = column - layout.nuisance();
  return layout;
}

/// All rows of one pose before whitening: residual, by pose, by common unknowns.
struct RawRows {
  Eigen::VectorXd residual;
  Eigen::MatrixXd by_pose, by_common;
};

RawRows raw_rows(const DiagnosisModel& model, const Robot& robot, const ActiveEffects& active,
                 const CommonLayout& layout, const Candidates& candidates, std::size_t run_index,
                 const Measurement& m, const Pose& pose, bool rests, bool& valid) {
  const int n = robot.cable_count();
  const ReadingRows rows{n};
  const DiagnosisRun& run = model.runs[run_index];
  RawRows out;
  PoseEvaluation e;
  evaluate_pose(robot, m, pose, rests ? StaticsModel::wrench : StaticsModel::none, {}, active, true,
                e);
  valid = e.valid;
  if (!valid) return out;
  out.residual.setConstant(rows.size(), kNaN);
  out.by_pose.setZero(rows.size(), 6);
  out.by_common.setZero(rows.size(), layout.size());
  const int offset = static_cast<int>(run_index) * (2 * n + 1);
  for (int i = 0; i < n; ++i) {
    out.residual[i] = e.length_m[i] + run.offsets[i] - m.length_m[i];
    const double swivel = e.swivel_rad[i] + run.offsets[n + i] - m.swivel_rad[i];
    out.residual[n + i] = std::isfinite(swivel) ? wrap_angle(swivel) : kNaN;
    out.by_common(i, offset + i) = 1.0;
    out.by_common(n + i, offset + n + i) = 1.0;
  }
  for (int a = 0; a < 3; ++a) {
    double angle = e.roll_pitch_yaw_rad[a] - m.roll_pitch_yaw_rad[a];
    if (a == 2) angle += run.offsets[2 * n];
    out.residual[rows.attitude() + a] = std::isfinite(angle) ? wrap_angle(angle) : kNaN;
  }
  out.by_common(rows.attitude() + 2, offset + 2 * n) = 1.0;
  out.by_pose.topRows(n) = e.length_by_twist;
  out.by_pose.middleRows(n, n) = e.swivel_by_twist;
  out.by_pose.middleRows<3>(rows.attitude()) = e.attitude_by_twist;
  if (rests) {
    out.residual.tail<6>() = e.wrench;
    out.by_pose.bottomRows<6>() = e.wrench_by_twist;
  }
  const PlatformState state = platform_state(robot, pose);
  const EffectContext context{robot, state, pose, m};
  Eigen::MatrixXd columns;
  const auto place = [&](const Effect& effect, const EffectValues& values, int begin,
                         const EffectValues* scale) {
    const int size = effect.size(n);
    columns.setZero(rows.size(), size);
    effect.columns(context, values, columns);
    if (scale != nullptr) columns = (columns * scale->asDiagonal()).eval();
    if (effect.info().scope == EffectScope::run) begin += size * static_cast<int>(run_index);
    out.by_common.middleCols(begin, size) += columns;
  };
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    place(*active[k].effect, active[k].values, layout.accepted_begin[k], nullptr);
  }
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const EffectValues scale = candidates[k]->typical(n);
    place(*candidates[k], EffectValues::Zero(scale.size()), layout.candidate_begin[k], &scale);
  }
  return out;
}

/// Keeps the rows that carry a reading, whitens them and projects them off the pose.
PoseSystem whiten(const DiagnosisModel& model, const Robot& robot, RawRows raw, const Pose& pose,
                  bool rests) {
  const int n = robot.cable_count();
  const ReadingRows rows{n};
  PoseSystem out;
  Eigen::VectorXd sigma(rows.size());
  const auto level = [&](Channel c) { return model.noise[static_cast<std::size_t>(c)]; };
  sigma.head(n).setConstant(level(Channel::length));
  sigma.segment(n, n).setConstant(level(Channel::swivel));
  sigma.segment<2>(rows.attitude()).setConstant(level(Channel::roll_pitch));
  sigma[rows.attitude() + 2] = level(Channel::yaw);
  sigma.tail<6>().setConstant(level(Channel::balance));
  if (rests) {
    const Matrix6 root =
        balance_root(platform_state(robot, pose), robot.sigma.tension_N, robot.sigma);
    const auto lower = root.triangularView<Eigen::Lower>();
    raw.residual.tail<6>() = lower.solve(raw.residual.tail<6>()).eval();
    raw.by_pose.bottomRows<6>() = lower.solve(raw.by_pose.bottomRows<6>()).eval();
    raw.by_common.bottomRows<6>() = lower.solve(raw.by_common.bottomRows<6>()).eval();
  }
  std::vector<int> kept;
  for (int row = 0; row < rows.size(); ++row) {
    if (!std::isfinite(raw.residual[row])) continue;
    kept.push_back(row);
    if (row < n) {
      out.channel.push_back(Channel::length), out.component.push_back(row);
    } else if (row < 2 * n) {
      out.channel.push_back(Channel::swivel), out.component.push_back(row - n);
    } else if (row < rows.attitude() + 2) {
      out.channel.push_back(Channel::roll_pitch), out.component.push_back(row - rows.attitude());
    } else if (row == rows.attitude() + 2) {
      out.channel.push_back(Channel::yaw), out.component.push_back(2);
    } else {
      out.channel.push_back(Channel::balance), out.component.push_back(row - rows.wrench());
    }
  }
  const auto m = static_cast<Eigen::Index>(kept.size());
  out.residual.resize(m);
  out.scale.resize(m);
  out.by_pose.resize(m, 6);
  out.by_common.resize(m, raw.by_common.cols());
  for (Eigen::Index i = 0; i < m; ++i) {
    const int row = kept[static_cast<std::size_t>(i)];
    const double weight = 1.0 / sigma[row];
    out.scale[i] = sigma[row];
    out.residual[i] = weight * raw.residual[row];
    out.by_pose.row(i) = weight * raw.by_pose.row(row);
    out.by_common.row(i) = weight * raw.by_common.row(row);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(out.by_pose);
  const Eigen::Index rank = qr.rank();
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(m, m);
  out.projection = q.rightCols(m - rank);
  out.reduced = out.projection.transpose() * out.residual;
  out.reduced_by_common = out.projection.transpose() * out.by_common;
  return out;
}

/// Normal equations of the nuisance unknowns with their prior.
void normal_equations(const DiagnosisSystem& system, Eigen::MatrixXd& hessian,
                      Eigen::VectorXd& gradient) {
  const int size = system.layout.nuisance();
  hessian.setZero(size, size);
  gradient.setZero(size);
  for (const PoseSystem& pose : system.poses) {
    const auto columns = pose.reduced_by_common.leftCols(size);
    hessian.noalias() += columns.transpose() * columns;
    gradient.noalias() += columns.transpose() * pose.reduced;
  }
  hessian.diagonal() += system.prior_precision;
  gradient += system.prior_precision.cwiseSqrt().cwiseProduct(system.prior_residual);
}

/// Moves the state by a step of the nuisance unknowns; poses follow.
void move(DiagnosisModel& model, const DiagnosisSystem& system, const Eigen::VectorXd& step,
          double fraction) {
  const int n = model.robot.cable_count();
  for (const PoseSystem& pose : system.poses) {
    const Eigen::VectorXd rest =
        pose.residual + pose.by_common.leftCols(system.layout.nuisance()) * step;
    const Vector6 twist = -pose.by_pose.colPivHouseholderQr().solve(rest);
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

int DiagnosisModel::pose_count() const {
  std::size_t count = 0;
  for (const DiagnosisRun& run : runs) count += run.poses.size();
  return static_cast<int>(count);
}

ActiveEffects DiagnosisModel::active(std::size_t run) const {
  ActiveEffects out;
  const int n = robot.cable_count();
  for (const EffectTerm& term : effects) {
    const int size = term.effect->size(n);
    const auto begin = term.by_run() ? static_cast<Eigen::Index>(run) * size : 0;
    out.push_back({term.effect, term.values.segment(begin, size)});
  }
  const ActiveEffects& known = runs[run].known;
  out.insert(out.end(), known.begin(), known.end());
  return out;
}

DiagnosisSystem linearise(const DiagnosisModel& model, const Candidates& candidates) {
  DiagnosisSystem system;
  system.layout = layout_of(model, candidates);
  const int n = model.robot.cable_count();
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const ActiveEffects active = model.active(r);
    const Robot robot = with_effects(model.robot, active);
    const DiagnosisRun& run = model.runs[r];
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      const bool rests = m.kind == PoseKind::static_pose && m.tension_N.allFinite();
      bool valid = true;
      RawRows raw = raw_rows(model, robot, active, system.layout, candidates, r, m, run.poses[i],
                             rests, valid);
      if (!valid) {
        system.valid = false;
        return system;
      }
      system.poses.push_back(whiten(model, robot, std::move(raw), run.poses[i], rests));
      system.poses.back().run = r;
      system.poses.back().pose = i;
    }
  }
  system.prior_precision.setZero(system.layout.nuisance());
  system.prior_residual.setZero(system.layout.nuisance());
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    const EffectTerm& term = model.effects[k];
    const EffectValues typical = term.effect->typical(n);
    for (Eigen::Index j = 0; j < term.values.size(); ++j) {
      const double sigma = typical[j % typical.size()];
      system.prior_precision[system.layout.accepted_begin[k] + j] = 1.0 / (sigma * sigma);
      system.prior_residual[system.layout.accepted_begin[k] + j] = term.values[j] / sigma;
    }
  }
  return system;
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
      // No descent along the Gauss–Newton step: at a minimum to rounding, or lost.
      return iteration > 0;
    }
    const double gain = cost - trial_cost;
    system = std::move(trial);
    cost = trial_cost;
    if (gain < 1e-9 * (1.0 + cost)) return true;
  }
  return false;
}

ChannelSums channel_sums(const DiagnosisSystem& system) {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  normal_equations(system, hessian, gradient);
  const Eigen::MatrixXd covariance = hessian.completeOrthogonalDecomposition().pseudoInverse();
  const int size = system.layout.nuisance();
  ChannelSums sums;
  for (const PoseSystem& pose : system.poses) {
    const Eigen::VectorXd residual = pose.projection * pose.reduced;
    const Eigen::MatrixXd lifted = pose.projection * pose.reduced_by_common.leftCols(size);
    for (Eigen::Index row = 0; row < residual.size(); ++row) {
      const double freedom = pose.projection.row(row).squaredNorm() -
                             lifted.row(row) * covariance * lifted.row(row).transpose();
      const auto c = static_cast<std::size_t>(pose.channel[static_cast<std::size_t>(row)]);
      sums.freedom[c] += std::max(0.0, freedom);
      sums.squares[c] += residual[row] * residual[row];
    }
  }
  return sums;
}

double estimate_noise(DiagnosisModel& model) {
  const DiagnosisSystem system = linearise(model);
  if (!system.valid) return 0.0;
  const ChannelSums sums = channel_sums(system);
  double change = 0.0;
  for (std::size_t c = 0; c < kChannels; ++c) {
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
    if (!settled || estimate_noise(model) < 0.01) break;
  }
  return settled;
}

}  // namespace cdprcal
