#include "cdprcal/estimation/run_rows.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {

using lanes::kLanes;

RunRows::RunRows(const Robot& robot, RunReadings readings,
                 const std::vector<WrenchRow>& left_inverse_rows)
    : robot_(robot),
      readings_(std::move(readings)),
      left_inverse_rows_(left_inverse_rows),
      free_(robot),
      guided_(guided_basis(robot)) {
  lay_out();
  gather();
}

namespace {

/// Before effects have changed anything.
void clear(PoseEvaluation& change, int cables) {
  change.length_m.setZero(cables);
  change.swivel_rad.setZero(cables);
  change.roll_pitch_yaw_rad.setZero();
  change.length_by_twist.setZero(cables, 6);
  change.swivel_by_twist.setZero(cables, 6);
  change.attitude_by_twist.setZero();
  change.wrench.setZero();
  change.wrench_by_twist.setZero();
  change.specific_force_m_s2.setZero();
  change.absolute_by_twist.specific_force_m_s2.setZero();
}

/// What of a wrench no unread tension can carry, in the metric of the whitening.
Vector6 uncarried(const Matrix6& whitening, const Vector6& wrench) {
  return least_norm(whitening, Vector6(whitening * wrench));
}

/// Rows in the order of their slots: those with offsets first, the balance last.
std::vector<Channel> ordered_channels() {
  std::vector<Channel> out;
  for (const bool with_offset : {true, false}) {
    for (int c = 0; c < kChannels; ++c) {
      const auto channel = static_cast<Channel>(c);
      if (channel != Channel::balance && row_of(channel).has_offset == with_offset) {
        out.push_back(channel);
      }
    }
  }
  out.push_back(Channel::balance);
  return out;
}

const std::vector<Channel>& slot_order() {
  static const std::vector<Channel> order = ordered_channels();
  return order;
}

}  // namespace

OffsetVector offsets_of(const PoseEvaluation& at) {
  OffsetVector out(2 * at.length_m.size() + 1);
  out << at.length_m, at.swivel_rad, at.roll_pitch_yaw_rad[2];
  return out;
}

OffsetJacobian RunRows::offsets_by_twist(const PoseEvaluation& at) const {
  OffsetJacobian out(2 * at.length_m.size() + 1, 6);
  out << at.length_by_twist, at.swivel_by_twist, at.attitude_by_twist.row(2);
  return free_.of(out.transpose()).transpose();
}

void RunRows::lay_out() {
  const int n = robot_.cable_count();
  layout_.cables = n;
  layout_.first.fill(-1);
  weight_of_.assign(kChannels, -1);
  for (std::size_t i = 0; i < poses(); ++i) {
    if (readings_.statics[i] != StaticsModel::none) layout_.statics = readings_.statics[i];
  }
  for (const Channel channel : slot_order()) {
    const ChannelRow& row = row_of(channel);
    const auto c = static_cast<std::size_t>(channel);
    const bool balance = channel == Channel::balance;
    const bool read = balance
                          ? layout_.statics != StaticsModel::none
                          : std::any_of(readings_.measurements.begin(),
                                        readings_.measurements.end(), [&](const auto* m) {
                                          return readings_of(*m, channel).array().isFinite().any();
                                        });
    if (!read && !row.has_offset) continue;
    const bool mixed = balance && layout_.statics == StaticsModel::wrench;
    // The balance has tensions instead.
    const int readings = mixed ? 0 : row.of().width == kOneACable ? n : row.count;
    const int weight = layout_.numbers + readings;
    weight_of_[c] = weight;
    if (read) layout_.first[c] = layout_.size();
    for (int k = 0; k < (mixed ? 6 : readings); ++k) {
      layout_.slots.push_back({channel, row.first + k, read, !balance && row.of().is_angle(),
                               layout_.numbers + k, weight});
    }
    layout_.numbers += readings + 1;
  }
  const auto slots = static_cast<std::size_t>(layout_.size());
  const auto cables = static_cast<std::size_t>(n);
  const std::size_t count = std::max<std::size_t>(1, batches());
  numbers_ = lanes::buffer(count * static_cast<std::size_t>(layout_.numbers));
  tension_ = lanes::buffer(count * cables);
  const bool wrench = layout_.statics == StaticsModel::wrench;
  whitening_ = lanes::buffer(wrench ? count * 36 : 1);
  std::fill_n(whitening_.get(), wrench ? count * 36 * kLanes : kLanes, 0.0);
  rows_ = lanes::buffer(kRow * slots);
  by_offset_ = lanes::buffer(static_cast<std::size_t>(layout_.offsets()));
  values_ = lanes::buffer(slots);
  state_ = lanes::buffer(static_cast<std::size_t>(StateNumbers::size(n)));
  columns_ = lanes::buffer(1);
  offsets_.setZero(layout_.offsets());
}

