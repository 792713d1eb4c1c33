#include "cdprcal/diagnosis/held_out.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/symmetric_inverse.hpp"
#include "cdprcal/evidence/steps.hpp"

namespace cdprcal {
namespace {

using Folds = std::vector<int>;  ///< fold of each pose of the system
constexpr int kNeverHeldOut = -1;

/// Equal shares of the poses in the order of `key`.
Folds split(const Eigen::VectorXd& key, int folds) {
  const auto count = static_cast<std::size_t>(key.size());
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return key[static_cast<Eigen::Index>(a)] < key[static_cast<Eigen::Index>(b)];
  });
  Folds out(count);
  for (std::size_t i = 0; i < count; ++i) {
    out[order[i]] = static_cast<int>(i * static_cast<std::size_t>(folds) / count);
  }
  return out;
}

std::vector<Folds> partitions(const DiagnosisModel& model, const DiagnosisSystem& system,
                              HeldOutPart part) {
  constexpr int kFolds = 4;
  if (part == HeldOutPart::log) {
    Folds by_log;
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      by_log.push_back(static_cast<int>(pose.run));
    }
    return {by_log};
  }
  const auto count = static_cast<Eigen::Index>(system.poses.size());
  Eigen::Matrix<double, Eigen::Dynamic, 3> position(count, 3);
  std::vector<std::vector<double>> time(model.runs.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const DiagnosisSystem::PoseRange& pose = system.poses[static_cast<std::size_t>(i)];
    const DiagnosisRun& run = model.runs[pose.run];
    time[pose.run].push_back(run.measurements[pose.pose].run_time_s);
    position.row(i) = run.poses[pose.pose].position_m;
  }
  Folds by_time;  // a quarter of each log: what is of one log is told by the rest of it
  for (const std::vector<double>& own : time) {
    const auto size = static_cast<Eigen::Index>(own.size());
    const Folds folds = split(Eigen::Map<const Eigen::VectorXd>(own.data(), size), kFolds);
    by_time.insert(by_time.end(), folds.begin(), folds.end());
  }
  const Eigen::RowVector3d mean = position.colwise().mean();
  const Matrix3 scatter = (position.rowwise() - mean).transpose() * (position.rowwise() - mean);
  const SymmetricEigen<Matrix3> axes(scatter);
  return {std::move(by_time), split(position * axes.eigenvectors().col(2), kFolds)};
}

/// No other rest tells what happened at one that a step parts from them: it is always fitted.
void keep_parted(const DiagnosisModel& model, const DiagnosisSystem& system, Folds& folds) {
  for (const EffectTerm& term : model.effects) {
    const std::optional<Step> step = as_step(*term.effect);
    if (!step || !step->parts_a_rest) continue;
    for (std::size_t i = 0; i < folds.size(); ++i) {
      const DiagnosisSystem::PoseRange& pose = system.poses[i];
      const Measurement& m = model.runs[pose.run].measurements[pose.pose];
      if (m.run_time_s <= step->time_s) folds[i] = kNeverHeldOut;
    }
  }
}

struct FoldSums {
  Eigen::VectorXd per_pose;  ///< ½ Σ squares of each held-out pose
  NoiseLevels train{}, held{}, train_freedom{}, held_freedom{};
};

void add_channels(const DiagnosisSystem& system, const DiagnosisSystem::PoseRange& pose,
                  const Eigen::VectorXd& left, NoiseLevels& squares, NoiseLevels& freedom) {
  for (Eigen::Index i = 0; i < pose.size; ++i) {
    const SystemRow& row = system.rows[static_cast<std::size_t>(pose.begin + i)];
    const auto c = static_cast<std::size_t>(row.channel);
    squares[c] += std::pow(left[i] * row.scale, 2);
    freedom[c] += system.freedom[pose.begin + i];
  }
}

