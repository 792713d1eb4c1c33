#include "cdprcal/estimation/model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/estimation/keep_one_of.hpp"
#include "cdprcal/estimation/model_fit.hpp"

namespace cdprcal {
namespace {

using lanes::kLanes;

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

/// σ of one reading of a channel. The part of a mean's noise that is the readings' own ripple falls
/// with their number; what is beyond it (the model's errors), or below it (rounding), does not.
double row_noise(const DiagnosisModel& model, NoiseGroup channel, const Measurement& m) {
  const auto c = static_cast<std::size_t>(channel);
  const double level = model.noise.at(c);
  const bool moving = c >= kRestGroups;
  const Signal& signal = model.signals[moving ? c - kRestGroups : c];
  const double ripple = std::min(model.floor[c], level);
  const double samples = moving ? 1.0 : model.rest_samples;
  const double usual = signal.variance(samples);
  const double more =
      usual > 0.0 ? signal.variance(m.samples, m.run_time_s) / usual : samples / m.samples;
  return std::sqrt(level * level + ripple * ripple * (more - 1.0));
}

NoiseGroup group_of(Channel channel, const Measurement& m) {
  return is_moving(m) && channel != Channel::balance ? in_motion(channel) : at_rest(channel);
}

RunReadings readings_of(const Robot& robot, const DiagnosisRun& run) {
  RunReadings out;
  for (const Measurement& m : run.measurements) {
    out.measurements.push_back(&m);
    out.statics.push_back(balance_equations(robot, m) > 0 ? StaticsModel::wrench
                                                          : StaticsModel::none);
  }
  out.base = OffsetVector::Zero(2 * robot.cable_count() + 1);
  return out;
}

/// What the model's own balance may be wrong by. Directions and levers are wrong by a share of what
/// pulls: a lighter platform beside load cells that say too much is no better for its smaller
/// residuals.
Vector6 balance_sigma_of(const Robot& given, const Robot& with_effects, const Vector6& inertial) {
  const double heavier = with_effects.platform.mass_kg / given.platform.mass_kg;
  return wrench_sigma(heavier * given.sigma.wrench_force_N, heavier * given.sigma.wrench_moment_Nm,
                      inertial);
}

/// Appends the poses of a batch to a system.
void append(ModelRows& rows, std::size_t r, std::size_t batch, DiagnosisSystem& out) {
  RunRows& run = rows.run(r);
  const RowLayout& at = run.layout();
  const auto columns = static_cast<Eigen::Index>(at.columns);
  const Eigen::Index first_offset = static_cast<Eigen::Index>(r) * at.offsets();
  PoseRows pose;
  for (const std::size_t i : poses_of(batch, run.poses())) {
    run.take(i, pose);
    const auto begin = static_cast<Eigen::Index>(out.rows.size());
    out.poses.push_back({r, i, begin, pose.count});
    for (std::size_t k = 0; k < static_cast<std::size_t>(pose.count); ++k) {
      const Eigen::Index row = begin + static_cast<Eigen::Index>(k);
      const int slot = pose.slot[k];
      out.rows.push_back(rows.row(r, i, at.slots[static_cast<std::size_t>(slot)]));
      out.residual[row] = pose.residual[k];
      out.by_pose.row(row) = Eigen::Map<const Vector6>(pose.own[k].data()).transpose();
      // Rows count offsets from the model, the model from the readings.
      if (pose.offset[k] >= 0) {
        out.by_common(row, first_offset + pose.offset[k]) = -pose.by_offset[k];
      }
      const double* const by_effect =
          run.by_effect() + static_cast<std::size_t>(slot * at.columns) * kLanes + i % kLanes;
      for (Eigen::Index c = 0; c < columns; ++c) {
        out.by_common(row, rows.layout().offsets + c) = by_effect[c * kLanes];
      }
    }
  }
}

/// Fills in what the poses leave: M = 1 − A (AᵀA)⁻¹ Aᵀ, pose by pose. `across`: what guides
/// prevent.
void project(const Matrix6& across, DiagnosisSystem& system) {
  system.free_residual = system.residual;
  system.free_by_common = system.by_common;
  system.freedom.setOnes(system.residual.size());
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const auto own = system.by_pose.middleRows(pose.begin, pose.size);
    // Products with so short a side are done as they are written: blocks cost more than they save.
    Matrix6 gram = own.transpose().lazyProduct(own) + across;
    gram.diagonal() += kBarely * gram.diagonal().cwiseMax(kLeastDiagonal);
    const Eigen::LLT<Matrix6> factor(gram);
    Eigen::Matrix<double, 6, Eigen::Dynamic> basis = own.transpose();
    factor.matrixL().solveInPlace(basis);
    auto residual = system.free_residual.segment(pose.begin, pose.size);
    residual -= basis.transpose().lazyProduct(Vector6(basis.lazyProduct(residual)));
    auto columns = system.free_by_common.middleRows(pose.begin, pose.size);
    const Eigen::Matrix<double, 6, Eigen::Dynamic> along = basis.lazyProduct(columns);
    columns -= basis.transpose().lazyProduct(along);
    system.freedom.segment(pose.begin, pose.size) -= basis.colwise().squaredNorm().transpose();
  }
}

}  // namespace