void RunRows::gather() {
  const int n = layout_.cables;
  row_counts_.assign(poses(), 0);
  silent_.assign(poses(), 0);
  std::fill_n(tension_.get(),
              std::max<std::size_t>(1, batches()) * static_cast<std::size_t>(n) * kLanes, 0.0);
  for (std::size_t i = 0; i < batches() * kLanes; ++i) {
    // No reading, and no weight, where there is no pose.
    for (int k = 0; k < layout_.numbers; ++k) *number(i, k) = i < poses() ? kNaN : 0.0;
    if (i >= poses()) continue;
    const Measurement& m = *readings_.measurements[i];
    const bool balanced = readings_.statics[i] != StaticsModel::none;
    const std::size_t at = (i / kLanes) * static_cast<std::size_t>(n) * kLanes + i % kLanes;
    for (int c = 0; balanced && c < n; ++c) {
      tension_[at + static_cast<std::size_t>(c) * kLanes] = m.tension_N[c];
    }
    if (balanced) {
      any_moves_ = any_moves_ || m.moves();
      silent_[i] = 6 - balance_equations(robot_, m);
      any_silent_ = any_silent_ || silent_[i] > 0;
      row_counts_[i] += layout_.statics == StaticsModel::wrench ? 6 - silent_[i] : n;
    }
    for (const Channel channel : slot_order()) {
      const int first = layout_.slot(channel);
      if (first < 0) continue;
      if (channel == Channel::balance) {
        for (int c = 0; layout_.statics == StaticsModel::left_inverse && c < n; ++c) {
          *number(i, layout_.slots[static_cast<std::size_t>(first + c)].reading) =
              balanced ? m.tension_N[c] : 0.0;
        }
        continue;
      }
      const auto read = readings_of(m, channel);
      for (int k = 0; k < static_cast<int>(read.size()); ++k) {
        const int s = first + k;
        double value = read[k];
        if (s < layout_.offsets()) value -= readings_.base[s];
        if (i == readings_.reference) {
          const bool counts = s < layout_.offsets() ? (readings_.reference_offsets >> s & 1U) != 0U
                                                    : channel != Channel::roll_pitch ||
                                                          readings_.reference_roll_pitch;
          if (!counts) value = kNaN;
        }
        *number(i, layout_.slots[static_cast<std::size_t>(s)].reading) = value;
        if (std::isfinite(value)) ++row_counts_[i];
      }
    }
  }
  if (any_silent_ || any_moves_) sigma_.resize(poses());
  if (any_silent_) partial_.resize(poses());
}

void RunRows::set_effects(const Robot& robot, ActiveEffects effects,
                          std::vector<EffectColumn> derivatives, int columns) {
  robot_ = robot;
  alone_.at.position_m.setConstant(kNaN);
  effects_ = std::move(effects);
  derivatives_ = std::move(derivatives);
  if (columns != layout_.columns || !columns_) {
    layout_.columns = columns;
    const std::size_t numbers = std::max<std::size_t>(
        1, static_cast<std::size_t>(layout_.size()) * static_cast<std::size_t>(columns));
    columns_ = lanes::buffer(numbers);
    std::fill_n(columns_.get(), numbers * kLanes, 0.0);  // lanes without a pose stay so
  }
}

void RunRows::set_weights(std::size_t pose, const std::array<double, kChannels>& weights) {
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (weight_of_[c] < 0) continue;
    const bool balance = static_cast<Channel>(c) == Channel::balance;
    const bool asked = !balance || readings_.statics[pose] != StaticsModel::none;
    *number(pose, weight_of_[c]) = asked ? weights[c] : 0.0;
  }
}

void RunRows::set_tension_weight(std::size_t pose, double weight) {
  const int at = weight_of_[static_cast<std::size_t>(Channel::balance)];
  if (at >= 0) *number(pose, at) = readings_.statics[pose] != StaticsModel::none ? weight : 0.0;
}