/// The normal equations of some poses' rows.
struct Normal {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
};
template <class Take>
Normal normal_of(const DiagnosisSystem& system, Take take) {
  const int size = system.layout.nuisance();
  Normal out{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  for (std::size_t i = 0; i < system.poses.size(); ++i) {
    if (!take(i)) continue;
    const DiagnosisSystem::PoseRange& pose = system.poses[i];
    const auto columns = system.free_by_common.middleRows(pose.begin, pose.size);
    out.hessian.noalias() += columns.transpose() * columns;
    out.gradient.noalias() +=
        columns.transpose() * system.free_residual.segment(pose.begin, pose.size);
  }
  return out;
}

/// The step of the common unknowns that all folds but one ask for. What only that one tells (the
/// offsets of a log that is held out whole) it tells itself.
Eigen::VectorXd step_without(const DiagnosisSystem& system, const Folds& folds, int fold) {
  const Normal train = normal_of(system, [&](std::size_t i) { return folds[i] != fold; });
  const Eigen::VectorXd prior =
      system.prior_precision.cwiseSqrt().cwiseProduct(system.prior_residual);
  Eigen::MatrixXd hessian = train.hessian;
  hessian.diagonal() += system.prior_precision;
  Eigen::VectorXd step = -symmetric_inverse(hessian) * (train.gradient + prior);
  std::vector<Eigen::Index> own;
  for (Eigen::Index j = 0; j < step.size(); ++j) {
    if (!(train.hessian(j, j) > 0.0)) own.push_back(j);
  }
  if (own.empty()) return step;
  const Normal held = normal_of(system, [&](std::size_t i) { return folds[i] == fold; });
  step(own).setZero();
  Eigen::MatrixXd of_own = held.hessian(own, own);
  of_own.diagonal() += system.prior_precision(own);
  const Eigen::VectorXd left = held.gradient + held.hessian * step + prior;
  step(own) = -symmetric_inverse(of_own) * left(own);
  return step;
}

/// Fits the common unknowns on all folds but one at a time, and looks at the one left out.
FoldSums cross_validate(const DiagnosisSystem& system, const Folds& folds) {
  const int fold_count = *std::max_element(folds.begin(), folds.end()) + 1;
  FoldSums out;
  out.per_pose.setZero(static_cast<Eigen::Index>(system.poses.size()));
  for (int fold = 0; fold < fold_count; ++fold) {
    const Eigen::VectorXd step = step_without(system, folds, fold);
    for (std::size_t i = 0; i < system.poses.size(); ++i) {
      const DiagnosisSystem::PoseRange& pose = system.poses[i];
      const Eigen::VectorXd left = system.free_residual.segment(pose.begin, pose.size) +
                                   system.free_by_common.middleRows(pose.begin, pose.size) * step;
      if (folds[i] == fold) {
        out.per_pose[static_cast<Eigen::Index>(i)] = 0.5 * left.squaredNorm();
        add_channels(system, pose, left, out.held, out.held_freedom);
      } else {
        add_channels(system, pose, left, out.train, out.train_freedom);
      }
    }
  }
  return out;
}

}  // namespace

HeldOut held_out(const DiagnosisModel& before, const DiagnosisModel& after, HeldOutPart part) {
  DiagnosisModel plain = before;
  plain.noise = after.noise;  // one yardstick for both
  const DiagnosisSystem system_before = linearise(plain);
  const DiagnosisSystem system_after = linearise(after);
  HeldOut out;
  if (!system_before.valid || !system_after.valid) return out;
  NoiseLevels train{}, held{}, train_freedom{}, held_freedom{};
  double gain_variance = 0.0;
  std::vector<Folds> both = partitions(after, system_after, part);
  for (Folds& folds : both) keep_parted(after, system_after, folds);
  for (const Folds& partition : both) {
    const FoldSums a = cross_validate(system_before, partition);
    const FoldSums b = cross_validate(system_after, partition);
    const double share = 1.0 / static_cast<double>(both.size());
    const auto count = static_cast<double>(a.per_pose.size());
    const Eigen::VectorXd difference = a.per_pose - b.per_pose;
    out.before += share * a.per_pose.mean();
    out.after += share * b.per_pose.mean();
    out.gain += share * difference.sum();
    const double variance =
        (difference.array() - difference.mean()).square().sum() / std::max(1.0, count - 1.0);
    gain_variance += share * count * variance;
    for (std::size_t c = 0; c < kNoiseGroups; ++c) {
      train[c] += b.train[c];
      held[c] += b.held[c];
      train_freedom[c] += b.train_freedom[c];
      held_freedom[c] += b.held_freedom[c];
    }
  }
  out.gain_error = std::sqrt(gain_variance);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    // Balance rows are whitened by the load cells' σ: back to newtons.
    const double unit = noise_unit(after.robot, static_cast<NoiseGroup>(c));
    out.train_rms[c] = train_freedom[c] > 0 ? unit * std::sqrt(train[c] / train_freedom[c]) : kNaN;
    out.held_out_rms[c] = held_freedom[c] > 0 ? unit * std::sqrt(held[c] / held_freedom[c]) : kNaN;
  }
  return out;
}

}  // namespace cdprcal
