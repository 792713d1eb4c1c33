#include "cdprcal/estimation/row_lanes.hpp"

#include <algorithm>

#include "cdprcal/estimation/presence.hpp"

namespace cdprcal {

using lanes::kLanes;

bool RowLanes::serve(const CalibrationProblem& problem) {
  const int n = problem.robot.cable_count();
  const bool tensions = problem.statics != StaticsModel::left_inverse ||
                        (n <= 6 && static_cast<int>(problem.left_inverse_rows.size()) == n);
  return problem.effects.empty() && tensions;
}

Channel RowLanes::channel(int slot) const {
  const int n = layout_.cables;
  if (slot < n) return Channel::length;
  if (slot < 2 * n) return Channel::swivel;
  if (slot == 2 * n) return Channel::yaw;
  return own_channel_[static_cast<std::size_t>(slot - 2 * n - 1)];
}

RowSlots RowLanes::slots(std::optional<Channel> without) const {
  RowSlots out;
  for (int s = 0; s < slot_count(); ++s) {
    if (channel(s) == without || slot(channel(s)) < 0) continue;
    out.index[static_cast<std::size_t>(out.count++)] = s;
    if (s <= 2 * layout_.cables) ++out.offsets;
  }
  return out;
}

void RowLanes::reserve(Channel channel, int readings, int own_rows) {
  RowLayout::Place& place = layout_[channel];
  place.reading = layout_.numbers;
  place.weight = layout_.numbers + readings;
  layout_.numbers += readings + 1;
  if (own_rows == 0) return;
  place.slot = slot_count();
  own_channel_.insert(own_channel_.end(), static_cast<std::size_t>(own_rows), channel);
}

RowLanes::RowLanes(const CalibrationProblem& problem, const PoseCache& cache,
                   const ReferenceReadings& reference)
    : problem_(problem),
      cache_(cache),
      reference_(reference),
      batches_(lanes::batches(problem.measurements.size() - 1)) {
  const int n = problem.robot.cable_count();
  layout_.cables = n;
  // The rows of offsets are always there, for all poses or none.
  const auto relative = [&](Channel channel, int readings, int slot) {
    reserve(channel, readings, 0);
    if (is_read(problem, channel)) layout_[channel].slot = slot;
  };
  relative(Channel::length, n, 0);
  relative(Channel::swivel, n, n);
  relative(Channel::yaw, 1, 2 * n);
  const auto absolute = [&](Channel channel, int readings) {
    if (is_read(problem, channel)) reserve(channel, readings, readings);
  };
  absolute(Channel::roll_pitch, 2);
  absolute(Channel::absolute_yaw, 1);
  absolute(Channel::direct_length, n);
  absolute(Channel::position, 3);
  for (std::size_t i = 1; i < problem.measurements.size(); ++i) {
    if (cache.statics_of(i) == StaticsModel::none) continue;
    layout_.statics = cache.statics_of(i);
    const bool wrench = layout_.statics == StaticsModel::wrench;
    reserve(Channel::balance, n, wrench ? 6 : n);
    if (wrench) whitening_ = lanes::buffer(batches_ * 36);
    break;
  }
  const auto slots = static_cast<std::size_t>(slot_count());
  rows_ = lanes::buffer(kRow * slots);
  by_offset_ = lanes::buffer(static_cast<std::size_t>(2 * n + 1));
  values_ = lanes::buffer(slots);
  const auto numbers = static_cast<std::size_t>(layout_.numbers);
  readings_ = lanes::buffer(std::max<std::size_t>(1, batches_) * numbers);
  gather();
}

void RowLanes::gather() {
  const int n = layout_.cables;
  const std::size_t poses = problem_.measurements.size() - 1;
  const auto numbers = static_cast<std::size_t>(layout_.numbers);
  for (std::size_t i = 0; i < batches_ * kLanes; ++i) {
    double* const out = readings_.get() + (i / kLanes) * numbers * kLanes + i % kLanes;
    if (i >= poses) {  // no reading, and no weight
      for (std::size_t k = 0; k < numbers; ++k) out[k * kLanes] = 0.0;
      continue;
    }
    const Measurement& m = problem_.measurements[i + 1];
    const auto put = [&](Channel channel, int index, double value) {
      out[(layout_[channel].reading + index) * kLanes] = value;
      if (channel != Channel::balance && std::isfinite(value)) ++row_count_;
    };
    const auto put_weight = [&](Channel channel) {
      out[layout_[channel].weight * kLanes] = cache_.weight(i + 1, channel);
    };
    for (const Channel channel : {Channel::length, Channel::swivel, Channel::yaw}) {
      put_weight(channel);
    }
    for (int c = 0; c < n; ++c) {
      put(Channel::length, c, m.length_m[c] - reference_.length_m[c]);
      put(Channel::swivel, c, m.swivel_rad[c] - reference_.swivel_rad[c]);
    }
    put(Channel::yaw, 0, m.roll_pitch_yaw_rad[2] - reference_.yaw_rad);
    if (slot(Channel::roll_pitch) >= 0) {
      put_weight(Channel::roll_pitch);
      for (int a = 0; a < 2; ++a) put(Channel::roll_pitch, a, m.roll_pitch_yaw_rad[a]);
    }
    if (slot(Channel::absolute_yaw) >= 0) {
      put_weight(Channel::absolute_yaw);
      put(Channel::absolute_yaw, 0, m.absolute_yaw_rad);
    }
    if (slot(Channel::direct_length) >= 0) {
      put_weight(Channel::direct_length);
      for (int c = 0; c < n; ++c) {
        put(Channel::direct_length, c, c < m.direct_length_m.size() ? m.direct_length_m[c] : kNaN);
      }
    }
    if (slot(Channel::position) >= 0) {
      put_weight(Channel::position);
      for (int a = 0; a < 3; ++a) put(Channel::position, a, m.position_m[a]);
    }
    if (slot(Channel::balance) >= 0) {
      const bool balanced = cache_.statics_of(i + 1) != StaticsModel::none;
      if (balanced) row_count_ += layout_.statics == StaticsModel::wrench ? 6 : n;
      for (int c = 0; c < n; ++c) put(Channel::balance, c, balanced ? m.tension_N[c] : 0.0);
    }
  }
}

void RowLanes::update_weights() {
  if (slot(Channel::balance) < 0 || weights_version_ == cache_.weights_version()) return;
  weights_version_ = cache_.weights_version();
  const std::size_t poses = problem_.measurements.size() - 1;
  const auto numbers = static_cast<std::size_t>(layout_.numbers);
  const auto weight = static_cast<std::size_t>(layout_[Channel::balance].weight);
  for (std::size_t i = 0; i < batches_ * kLanes; ++i) {
    const std::size_t batch = i / kLanes, lane = i % kLanes;
    const bool balanced = i < poses && cache_.statics_of(i + 1) != StaticsModel::none;
    readings_[(batch * numbers + weight) * kLanes + lane] =
        balanced ? cache_.tension_weight(i + 1) : 0.0;
    if (layout_.statics != StaticsModel::wrench) continue;
    double* const out = whitening_.get() + batch * 36 * kLanes + lane;
    for (Eigen::Index r = 0; r < 6; ++r) {
      for (Eigen::Index c = 0; c < 6; ++c) {
        out[(6 * r + c) * kLanes] = balanced ? cache_.wrench_whitening(i + 1)(r, c) : 0.0;
      }
    }
  }
}

void RowLanes::set_offsets(const PoseEvaluation& initial) {
  const int n = layout_.cables;
  for (int c = 0; c < n; ++c) {
    offsets_[static_cast<std::size_t>(c)] = initial.length_m[c];
    offsets_[static_cast<std::size_t>(n + c)] = initial.swivel_rad[c];
  }
  offsets_[static_cast<std::size_t>(2 * n)] = initial.roll_pitch_yaw_rad[2];
  for (int k = 0; k < reference_.size(); ++k) {
    offsets_[static_cast<std::size_t>(k)] += reference_.errors()[k];
  }
}

bool RowLanes::evaluate(std::size_t batch, const PoseLanes& poses) {
  bool valid = true;
  const RowBatch in{layout_,
                    problem_.robot,
                    problem_.left_inverse_rows,
                    offsets_.data(),
                    poses.batch(batch),
                    readings_.get() + batch * static_cast<std::size_t>(layout_.numbers) * kLanes,
                    whitening_ ? whitening_.get() + batch * 36 * kLanes : nullptr,
                    rows_.get(),
                    by_offset_.get(),
                    values_.get(),
                    valid};
  write_batch(in);
  return valid;
}

double RowLanes::squared_residuals(std::optional<Channel> only) const {
  std::array<double, kLanes> sums{};
  for (int s = 0; s < slot_count(); ++s) {
    if (slot(channel(s)) < 0 || (only && channel(s) != *only)) continue;
    const double* const residual = rows_.get() + (kRow * s + 6) * kLanes;
    for (std::size_t l = 0; l < kLanes; ++l) sums[l] += residual[l] * residual[l];
  }
  double out = 0.0;
  for (const double sum : sums) out += sum;
  return out;
}

void RowLanes::residuals(std::size_t batch, std::vector<PoseResidual>& poses) const {
  const int n = layout_.cables;
  const std::size_t first = 1 + batch * kLanes;
  for (std::size_t lane = 0; lane < kLanes && first + lane < poses.size(); ++lane) {
    PoseResidual& r = poses[first + lane];
    const auto value = [&](Channel channel, int index) {
      const int at = slot(channel);
      return at < 0 ? kNaN : values_[static_cast<std::size_t>(at + index) * kLanes + lane];
    };
    const auto cables = [&](Channel channel) {
      CableVector out(n);
      for (int c = 0; c < n; ++c) out[c] = value(channel, c);
      return out;
    };
    r.length_m = cables(Channel::length);
    r.swivel_rad = cables(Channel::swivel);
    r.roll_pitch_yaw_rad = {value(Channel::roll_pitch, 0), value(Channel::roll_pitch, 1),
                            value(Channel::yaw, 0)};
    r.absolute_yaw_rad = value(Channel::absolute_yaw, 0);
    r.direct_length_m = cables(Channel::direct_length);
    for (int a = 0; a < 3; ++a) r.position_m[a] = value(Channel::position, a);
    r.tension_N = CableVector::Constant(n, kNaN);
    const StaticsModel statics = cache_.statics_of(first + lane);
    if (statics == StaticsModel::left_inverse) r.tension_N = cables(Channel::balance);
    if (statics != StaticsModel::wrench) continue;
    for (int a = 0; a < 6; ++a) r.wrench[a] = value(Channel::balance, a);
  }
}

}  // namespace cdprcal