void RunRows::set_whitening(std::size_t pose, const Matrix6& whitening) {
  if (layout_.statics != StaticsModel::wrench) return;
  const bool balanced = readings_.statics[pose] != StaticsModel::none;
  double* const out = whitening_.get() + (pose / kLanes) * 36 * kLanes + pose % kLanes;
  for (Eigen::Index r = 0; r < 6; ++r) {
    for (Eigen::Index c = 0; c < 6; ++c) {
      out[(6 * r + c) * kLanes] = balanced ? whitening(r, c) : 0.0;
    }
  }
}

void RunRows::set_offsets(const double* offsets) {
  std::copy_n(offsets, layout_.offsets(), offsets_.data());
}

bool RunRows::evaluate(std::size_t batch, const PoseLanes& poses) {
  bool valid = true;
  const auto n = static_cast<std::size_t>(layout_.cables);
  const RowBatch in{
      layout_,
      robot_,
      left_inverse_rows_,
      offsets_.data(),
      poses.batch(batch),
      numbers_.get() + batch * static_cast<std::size_t>(layout_.numbers) * kLanes,
      tension_.get() + batch * n * kLanes,
      whitening_.get() + (layout_.statics == StaticsModel::wrench ? batch * 36 * kLanes : 0),
      rows_.get(),
      by_offset_.get(),
      values_.get(),
      state_.get(),
      columns_.get(),
      valid};
  if (effects_.empty() && derivatives_.empty() && !any_moves_) {
    for (const std::size_t i : poses_of(batch, this->poses())) {
      if (silent_[i] == 0) continue;
      const PlatformState state = platform_state(robot_, poses[i]);
      if (!state.valid) return false;
      complete_tensions(i, state, readings_.measurements[i]->tension_N,
                        gravity_wrench(robot_, state));
    }
    write_rows(in);
    keep_to_motion();
    return valid;
  }
  predict_geometry(in);
  if (!valid) return false;
  act_on_tensions(batch, poses);
  if (layout_.slot(Channel::balance) >= 0) predict_balance(in);
  if (!valid) return false;
  act_on_readings(batch, poses);
  finish_rows(in);
  keep_to_motion();
  return true;
}

void RunRows::keep_to_motion() {
  if (!free_.is_guided()) return;
  for (std::size_t s = 0; s < static_cast<std::size_t>(layout_.size()); ++s) {
    // Derivatives of eight poses: [6][lane].
    Eigen::Map<Eigen::Matrix<double, 6, kLanes, Eigen::RowMajor>> own(rows_.get() +
                                                                      kRow * s * kLanes);
    own = free_.of(own);
  }
}

const PoseEvaluation& RunRows::evaluate_alone(std::size_t pose, const Pose& at) const {
  const bool known = alone_.pose == pose && alone_.at.position_m == at.position_m &&
                     alone_.at.rotation.coeffs() == at.rotation.coeffs();
  if (!known) {
    alone_.pose = pose;
    alone_.at = at;
    evaluate_pose(robot_, *readings_.measurements[pose], at, StaticsModel::none, left_inverse_rows_,
                  effects_, true, alone_.evaluation);
  }
  return alone_.evaluation;
}

PlatformState RunRows::state_of(std::size_t lane) const {
  using S = StateNumbers;
  const auto at = [&](int index) {
    return state_[static_cast<std::size_t>(index) * kLanes + lane];
  };
  const auto vector = [&](int index) { return Vector3(at(index), at(index + 1), at(index + 2)); };
  const int n = layout_.cables;
  PlatformState out;
  out.valid = true;
  out.cable_count = n;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.rotation(i, j) = at(S::rotation(n) + 3 * i + j);
  }
  out.centre_of_mass_arm_m = vector(S::mass_arm(n));
  for (int i = 0; i < n; ++i) {
    const int from = S::cable(i);
    const auto c = static_cast<std::size_t>(i);
    CableState& cable = out.cable[c];
    cable.length_m = at(from + S::length);
    cable.swivel_rad = at(from + S::swivel);
    cable.tangency_rad = at(from + S::tangency);
    cable.free_length_m = at(from + S::free);
    cable.radial_distance_m = at(from + S::radial_distance);
    cable.radial = vector(from + S::radial);
    cable.groove_normal = vector(from + S::groove_normal);
    cable.contact = vector(from + S::contact);
    cable.direction = vector(from + S::direction);
    out.anchor_arm_m[c] = vector(from + S::arm);
  }
  return out;
}

void RunRows::complete_tensions(std::size_t pose, const PlatformState& state,
                                const CableVector& tension_N, const Vector6& load) {
  partial_[pose] = partial_balance(state, tension_N, guided_, load, sigma_[pose]);
  set_whitening(pose, partial_[pose].whitening);
  const auto n = static_cast<std::size_t>(layout_.cables);
  for (std::size_t c = 0; c < n; ++c) {
    tension_[((pose / kLanes) * n + c) * kLanes + pose % kLanes] =
        partial_[pose].tension_N[static_cast<Eigen::Index>(c)];
  }
}

