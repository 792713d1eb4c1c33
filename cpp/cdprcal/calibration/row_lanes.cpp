#include "cdprcal/calibration/row_lanes.hpp"

#include <algorithm>

#include "cdprcal/calibration/presence.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/kinematics/cable_equations.hpp"
#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

constexpr int kRow = 7;  // six derivatives and the residual

/// One batch and all it is made from.
struct RowBatch {
  const RowLanes::Layout& layout;
  const Robot& robot;
  const std::vector<WrenchRow>& left_inverse_rows;
  const double* offsets;  ///< m(ζ0) + e, one number each
  const double* poses;
  const double* readings;
  const double* whitening;
  double* rows;
  double* by_offset;
  double* values;
  bool& valid;  ///< becomes false where a pose is not
};

/// (v, a × v): derivative along a twist of what has gradient v at an arm a.
template <typename V>
struct Twist {
  Triple<V> linear, angular;
  CDPRCAL_INLINE V operator[](int i) const {
    return i < 3 ? part(linear, i) : part(angular, i - 3);
  }
  static CDPRCAL_INLINE V part(const Triple<V>& t, int i) {
    return i == 0 ? t.x : i == 1 ? t.y : t.z;
  }
};
template <typename V>
CDPRCAL_INLINE Twist<V> twist_of(const Triple<V>& gradient, const Triple<V>& arm) {
  return {gradient, cross(arm, gradient)};
}
template <typename V>
CDPRCAL_INLINE Twist<V> operator*(const V& factor, const Twist<V>& twist) {
  return {factor * twist.linear, factor * twist.angular};
}

/// Writes whitened rows of some lanes; residual and derivatives of what is missing are zero.
template <typename V>
struct RowWriterLanes {
  WritableLanes<V> rows, by_offset, values;

  template <typename Row>
  CDPRCAL_INLINE void absolute(int slot, const V& value, const V& weight,
                               const Row& by_twist) const {
    for (int a = 0; a < 6; ++a) rows.set(kRow * slot + a, weight * by_twist[a]);
    rows.set(kRow * slot + 6, weight * value);
    values.set(slot, weight != V{} ? value : V{} + kNaN);
  }
  template <typename Row>
  CDPRCAL_INLINE void relative(int slot, const V& value, const V& weight,
                               const Row& by_twist) const {
    absolute(slot, value, weight, by_twist);
    by_offset.set(slot, -weight);
  }
};

/// Where a reading is one: its weight; elsewhere 0, and the reading 0 too.
template <typename V>
CDPRCAL_INLINE V weight_of(V& reading, const V& weight) {
  const auto present = finite(reading);
  reading = present ? reading : V{};
  return present ? weight : V{};
}

/// Euler angles, their rates, and what the rates are as functions of ω: euler.cpp, away from gimbal
/// lock.
template <typename V>
struct Attitude {
  int a, b, c;  ///< first, second, third axis
  V angle[3];
  V axis[3][3];      ///< [angle][world axis]: column of H
  V by_omega[3][3];  ///< [angle][world axis]: H⁻¹
  V cos_middle;
};
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void attitude_of(const V (&r)[3][3], EulerConvention convention, Attitude<V>& out) {
  const std::array<int, 3> axes = euler_axes(convention);
  const int a = axes[0], b = axes[1], c = axes[2];
  out.a = a, out.b = b, out.c = c;
  const double sign = (b - a + 3) % 3 == 1 ? 1.0 : -1.0;
  out.cos_middle = Kind::sqrt(r[a][a] * r[a][a] + r[a][b] * r[a][b]);
  const V scale = 1.0 / Kind::sqrt(r[b][c] * r[b][c] + r[c][c] * r[c][c]);
  const V cos_first = r[c][c] * scale, sin_first = -r[b][c] * scale;
  out.angle[a] = Kind::atan2(V(sign * sin_first), cos_first);
  out.angle[b] = Kind::atan2(V(sign * r[a][c]), out.cos_middle);
  out.angle[c] = Kind::atan2(V(sign * (cos_first * r[b][a] + sin_first * r[c][a])),
                             V(cos_first * r[b][b] + sin_first * r[c][b]));
  const V none = {}, one = V{} + 1.0;
  out.axis[a][a] = one, out.axis[a][b] = none, out.axis[a][c] = none;
  out.axis[b][a] = none, out.axis[b][b] = cos_first, out.axis[b][c] = sin_first;
  for (int i = 0; i < 3; ++i) out.axis[c][i] = r[i][c];
  const V per_cos = 1.0 / out.cos_middle;
  const V sin_part = sin_first * per_cos, cos_part = cos_first * per_cos;
  out.by_omega[a][a] = one;
  out.by_omega[a][b] = r[a][c] * sin_part;
  out.by_omega[a][c] = -r[a][c] * cos_part;
  out.by_omega[b][a] = none, out.by_omega[b][b] = cos_first, out.by_omega[b][c] = sin_first;
  out.by_omega[c][a] = none, out.by_omega[c][b] = -sin_part, out.by_omega[c][c] = cos_part;
}

