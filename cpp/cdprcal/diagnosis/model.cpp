#include "cdprcal/diagnosis/model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <utility>

#include "cdprcal/estimation/balance_roots.hpp"

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

/// The rows of a pose: those that effects know, then, where there is any, what absolute sensors
/// read.
struct PoseLayout {
  ReadingRows readings;
  bool absolute;
  explicit PoseLayout(const Measurement& m, int cables)
      : readings{cables},
        absolute(std::isfinite(m.absolute_yaw_rad) || m.direct_length_m.array().isFinite().any() ||
                 m.position_m.array().isFinite().any()) {}
  [[nodiscard]] int absolute_yaw() const { return readings.size(); }
  [[nodiscard]] int direct_length() const { return absolute_yaw() + 1; }
  [[nodiscard]] int position() const { return direct_length() + readings.cables; }
  [[nodiscard]] int size() const { return absolute ? position() + 3 : readings.size(); }

  /// What a row is: its group at rest, and which cable, angle, axis or wrench row.
  [[nodiscard]] std::pair<NoiseGroup, int> meaning(int row) const {
    if (row < readings.swivel()) return {NoiseGroup::length, row};
    if (row < readings.attitude()) return {NoiseGroup::swivel, row - readings.swivel()};
    if (row < readings.wrench()) {
      const int angle = row - readings.attitude();
      return {angle == 2 ? NoiseGroup::yaw : NoiseGroup::roll_pitch, angle};
    }
    if (row < readings.size()) return {NoiseGroup::balance, row - readings.wrench()};
    if (row < direct_length()) return {NoiseGroup::absolute_yaw, 2};
    if (row < position()) return {NoiseGroup::direct_length, row - direct_length()};
    return {NoiseGroup::position, row - position()};
  }
};

/// All rows of one pose before whitening: residual, by pose, by common unknowns.
struct RawRows {
  PoseRowValues residual;
  PoseRowsByTwist by_pose;
  Eigen::MatrixXd by_common;
};