void RunRows::change_readings(const EffectContext& context) {
  clear(change_, layout_.cables);
  add_inertia(context.robot, context.state, context.measurement, change_);
  for (const ActiveEffect& active : effects_) {
    active.effect->add_to_readings(context, active.values, change_);
  }
}

Vector6 RunRows::load_on(const EffectContext& context) {
  change_readings(context);
  return gravity_wrench(robot_, context.state) - change_.wrench;
}

void RunRows::act_on_tensions(std::size_t batch, const PoseLanes& poses) {
  if (layout_.statics == StaticsModel::none) return;
  const auto n = static_cast<std::size_t>(layout_.cables);
  for (const std::size_t i : poses_of(batch, this->poses())) {
    const std::size_t lane = i % kLanes;
    if (readings_.statics[i] == StaticsModel::none) continue;
    const Measurement& m = *readings_.measurements[i];
    const Pose pose = poses[i];
    const PlatformState state = state_of(lane);
    const EffectContext context{robot_, state, pose, m};
    CableVector tension_N = corrected_tension_N(context, effects_, m.tension_N);
    if (silent_[i] > 0) {  // no load cell, nothing for its effects to change
      tension_N = m.tension_N.array().isNaN().select(kNaN, tension_N);
      complete_tensions(i, state, tension_N, gravity_wrench(robot_, state));
      const EffectContext loaded{robot_, state, pose, m, partial_[i].tension_N};
      complete_tensions(i, state, tension_N, load_on(loaded));
      continue;
    }
    for (std::size_t c = 0; c < n; ++c) {
      tension_[(batch * n + c) * kLanes + lane] = tension_N[static_cast<Eigen::Index>(c)];
    }
  }
}

CableVector RunRows::tension_noise(std::size_t pose, const PlatformState& state) const {
  if (layout_.statics != StaticsModel::wrench || !readings_.measurements[pose]->moves() ||
      silent_[pose] > 0 || sigma_[pose].tension_N.size() == 0) {
    return {};
  }
  const std::size_t lane = pose % kLanes;
  const auto slot = static_cast<std::size_t>(layout_.slot(Channel::balance));
  const double* const from = whitening_.get() + (pose / kLanes) * 36 * kLanes + lane;
  Matrix6 whitening;
  Vector6 balance;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto row = slot + static_cast<std::size_t>(i);
    balance[i] = rows_[(kRow * row + 6) * kLanes + lane];
    for (Eigen::Index k = 0; k < 6; ++k) {
      whitening(i, k) = from[static_cast<std::size_t>(6 * i + k) * kLanes];
    }
  }
  const Vector6 per_wrench = whitening.transpose() * (whitening * balance);
  const CableVector along = structure_matrix(state).transpose() * per_wrench;
  return sigma_[pose].tension_N.cwiseAbs2().cwiseProduct(along);
}