/// What the statics need of a cable: eq. A5 is a sum of two outer products (tension_stiffness).
template <typename V>
struct CableStatics {
  Triple<V> arm, direction;
  Twist<V> pull, swivel, tangency;
  V by_swivel, by_tangency;  ///< stiffness a newton
};

/// ∂(Ξᵀτ − f) along a twist at constant tensions, and its parts.
template <typename V>
struct Stiffness {
  V k[6][6] = {};
  CDPRCAL_INLINE void add_lower(const Twist<V>& t, const V& factor) {
    for (int i = 0; i < 6; ++i) {
      const V scaled = factor * t[i];
      for (int j = 0; j <= i; ++j) k[i][j] += scaled * t[j];
    }
  }
  CDPRCAL_INLINE void mirror() {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < i; ++j) k[j][i] = k[i][j];
    }
  }
  /// ∂(a × f) for a force f at an arm a: a fᵀ − (f·a) 1.
  CDPRCAL_INLINE void add_force(const Triple<V>& arm, const Triple<V>& force) {
    const V work = dot(arm, force);
    const V a[3] = {arm.x, arm.y, arm.z}, f[3] = {force.x, force.y, force.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) k[3 + i][3 + j] += a[i] * f[j];
      k[3 + i][3 + i] -= work;
    }
  }
};

/// Stiffness and balance at tensions τ.
template <typename V>
CDPRCAL_INLINE void balance_of(const CableStatics<V>* cable, int cables, const V* tension_N,
                               const Triple<V>& gravity_N, const Triple<V>& mass_arm_m,
                               V (&wrench)[6], Stiffness<V>& stiffness) {
  for (int i = 0; i < 6; ++i) wrench[i] = V{};
  for (int i = 0; i < cables; ++i) {
    const CableStatics<V>& c = cable[i];
    for (int a = 0; a < 6; ++a) wrench[a] += tension_N[i] * c.pull[a];
    stiffness.add_lower(c.swivel, tension_N[i] * c.by_swivel);
    stiffness.add_lower(c.tangency, tension_N[i] * c.by_tangency);
  }
  stiffness.mirror();
  for (int i = 0; i < cables; ++i) {
    stiffness.add_force(cable[i].arm, tension_N[i] * cable[i].direction);
  }
  const Twist<V> weight = twist_of(gravity_N, mass_arm_m);
  for (int a = 0; a < 6; ++a) wrench[a] -= weight[a];
  stiffness.add_force(mass_arm_m, V(V{} - 1.0) * gravity_N);
}