ModelRows::ModelRows(const DiagnosisModel& model, const Candidates& candidates)
    : model_(model),
      candidates_(candidates),
      layout_(layout_of(model, candidates)),
      motion_widening_(model.runs.size()) {
  for (const DiagnosisRun& run : model.runs) {
    runs_.push_back(std::make_unique<RunRows>(model.robot, readings_of(model.robot, run),
                                              std::vector<WrenchRow>{}));
  }
  weigh();
}

SystemRow ModelRows::row(std::size_t run, std::size_t pose, const RowSlot& slot) const {
  const Measurement& m = model_.runs[run].measurements[pose];
  const NoiseGroup group = group_of(slot.channel, m);
  return {group, slot.component, row_noise(model_, group, m)};
}

void ModelRows::weigh() {
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    for (std::size_t i = 0; i < runs_[r]->poses(); ++i) {
      const Measurement& m = model_.runs[r].measurements[i];
      std::array<double, kChannels> weights{};
      for (std::size_t c = 0; c < kChannels; ++c) {
        weights[c] = 1.0 / row_noise(model_, group_of(static_cast<Channel>(c), m), m);
      }
      runs_[r]->set_weights(i, weights);
    }
  }
}

void ModelRows::set_values(std::size_t r, const Eigen::VectorXd& values, const PoseLanes& poses) {
  const int n = model_.robot.cable_count();
  const auto accepted = static_cast<Eigen::Index>(layout_.accepted);
  ActiveEffects active = model_.active(r, values);
  std::vector<EffectColumn> derivatives;
  for (std::size_t k = 0; k < model_.effects.size(); ++k) {
    const EffectTerm& term = model_.effects[k];
    const int begin = layout_.accepted_begin[k] - layout_.offsets + term.begin_of(r, n);
    derivatives.push_back({term.effect, active[k].values, begin, {}});
  }
  for (std::size_t k = 0; k < candidates_.size(); ++k) {
    const EffectValues typical = candidates_[k]->typical(model_.robot);
    const bool by_run = candidates_[k]->info().scope == EffectScope::run;
    const int begin = layout_.candidate_begin[k] - layout_.offsets +
                      (by_run ? static_cast<int>(r * static_cast<std::size_t>(typical.size())) : 0);
    derivatives.push_back({candidates_[k], EffectValues::Zero(typical.size()), begin, typical});
  }
  RunRows& run = *runs_[r];
  const Robot robot = with_effects(model_.robot, active);
  const SensorSigma& sigma = model_.robot.sigma;
  std::vector<Pose> balanced;
  std::vector<BalanceSigma> uncertain;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < run.poses(); ++i) {
    if (run.statics_of(i) == StaticsModel::none) continue;
    balanced.push_back(poses[i]);
    const Measurement& m = model_.runs[r].measurements[i];
    // The noise is that of readings: a gain that shrinks the tensions must not shrink it for
    // nothing, or each would pay ν ln(1 + γ) of evidence. The motion is known no better where the
    // model is: what is not known of it stands apart from the level that scales the rest.
    const Vector6 inertial = m.inertial_sigma / row_noise(model_, at_rest(Channel::balance), m);
    uncertain.push_back({sigma.tension_N * true_tension_by_reading(robot, active, m),
                         balance_sigma_of(model_.robot, robot, inertial)});
    which.push_back(i);
  }
  for (std::size_t k = 0; k < which.size(); ++k) {
    const Measurement& m = model_.runs[r].measurements[which[k]];
    const bool silent = run.silent_rows(which[k]) > 0;
    if (!silent && !m.moves()) continue;
    const double level = row_noise(model_, at_rest(Channel::balance), m);
    BalanceSigma& own = uncertain[k];
    run.set_balance_sigma(
        which[k],
        {level * own.tension_N.array().isNaN().select(0.0, own.tension_N), level * own.wrench});
    if (silent) own.tension_N.setZero();  // of the roots below none is taken
  }
  run.set_effects(robot, std::move(active), std::move(derivatives),
                  static_cast<int>(accepted) + layout_.candidates);
  const std::vector<Matrix6> roots = inverse_balance_roots(robot, balanced, uncertain);
  for (std::size_t k = 0; k < which.size(); ++k) {
    if (run.silent_rows(which[k]) > 0) continue;
    const Measurement& m = model_.runs[r].measurements[which[k]];
    run.set_whitening(which[k], roots[k] / row_noise(model_, at_rest(Channel::balance), m));
  }
  weigh_motion(r, robot, balanced, uncertain, which, roots);
}