void RunRows::act_on_readings(std::size_t batch, const PoseLanes& poses) {
  const int n = layout_.cables;
  for (const std::size_t i : poses_of(batch, this->poses())) {
    const std::size_t lane = i % kLanes;
    const Measurement& m = *readings_.measurements[i];
    const Pose pose = poses[i];
    const PlatformState state = state_of(lane);
    CableVector tension_N = m.tension_N;
    const bool balanced = readings_.statics[i] != StaticsModel::none;
    for (int c = 0; balanced && c < n; ++c) {
      tension_N[c] =
          tension_[(batch * static_cast<std::size_t>(n) + static_cast<std::size_t>(c)) * kLanes +
                   lane];
    }
    const EffectContext context{robot_, state, pose, m, tension_N};
    change_readings(context);
    const auto add = [&](int slot, double value, const auto& by_twist) {
      double* const row = rows_.get() + static_cast<std::size_t>(kRow * slot) * kLanes + lane;
      for (int a = 0; a < 6; ++a) row[a * kLanes] += by_twist[a];
      row[6 * kLanes] += value;
    };
    for (int c = 0; c < n; ++c) {
      add(c, change_.length_m[c], change_.length_by_twist.row(c));
      add(n + c, change_.swivel_rad[c], change_.swivel_by_twist.row(c));
    }
    add(2 * n, change_.roll_pitch_yaw_rad[2], change_.attitude_by_twist.row(2));
    if (const int slot = layout_.slot(Channel::roll_pitch); slot >= 0) {
      for (int a = 0; a < 2; ++a) {
        add(slot + a, change_.roll_pitch_yaw_rad[a], change_.attitude_by_twist.row(a));
      }
    }
    if (const int slot = layout_.slot(Channel::specific_force); slot >= 0) {
      for (int a = 0; a < 3; ++a) {
        add(slot + a, change_.specific_force_m_s2[a],
            change_.absolute_by_twist.specific_force_m_s2.row(a));
      }
    }
    CableVector noise_N;
    if (const int slot = layout_.slot(Channel::balance); slot >= 0 && balanced) {
      if (layout_.statics == StaticsModel::wrench) {
        for (int a = 0; a < 6; ++a)
          add(slot + a, change_.wrench[a], change_.wrench_by_twist.row(a));
        noise_N = tension_noise(i, state);
        if (noise_N.size() > 0) {
          const Matrix6 by_noise = -tension_stiffness(state, noise_N);
          for (int a = 0; a < 6; ++a) add(slot + a, 0.0, by_noise.row(a));
        }
      } else {  // what the load cells would read of the model's tensions
        const Eigen::Matrix<double, 1, 6> none = Eigen::Matrix<double, 1, 6>::Zero();
        for (int c = 0; c < n; ++c) add(slot + c, m.tension_N[c] - tension_N[c], none);
      }
    }
    if (layout_.columns > 0 && noise_N.size() == 0) add_columns(context, lane, balanced);
    if (layout_.columns > 0 && noise_N.size() > 0) {
      Measurement clean = m;
      clean.tension_N -= noise_N;  // gains are near 1: the noise at the platform is the readings'
      tension_N -= noise_N;
      add_columns({robot_, state, pose, clean, tension_N}, lane, balanced);
    }
  }
}

void RunRows::add_columns(const EffectContext& context, std::size_t lane, bool balanced) {
  const int n = layout_.cables;
  const ReadingRows rows{n};
  const auto width = static_cast<std::size_t>(layout_.columns);
  for (std::size_t k = 0; k < static_cast<std::size_t>(layout_.size()) * width; ++k) {
    columns_[k * kLanes + lane] = 0.0;
  }
  const auto put = [&](int slot, int row, int begin) {
    double* const to =
        columns_.get() +
        (static_cast<std::size_t>(slot) * width + static_cast<std::size_t>(begin)) * kLanes + lane;
    for (Eigen::Index k = 0; k < by_value_.cols(); ++k) to[k * kLanes] = by_value_(row, k);
  };
  for (const EffectColumn& column : derivatives_) {
    by_value_.setZero(rows.size(), column.values.size());
    column.effect->columns(context, column.values, by_value_);
    if (any_silent_) by_value_ = by_value_.array().isNaN().select(0.0, by_value_).eval();
    if (column.scale.size() > 0) by_value_.array().rowwise() *= column.scale.transpose().array();
    for (int c = 0; c < n; ++c) {
      put(c, rows.length() + c, column.begin);
      put(n + c, rows.swivel() + c, column.begin);
    }
    put(2 * n, rows.attitude() + 2, column.begin);
    if (const int slot = layout_.slot(Channel::roll_pitch); slot >= 0) {
      for (int a = 0; a < 2; ++a) put(slot + a, rows.attitude() + a, column.begin);
    }
    if (const int slot = layout_.slot(Channel::specific_force); slot >= 0) {
      for (int a = 0; a < 3; ++a) put(slot + a, rows.specific_force() + a, column.begin);
    }
    for (std::size_t c = kPaperChannels; c < kChannels && column.effect->moves_cables(); ++c) {
      const int slot = layout_.first[c];  // whole lengths change with those of the drums
      if (slot < 0 || kChannelTable[c].of().width != kOneACable) continue;
      for (int i = 0; i < n; ++i) put(slot + i, rows.length() + i, column.begin);
    }
    if (const int slot = layout_.slot(Channel::balance);
        slot >= 0 && balanced && layout_.statics == StaticsModel::wrench) {
      for (int a = 0; a < 6; ++a) put(slot + a, rows.wrench() + a, column.begin);
    }
  }
}

bool RunRows::has_row(std::size_t pose, int slot) const {
  if (const RowSlot& at = layout_.slots[static_cast<std::size_t>(slot)];
      at.channel == Channel::balance) {
    return readings_.statics[pose] != StaticsModel::none && at.component >= silent_[pose];
  }
  return !std::isnan(*number(pose, layout_.slots[static_cast<std::size_t>(slot)].reading));
}