/// Inverse by Gauss–Jordan with pivots of each lane's own. Returns ‖A‖₁ ‖A⁻¹‖₁.
template <typename V>
CDPRCAL_INLINE V invert(int n, const V (&matrix)[6][6], V (&inverse)[6][6]) {
  V a[6][12];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      a[i][j] = matrix[i][j];
      a[i][n + j] = V{} + (i == j ? 1.0 : 0.0);
    }
  }
  const auto magnitude = [](const V& v) CDPRCAL_INLINE_LAMBDA { return v < V{} ? -v : v; };
  for (int k = 0; k < n; ++k) {
    for (int i = k + 1; i < n; ++i) {
      const auto larger = magnitude(a[i][k]) > magnitude(a[k][k]);
      for (int j = k; j < 2 * n; ++j) {
        const V upper = a[k][j], lower = a[i][j];
        a[k][j] = larger ? lower : upper;
        a[i][j] = larger ? upper : lower;
      }
    }
    const V scale = 1.0 / a[k][k];
    for (int j = k; j < 2 * n; ++j) a[k][j] *= scale;
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const V factor = a[i][k];
      for (int j = k; j < 2 * n; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  V largest = {}, largest_inverse = {};
  for (int j = 0; j < n; ++j) {
    V sum = {}, sum_inverse = {};
    for (int i = 0; i < n; ++i) {
      inverse[i][j] = a[i][n + j];
      sum += magnitude(matrix[i][j]);
      sum_inverse += magnitude(inverse[i][j]);
    }
    largest = sum > largest ? sum : largest;
    largest_inverse = sum_inverse > largest_inverse ? sum_inverse : largest_inverse;
  }
  return largest * largest_inverse;
}

/// Lanes `first` … of a batch.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void write(const RowBatch& in, int first) {
  const RowLanes::Layout& at = in.layout;
  const int n = at.cables;
  const Lanes<V> pose(in.poses, first), readings(in.readings, first),
      whitening(in.whitening, first);
  const RowWriterLanes<V> rows{{in.rows, first}, {in.by_offset, first}, {in.values, first}};
  const auto weight = [&](Channel channel) CDPRCAL_INLINE_LAMBDA {
    return readings[at.weight[static_cast<std::size_t>(channel)]];
  };
  const auto reading = [&](Channel channel, int index) CDPRCAL_INLINE_LAMBDA {
    return readings[at.reading[static_cast<std::size_t>(channel)] + index];
  };
  const Triple<V> p{pose[0], pose[1], pose[2]};
  V r[3][3];
  rotation_matrix(pose, r);
  auto valid = finite(p.x) & finite(p.y) & finite(p.z);

  CableStatics<V> statics[kMaxCables];
  for (int i = 0; i < n; ++i) {
    const Cable& cable = in.robot.cables[static_cast<std::size_t>(i)];
    const Triple<V> arm = rotate(r, cable.platform_anchor_m);
    const Vector3& d = cable.pulley.position_m;
    const Triple<V> q{p.x + arm.x - d.x(), p.y + arm.y - d.y(), p.z + arm.z - d.z()};
    const CableEquations<V> s = cable_equations<Kind>(cable.pulley, q);
    valid &= s.is_tangent();
    const Twist<V> pull = twist_of(s.direction, arm), swivel = twist_of(s.groove_normal, arm);
    {  // F_l
      V change = reading(Channel::length, i);
      const V w = weight_of(change, weight(Channel::length));
      rows.relative(i, s.length_m - in.offsets[i] - change, w, pull);
    }
    const V per_radius = 1.0 / s.radial_distance_m;
    {  // F_σ
      V change = reading(Channel::swivel, i);
      const V w = weight_of(change, weight(Channel::swivel));
      const V value = wrap_angle(V(s.swivel_rad - in.offsets[n + i] - change));
      rows.relative(n + i, value, w, per_radius * swivel);
    }
    if (at.direct_length >= 0) {  // F_d
      V length = reading(Channel::direct_length, i);
      const V w = weight_of(length, weight(Channel::direct_length));
      rows.absolute(at.direct_length + i, s.length_m - length, w, pull);
    }
    if (at.balance >= 0) {
      statics[i].arm = arm;
      statics[i].direction = s.direction;
      statics[i].pull = pull;
      statics[i].swivel = swivel;
      statics[i].tangency = twist_of(s.contact, arm);
      statics[i].by_swivel = s.sin_tangency * per_radius;
      statics[i].by_tangency = 1.0 / s.free_length_m;
    }
  }

  Attitude<V> attitude;
  attitude_of<Kind>(r, in.robot.euler_convention, attitude);
  valid &= attitude.cos_middle > 1e-12;  // gimbal lock
  const auto turning = [&](int angle) CDPRCAL_INLINE_LAMBDA {
    const V* by_omega = attitude.by_omega[angle];
    return std::array<V, 6>{V{}, V{}, V{}, by_omega[0], by_omega[1], by_omega[2]};
  };
  {  // F_ε: the change of yaw
    V change = reading(Channel::yaw, 0);
    const V w = weight_of(change, weight(Channel::yaw));
    rows.relative(2 * n, wrap_angle(V(attitude.angle[2] - in.offsets[2 * n] - change)), w,
                  turning(2));
  }
  if (at.roll_pitch >= 0) {  // F_ε: roll and pitch
    for (int angle = 0; angle < 2; ++angle) {
      V read = reading(Channel::roll_pitch, angle);
      const V w = weight_of(read, weight(Channel::roll_pitch));
      rows.absolute(at.roll_pitch + angle, wrap_angle(V(attitude.angle[angle] - read)), w,
                    turning(angle));
    }
  }
  if (at.absolute_yaw >= 0) {  // F_χ
    V read = reading(Channel::absolute_yaw, 0);
    const V w = weight_of(read, weight(Channel::absolute_yaw));
    rows.absolute(at.absolute_yaw, wrap_angle(V(attitude.angle[2] - read)), w, turning(2));
  }
  if (at.position >= 0) {  // F_p
    for (int axis = 0; axis < 3; ++axis) {
      V read = reading(Channel::position, axis);
      const V w = weight_of(read, weight(Channel::position));
      std::array<V, 6> unit{};
      unit[static_cast<std::size_t>(axis)] = V{} + 1.0;
      rows.absolute(at.position + axis, pose[axis] - read, w, unit);
    }
  }
  if (at.balance < 0) {
    in.valid &= all(valid);
    return;
  }

  const Vector3 g = in.robot.gravity_force_N();
  const Triple<V> gravity{V{} + g.x(), V{} + g.y(), V{} + g.z()};
  const Triple<V> mass_arm = rotate(r, in.robot.platform.centre_of_mass_m);
  V tension[kMaxCables], wrench[6];
  Stiffness<V> stiffness;
  if (at.statics == StaticsModel::wrench) {  // eq. 6
    for (int i = 0; i < n; ++i) tension[i] = readings[at.tension + i];
    balance_of(statics, n, tension, gravity, mass_arm, wrench, stiffness);
    for (int i = 0; i < 6; ++i) {
      V value = {};
      std::array<V, 6> row{};
      for (int k = 0; k < 6; ++k) {
        const V w = whitening[6 * i + k];
        value += w * wrench[k];
        for (std::size_t a = 0; a < 6; ++a) row[a] += w * stiffness.k[k][a];
      }
      rows.absolute(at.balance + i, value, V{} + 1.0, row);
      rows.values.set(at.balance + i, wrench[i]);
    }
    in.valid &= all(valid);
    return;
  }

  // Eqs 10–12: tensions by the left inverse, as in tensions_left_inverse.
  const Twist<V> weight_wrench = twist_of(gravity, mass_arm);
  V system[6][6], inverse[6][6], load[6];
  for (int k = 0; k < n; ++k) {
    const int row = static_cast<int>(in.left_inverse_rows[static_cast<std::size_t>(k)]);
    if (row < 3) {
      for (int i = 0; i < n; ++i) system[k][i] = statics[i].pull[row];
      load[k] = weight_wrench[row];
    } else {
      const V* axis = attitude.axis[row - 3];
      const Triple<V> turn{axis[0], axis[1], axis[2]};
      for (int i = 0; i < n; ++i) system[k][i] = dot(turn, statics[i].pull.angular);
      load[k] = dot(turn, weight_wrench.angular);
    }
  }
  const V condition = invert(n, system, inverse);
  const V w = weight(Channel::balance);
  valid &= (condition < 1e12) | (w == V{});  // kSingular of tension.cpp; or not asked for
  for (int i = 0; i < n; ++i) {
    tension[i] = V{};
    for (int k = 0; k < n; ++k) tension[i] += inverse[i][k] * load[k];
  }
  balance_of(statics, n, tension, gravity, mass_arm, wrench, stiffness);
  const Triple<V> moment{wrench[3], wrench[4], wrench[5]};
  V right[6][6];
  for (int k = 0; k < n; ++k) {
    const int row = static_cast<int>(in.left_inverse_rows[static_cast<std::size_t>(k)]);
    if (row < 3) {
      for (int a = 0; a < 6; ++a) right[k][a] = -stiffness.k[row][a];
      continue;
    }
    const int angle = row - 3;
    const V* axis = attitude.axis[angle];
    for (int a = 0; a < 6; ++a) {
      right[k][a] = -(axis[0] * stiffness.k[3][a] + axis[1] * stiffness.k[4][a] +
                      axis[2] * stiffness.k[5][a]);
    }
    const Triple<V> turn{axis[0], axis[1], axis[2]};
    if (angle == attitude.b) {  // turns with the first angle
      const V* before = attitude.axis[attitude.a];
      const V part = dot(cross(Triple<V>{before[0], before[1], before[2]}, turn), moment);
      for (int a = 0; a < 3; ++a) right[k][3 + a] -= part * attitude.by_omega[attitude.a][a];
    } else if (angle == attitude.c) {  // fixed in the platform
      const Triple<V> part = cross(turn, moment);
      right[k][3] -= part.x;
      right[k][4] -= part.y;
      right[k][5] -= part.z;
    }
  }
  for (int i = 0; i < n; ++i) {
    std::array<V, 6> row{};
    for (int k = 0; k < n; ++k) {
      for (std::size_t a = 0; a < 6; ++a) row[a] += inverse[i][k] * right[k][a];
    }
    // 0 · NaN where nothing is asked for.
    const auto asked = w != V{};
    for (V& number : row) number = asked ? number : V{};
    rows.absolute(at.balance + i, asked ? tension[i] - readings[at.tension + i] : V{}, w, row);
  }
  in.valid &= all(valid);
}