void ModelRows::weigh_motion(std::size_t r, const Robot& robot, const std::vector<Pose>& poses,
                             const std::vector<BalanceSigma>& uncertain,
                             const std::vector<std::size_t>& which,
                             const std::vector<Matrix6>& roots) {
  double& widening = motion_widening_[r] = 0.0;
  std::vector<Pose> moving;
  std::vector<BalanceSigma> at_rest_there;
  std::vector<std::size_t> rows;
  const Vector6 own = balance_sigma_of(model_.robot, robot, Vector6::Zero());
  for (std::size_t k = 0; k < which.size(); ++k) {
    if (model_.runs[r].measurements[which[k]].inertial_sigma.isZero()) continue;
    if (const int silent = runs_[r]->silent_rows(which[k]); silent > 0) {
      // Some combinations of the wrench, each wider by about as much.
      widening += silent / 6.0 * uncertain[k].wrench.cwiseQuotient(own).array().log().sum();
      continue;
    }
    moving.push_back(poses[k]);
    at_rest_there.push_back({uncertain[k].tension_N, own});
    rows.push_back(k);
  }
  const std::vector<Matrix6> narrow = inverse_balance_roots(robot, moving, at_rest_there);
  for (std::size_t j = 0; j < rows.size(); ++j) {
    widening += (narrow[j].diagonal().array() / roots[rows[j]].diagonal().array()).log().sum();
  }
}

PoseLanes ModelRows::poses(std::size_t run) const {
  const std::vector<Pose>& from = model_.runs[run].poses;
  PoseLanes out(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) out.set(i, from[i]);
  return out;
}

OffsetVector ModelRows::offsets(std::size_t run) const { return -model_.runs[run].offsets; }

std::string to_string(NoiseGroup group) {
  const int index = static_cast<int>(group);
  const std::string channel = to_string(static_cast<Channel>(index % kRestGroups));
  return index < kRestGroups ? channel : channel + " while moving";
}

double noise_unit(const Robot& robot, NoiseGroup group) {
  return group == at_rest(Channel::balance) ? robot.sigma.tension_N : 1.0;
}

int DiagnosisModel::pose_count() const {
  std::size_t count = 0;
  for (const DiagnosisRun& run : runs) count += run.poses.size();
  return static_cast<int>(count);
}