RawRows raw_rows(const DiagnosisModel& model, const Robot& robot, const ActiveEffects& active,
                 const CommonLayout& layout, const Candidates& candidates, std::size_t run_index,
                 const Measurement& m, const Pose& pose, const PlatformState& state, bool rests,
                 bool& valid) {
  const int n = robot.cable_count();
  const PoseLayout all(m, n);
  const ReadingRows& rows = all.readings;
  const DiagnosisRun& run = model.runs[run_index];
  RawRows out;
  PoseEvaluation e;
  evaluate_pose(robot, m, pose, rests ? StaticsModel::wrench : StaticsModel::none, {}, active, true,
                e);
  valid = e.valid;
  if (!valid) return out;
  out.residual.setConstant(all.size(), kNaN);
  out.by_pose.setZero(all.size(), 6);
  out.by_common.setZero(all.size(), layout.size());
  const int offset = static_cast<int>(run_index) * (2 * n + 1);
  for (int i = 0; i < n; ++i) {
    out.residual[i] = e.length_m[i] + run.offsets[i] - m.length_m[i];
    const double swivel = e.swivel_rad[i] + run.offsets[n + i] - m.swivel_rad[i];
    out.residual[n + i] = wrap_angle(swivel);
    out.by_common(i, offset + i) = 1.0;
    out.by_common(n + i, offset + n + i) = 1.0;
  }
  for (int a = 0; a < 3; ++a) {
    double angle = e.roll_pitch_yaw_rad[a] - m.roll_pitch_yaw_rad[a];
    if (a == 2) angle += run.offsets[2 * n];
    out.residual[rows.attitude() + a] = wrap_angle(angle);
  }
  out.by_common(rows.attitude() + 2, offset + 2 * n) = 1.0;
  out.by_pose.topRows(n) = e.length_by_twist;
  out.by_pose.middleRows(n, n) = e.swivel_by_twist;
  out.by_pose.middleRows<3>(rows.attitude()) = e.attitude_by_twist;
  if (rests) {
    out.residual.segment<6>(rows.wrench()) = e.wrench;
    out.by_pose.middleRows<6>(rows.wrench()) = e.wrench_by_twist;
  }
  if (all.absolute) {
    const double yaw = e.absolute_yaw_rad - m.absolute_yaw_rad;
    out.residual[all.absolute_yaw()] = wrap_angle(yaw);
    out.by_pose.row(all.absolute_yaw()) = e.absolute_yaw_by_twist;
    if (m.direct_length_m.size() == n) {
      out.residual.segment(all.direct_length(), n) = e.direct_length_m - m.direct_length_m;
    }
    out.by_pose.middleRows(all.direct_length(), n) = e.direct_length_by_twist;
    out.residual.segment<3>(all.position()) = pose.position_m - m.position_m;
    out.by_pose.block<3, 3>(all.position(), 0).setIdentity();
  }
  const EffectContext context{robot, state, pose, m, rests ? e.tension_N : m.tension_N};
  Eigen::MatrixXd columns;
  const auto place = [&](const Effect& effect, const EffectValues& values, int begin,
                         const EffectValues* scale) {
    const int size = effect.size(n);
    columns.setZero(rows.size(), size);
    effect.columns(context, values, columns);
    if (scale != nullptr) columns.array().rowwise() *= scale->transpose().array();
    if (effect.info().scope == EffectScope::run) begin += size * static_cast<int>(run_index);
    out.by_common.block(0, begin, rows.size(), size) += columns;
    if (all.absolute && effect.moves_cables()) {
      out.by_common.block(all.direct_length(), begin, n, size) +=
          columns.middleRows(rows.length(), n);
    }
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

/// σ of one reading of a channel. The part of a mean's noise that is the readings' own ripple falls
/// with their number; what is beyond it (the model's errors) does not.
double row_noise(const DiagnosisModel& model, NoiseGroup channel, const Measurement& m) {
  const auto c = static_cast<std::size_t>(channel);
  const double level = model.noise.at(c);
  if (c >= kRestGroups) return level;
  const double ripple = std::min(model.floor[c], level);
  return std::sqrt(level * level + ripple * ripple * (model.rest_samples / m.samples - 1.0));
}

/// Keeps the rows that carry a reading, whitens them and projects them off the pose.
PoseSystem whiten(const DiagnosisModel& model, const Robot& robot, RawRows raw,
                  const Measurement& m, const PlatformState& state, bool rests) {
  const PoseLayout rows(m, robot.cable_count());
  PoseSystem out;
  PoseRowValues sigma(rows.size());
  const bool moves = m.kind == PoseKind::kinematic_pose && m.samples == 1;
  const auto channel_of = [&](int row) {
    const NoiseGroup group = rows.meaning(row).first;
    // The balance has no group in motion; its rows carry nothing there.
    if (!moves || group == NoiseGroup::balance) return group;
    return static_cast<NoiseGroup>(static_cast<int>(group) + kRestGroups);
  };
  for (int row = 0; row < rows.size(); ++row) {
    sigma[row] = row_noise(model, channel_of(row), m);
  }
  if (rests) {
    const Matrix6 root = balance_root(
        state, {robot.sigma.tension_N, robot.sigma.wrench_force_N, robot.sigma.wrench_moment_Nm});
    const Matrix6 inverse = root.triangularView<Eigen::Lower>().solve(Matrix6::Identity());
    const int wrench = rows.readings.wrench();
    auto residual = raw.residual.segment<6>(wrench);
    auto by_pose = raw.by_pose.middleRows<6>(wrench);
    auto by_common = raw.by_common.middleRows<6>(wrench);
    residual = (inverse * residual).eval();
    by_pose = (inverse * by_pose).eval();
    by_common = inverse.lazyProduct(by_common).eval();
  }
  std::vector<int> kept;
  kept.reserve(static_cast<std::size_t>(rows.size()));
  for (int row = 0; row < rows.size(); ++row) {
    if (!std::isfinite(raw.residual[row])) continue;
    kept.push_back(row);
    out.channel.push_back(channel_of(row));
    out.component.push_back(rows.meaning(row).second);
  }
  const auto count = static_cast<Eigen::Index>(kept.size());
  out.scale = sigma(kept);
  const PoseRowValues weight = out.scale.cwiseInverse();
  out.residual = weight.cwiseProduct(raw.residual(kept));
  out.by_pose = raw.by_pose(kept, Eigen::all);
  out.by_pose.array().colwise() *= weight.array();
  if (count == rows.size()) {
    out.by_common = std::move(raw.by_common);
  } else {
    out.by_common = raw.by_common(kept, Eigen::all);
  }
  out.by_common.array().colwise() *= weight.array();
  // Qᵀ of both; its last rows are what the pose cannot explain.
  out.factor.compute(out.by_pose);
  const Eigen::Index left = count - out.factor.rank();
  PoseRowValues residual = out.residual;
  residual.applyOnTheLeft(out.factor.householderQ().adjoint());
  out.reduced = residual.tail(left);
  Eigen::MatrixXd by_common = out.by_common;
  by_common.applyOnTheLeft(out.factor.householderQ().adjoint());
  out.reduced_by_common = by_common.bottomRows(left);
  return out;
}

}  // namespace

PoseProjection PoseSystem::projection() const {
  const Eigen::Index count = residual.size();
  PoseProjection q = PoseProjection::Identity(count, count);
  q.applyOnTheLeft(factor.householderQ());
  return q.rightCols(count - factor.rank());
}

const char* to_string(NoiseGroup channel) {
  constexpr std::array<const char*, kNoiseGroups> kNames{"length",
                                                         "swivel",
                                                         "roll_pitch",
                                                         "yaw",
                                                         "balance",
                                                         "absolute_yaw",
                                                         "direct_length",
                                                         "position",
                                                         "length while moving",
                                                         "swivel while moving",
                                                         "roll_pitch while moving",
                                                         "yaw while moving",
                                                         "balance while moving",
                                                         "absolute_yaw while moving",
                                                         "direct_length while moving",
                                                         "position while moving"};
  return kNames.at(static_cast<std::size_t>(channel));
}

int DiagnosisModel::pose_count() const {
  std::size_t count = 0;
  for (const DiagnosisRun& run : runs) count += run.poses.size();
  return static_cast<int>(count);
}

Eigen::VectorXd offsets_at(const Robot& robot, const Pose& pose, const Measurement& m) {
  const PlatformState state = platform_state(robot, pose);
  Eigen::VectorXd out(2 * robot.cable_count() + 1);
  out << m.length_m - state.length_m(), m.swivel_rad - state.swivel_rad(),
      m.roll_pitch_yaw_rad[2] - euler_from_rotation(state.rotation, robot.euler_convention)[2];
  return out.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
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
  system.prior_precision.setZero(system.layout.nuisance());
  system.prior_residual.setZero(system.layout.nuisance());
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    const EffectTerm& term = model.effects[k];
    const EffectValues typical = term.effect->typical(n);
    for (Eigen::Index j = 0; j < term.values.size(); ++j) {
      const double sigma = term.prior_scale * typical[j % typical.size()];
      system.prior_precision[system.layout.accepted_begin[k] + j] = 1.0 / (sigma * sigma);
      system.prior_residual[system.layout.accepted_begin[k] + j] = term.values[j] / sigma;
    }
  }
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const ActiveEffects active = model.active(r);
    const Robot robot = with_effects(model.robot, active);
    const DiagnosisRun& run = model.runs[r];
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      const bool rests = m.in_balance();
      bool valid = true;
      const PlatformState state = platform_state(robot, run.poses[i]);
      RawRows raw = raw_rows(model, robot, active, system.layout, candidates, r, m, run.poses[i],
                             state, rests, valid);
      if (!valid) {
        system.valid = false;
        return system;
      }
      system.poses.push_back(whiten(model, robot, std::move(raw), m, state, rests));
      system.poses.back().run = r;
      system.poses.back().pose = i;
    }
  }
  return system;
}

}  // namespace cdprcal