CDPRCAL_DEFINE_FOR_PROCESSORS(write_batch, write, RowBatch)

}  // namespace

bool RowLanes::serve(const CalibrationProblem& problem) { return problem.effects.empty(); }

Channel RowLanes::channel(int slot) const {
  const int n = layout_.cables;
  if (slot < n) return Channel::length;
  if (slot < 2 * n) return Channel::swivel;
  if (slot == 2 * n) return Channel::yaw;
  return own_channel_[static_cast<std::size_t>(slot - 2 * n - 1)];
}

int RowLanes::slot(Channel channel) const {
  switch (channel) {
    case Channel::length:
      return layout_.lengths ? 0 : -1;
    case Channel::swivel:
      return layout_.swivels ? layout_.cables : -1;
    case Channel::yaw:
      return layout_.yaw ? 2 * layout_.cables : -1;
    case Channel::roll_pitch:
      return layout_.roll_pitch;
    case Channel::balance:
      return layout_.balance;
    case Channel::absolute_yaw:
      return layout_.absolute_yaw;
    case Channel::direct_length:
      return layout_.direct_length;
    case Channel::position:
      return layout_.position;
  }
  return -1;
}

RowSlots RowLanes::slots(std::optional<Channel> without) const {
  RowSlots out;
  for (int s = 0; s < slot_count(); ++s) {
    if (channel(s) == without || slot(channel(s)) < 0) continue;
    out.index.push_back(s);
    if (s <= 2 * layout_.cables) ++out.offsets;
  }
  return out;
}