void RunRows::take(std::size_t pose, PoseRows& out) const {
  const std::size_t lane = pose % kLanes;
  out.count = 0;
  for (int s = 0; s < layout_.size(); ++s) {
    const RowSlot& slot = layout_.slots[static_cast<std::size_t>(s)];
    if (!has_row(pose, s)) continue;
    const double* const row = rows_.get() + static_cast<std::size_t>(kRow * s) * kLanes + lane;
    const auto r = static_cast<std::size_t>(out.count++);
    for (std::size_t a = 0; a < 6; ++a) out.own[r][a] = row[a * kLanes];
    out.residual[r] = row[6 * kLanes];
    const bool offset = s < layout_.offsets();
    out.slot[r] = s;
    out.offset[r] = offset ? s : -1;
    out.by_offset[r] = offset ? by_offset_[static_cast<std::size_t>(s) * kLanes + lane] : 0.0;
    out.label[r] = {slot.channel, slot.component, false};
  }
}

void RunRows::hold(std::size_t lane) {
  for (std::size_t s = 0; s < static_cast<std::size_t>(layout_.size()); ++s) {
    for (std::size_t a = 0; a < 6; ++a) rows_[(kRow * s + a) * kLanes + lane] = 0.0;
  }
}

void RunRows::forget(std::size_t lane) {
  hold(lane);
  const auto width = static_cast<std::size_t>(layout_.columns);
  for (std::size_t s = 0; s < static_cast<std::size_t>(layout_.size()); ++s) {
    rows_[(kRow * s + 6) * kLanes + lane] = 0.0;
    for (std::size_t k = 0; k < width; ++k) columns_[(s * width + k) * kLanes + lane] = 0.0;
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(layout_.offsets()); ++k) {
    by_offset_[k * kLanes + lane] = 0.0;
  }
}

double RunRows::squared_residuals(std::optional<Channel> only) const {
  std::array<double, kLanes> sums{};
  for (int s = 0; s < layout_.size(); ++s) {
    const RowSlot& slot = layout_.slots[static_cast<std::size_t>(s)];
    if (!slot.read || (only && slot.channel != *only)) continue;
    const double* const residual = rows_.get() + static_cast<std::size_t>(kRow * s + 6) * kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) sums[l] += residual[l] * residual[l];
  }
  double out = 0.0;
  for (const double sum : sums) out += sum;
  return out;
}

void RunRows::write_residual(std::size_t pose, PoseResidual& out) const {
  const std::size_t lane = pose % kLanes;
  const auto value = [&](int slot) {
    return slot < 0 ? kNaN : values_[static_cast<std::size_t>(slot) * kLanes + lane];
  };
  for_each_sensor(
      [&](const Sensor& sensor, auto& field) {
        if constexpr (requires { field.resize(1); }) {
          if (sensor.width == kOneACable) field.resize(layout_.cables);
        }
        const auto numbers_of = numbers(field);
        std::fill(numbers_of.begin(), numbers_of.end(), kNaN);
        for (const ChannelRow& row : channels_of(sensor)) {
          const int first = layout_.slot(channel_of(row));
          if (first < 0 || channel_of(row) == Channel::balance) continue;
          const int end = std::min(static_cast<int>(numbers_of.size()), row.first + row.count);
          for (int k = row.first; k < end; ++k) {
            numbers_of[static_cast<std::size_t>(k)] = value(first + k - row.first);
          }
        }
      },
      out);
  const int balance = layout_.slot(Channel::balance);
  if (readings_.statics[pose] == StaticsModel::left_inverse) {
    for (int i = 0; i < layout_.cables; ++i) out.tension_N[i] = value(balance + i);
  } else if (readings_.statics[pose] == StaticsModel::wrench) {
    for (int i = 0; i < 6; ++i) out.wrench[i] = value(balance + i);
    if (silent_[pose] > 0) out.wrench = uncarried(partial_[pose].whitening, out.wrench);
  }
}

int RunRows::row_count() const {
  int out = 0;
  for (const int count : row_counts_) out += count;
  return out;
}

std::vector<int> RunRows::slots(std::optional<Channel> without) const {
  std::vector<int> out;
  for (int s = 0; s < layout_.size(); ++s) {
    const RowSlot& slot = layout_.slots[static_cast<std::size_t>(s)];
    if (slot.read && slot.channel != without) out.push_back(s);
  }
  return out;
}

}  // namespace cdprcal