double thin_out(DiagnosisRun& run, std::size_t moments, double moments_a_reading) {
  constexpr double kEnough = 40.0;
  const double most = std::max(1.0, static_cast<double>(moments) / kEnough);
  const double every = std::ceil(std::min(moments_a_reading, most));
  const std::size_t first = run.measurements.size() - moments;
  const auto thin = [&](auto& values) {
    keep_one_of(static_cast<std::size_t>(every), [&](std::size_t i) { return i >= first; }, values);
  };
  thin(run.measurements);
  thin(run.poses);
  thin(run.rows);
  return std::max(1.0, moments_a_reading / every);
}

Eigen::VectorXd offsets_at(const Robot& robot, const Pose& pose, const Measurement& m) {
  const PlatformState state = platform_state(robot, pose);
  Eigen::VectorXd out(2 * robot.cable_count() + 1);
  out << m.length_m - state.length_m(), m.swivel_rad - state.swivel_rad(),
      m.roll_pitch_yaw_rad[2] - euler_from_rotation(state.rotation, robot.euler_convention)[2];
  return out.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
}

Eigen::VectorXd DiagnosisModel::values() const {
  Eigen::Index size = 0;
  for (const EffectTerm& term : effects) size += term.values.size();
  Eigen::VectorXd out(size);
  Eigen::Index begin = 0;
  for (const EffectTerm& term : effects) {
    out.segment(begin, term.values.size()) = term.values;
    begin += term.values.size();
  }
  return out;
}

ActiveEffects DiagnosisModel::active(std::size_t run, const Eigen::VectorXd& values) const {
  ActiveEffects out;
  const int n = robot.cable_count();
  Eigen::Index begin = 0;
  for (const EffectTerm& term : effects) {
    out.push_back(
        {term.effect, values.segment(begin + term.begin_of(run, n), term.effect->size(n))});
    begin += term.values.size();
  }
  const ActiveEffects& known = runs[run].known;
  out.insert(out.end(), known.begin(), known.end());
  return out;
}

bool scatters(const DiagnosisModel& model, NoiseGroup group) {
  constexpr double kExcess = 1.5;
  const auto c = static_cast<std::size_t>(group);
  return model.noise[c] > kExcess * model.floor[c];
}

bool balances_in_motion(const DiagnosisModel& model) {
  return std::ranges::any_of(model.runs, [](const DiagnosisRun& run) {
    return std::ranges::any_of(run.measurements, &Measurement::moves);
  });
}

DiagnosisSystem linearise(const DiagnosisModel& model, const Candidates& candidates) {
  ModelRows rows(model, candidates);
  DiagnosisSystem system;
  system.layout = rows.layout();
  const int nuisance = system.layout.nuisance();
  system.prior_precision.setZero(nuisance);
  system.prior_precision.tail(system.layout.accepted) = prior_precision(model);
  system.prior_residual.setZero(nuisance);
  const Eigen::VectorXd values = model.values();
  system.prior_residual.tail(system.layout.accepted) =
      system.prior_precision.tail(system.layout.accepted).cwiseSqrt().cwiseProduct(values);
  Eigen::Index count = 0;
  for (std::size_t r = 0; r < model.runs.size(); ++r) count += rows.run(r).row_count();
  system.residual.resize(count);
  system.by_pose.resize(count, 6);
  system.by_common.setZero(count, system.layout.size());
  system.rows.reserve(static_cast<std::size_t>(count));
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const PoseLanes poses = rows.poses(r);
    rows.set_values(r, values, poses);
    rows.run(r).set_offsets(rows.offsets(r).data());
    for (std::size_t b = 0; b < rows.run(r).batches(); ++b) {
      system.valid = system.valid && rows.run(r).evaluate(b, poses);
      if (!system.valid) return system;
      append(rows, r, b, system);
    }
  }
  project(FreeMotion(model.robot).across(), system);
  return system;
}

}  // namespace cdprcal