int RowLanes::reserve(Channel channel, int readings, int own_rows) {
  const auto c = static_cast<std::size_t>(channel);
  layout_.reading[c] = layout_.numbers;
  layout_.weight[c] = layout_.numbers + readings;
  layout_.numbers += readings + 1;
  const int slot = 2 * layout_.cables + 1 + static_cast<int>(own_channel_.size());
  own_channel_.insert(own_channel_.end(), static_cast<std::size_t>(own_rows), channel);
  return slot;
}

RowLanes::RowLanes(const CalibrationProblem& problem, const PoseCache& cache,
                   const ReferenceReadings& reference)
    : problem_(problem),
      cache_(cache),
      reference_(reference),
      batches_(lanes::batches(problem.measurements.size() - 1)) {
  const int n = problem.robot.cable_count();
  const std::size_t poses = problem.measurements.size() - 1;
  layout_.cables = n;
  reserve(Channel::length, n, 0);
  reserve(Channel::swivel, n, 0);
  reserve(Channel::yaw, 1, 0);
  layout_.lengths = is_read(problem, Channel::length);
  layout_.swivels = is_read(problem, Channel::swivel);
  layout_.yaw = is_read(problem, Channel::yaw);
  const auto optional = [&](Channel channel, int readings, int& slot) {
    if (is_read(problem, channel)) slot = reserve(channel, readings, readings);
  };
  optional(Channel::roll_pitch, 2, layout_.roll_pitch);
  optional(Channel::absolute_yaw, 1, layout_.absolute_yaw);
  optional(Channel::direct_length, n, layout_.direct_length);
  optional(Channel::position, 3, layout_.position);
  for (std::size_t i = 1; i <= poses; ++i) {
    if (layout_.balance >= 0 || cache.statics_of(i) == StaticsModel::none) continue;
    layout_.statics = cache.statics_of(i);
    const bool wrench = layout_.statics == StaticsModel::wrench;
    layout_.balance = reserve(Channel::balance, n, wrench ? 6 : n);
    layout_.tension = layout_.reading[static_cast<std::size_t>(Channel::balance)];
    if (wrench) whitening_ = lanes::buffer(batches_ * 36);
  }
  const auto slots = static_cast<std::size_t>(slot_count());
  rows_ = lanes::buffer(kRow * slots);
  by_offset_ = lanes::buffer(static_cast<std::size_t>(2 * n + 1));
  values_ = lanes::buffer(slots);
  const auto numbers = static_cast<std::size_t>(layout_.numbers);
  readings_ = lanes::buffer(std::max<std::size_t>(1, batches_) * numbers);
  for (std::size_t i = 0; i < batches_ * kLanes; ++i) {
    double* const out = readings_.get() + (i / kLanes) * numbers * kLanes + i % kLanes;
    if (i >= poses) {  // no reading, and no weight
      for (std::size_t k = 0; k < numbers; ++k) out[k * kLanes] = 0.0;
      continue;
    }
    const Measurement& m = problem.measurements[i + 1];
    const auto put = [&](Channel channel, int index, double value) {
      out[(layout_.reading[static_cast<std::size_t>(channel)] + index) * kLanes] = value;
    };
    const auto put_weight = [&](Channel channel) {
      out[layout_.weight[static_cast<std::size_t>(channel)] * kLanes] =
          cache.weight(i + 1, channel);
    };
    for (const Channel channel : {Channel::length, Channel::swivel, Channel::yaw}) {
      put_weight(channel);
    }
    for (int c = 0; c < n; ++c) {
      put(Channel::length, c, m.length_m[c] - reference.length_m[c]);
      put(Channel::swivel, c, m.swivel_rad[c] - reference.swivel_rad[c]);
    }
    put(Channel::yaw, 0, m.roll_pitch_yaw_rad[2] - reference.yaw_rad);
    if (layout_.roll_pitch >= 0) {
      put_weight(Channel::roll_pitch);
      for (int a = 0; a < 2; ++a) put(Channel::roll_pitch, a, m.roll_pitch_yaw_rad[a]);
    }
    if (layout_.absolute_yaw >= 0) {
      put_weight(Channel::absolute_yaw);
      put(Channel::absolute_yaw, 0, m.absolute_yaw_rad);
    }
    if (layout_.direct_length >= 0) {
      put_weight(Channel::direct_length);
      for (int c = 0; c < n; ++c) {
        put(Channel::direct_length, c, c < m.direct_length_m.size() ? m.direct_length_m[c] : kNaN);
      }
    }
    if (layout_.position >= 0) {
      put_weight(Channel::position);
      for (int a = 0; a < 3; ++a) put(Channel::position, a, m.position_m[a]);
    }
    if (layout_.balance >= 0) {
      const bool balanced = cache.statics_of(i + 1) != StaticsModel::none;
      for (int c = 0; c < n; ++c) put(Channel::balance, c, balanced ? m.tension_N[c] : 0.0);
    }
  }
}

void RowLanes::update_weights() {
  if (layout_.balance < 0 || weights_version_ == cache_.weights_version()) return;
  weights_version_ = cache_.weights_version();
  const std::size_t poses = problem_.measurements.size() - 1;
  const auto numbers = static_cast<std::size_t>(layout_.numbers);
  const auto weight =
      static_cast<std::size_t>(layout_.weight[static_cast<std::size_t>(Channel::balance)]);
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
