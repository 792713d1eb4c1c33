#include "cdprcal/estimation/row_batch.hpp"

#include "cdprcal/geometry/euler_equations.hpp"
#include "cdprcal/kinematics/cable_equations.hpp"
#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"
#include "cdprcal/statics/balance_equations.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

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

/// Lanes `first` … of a batch.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void write(const RowBatch& in, int first) {
  const RowLayout& at = in.layout;
  const int n = at.cables;
  const Lanes<V> pose(in.poses, first), readings(in.readings, first),
      whitening(in.whitening, first);
  const RowWriterLanes<V> rows{{in.rows, first}, {in.by_offset, first}, {in.values, first}};
  const auto slot = [&](Channel channel) CDPRCAL_INLINE_LAMBDA { return at[channel].slot; };
  const auto weight = [&](Channel channel)
                          CDPRCAL_INLINE_LAMBDA { return readings[at[channel].weight]; };
  const auto reading = [&](Channel channel, int index)
                           CDPRCAL_INLINE_LAMBDA { return readings[at[channel].reading + index]; };
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
    if (slot(Channel::direct_length) >= 0) {  // F_d
      V length = reading(Channel::direct_length, i);
      const V w = weight_of(length, weight(Channel::direct_length));
      rows.absolute(slot(Channel::direct_length) + i, s.length_m - length, w, pull);
    }
    if (slot(Channel::balance) >= 0) {
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
  if (slot(Channel::roll_pitch) >= 0) {  // F_ε: roll and pitch
    for (int angle = 0; angle < 2; ++angle) {
      V read = reading(Channel::roll_pitch, angle);
      const V w = weight_of(read, weight(Channel::roll_pitch));
      rows.absolute(slot(Channel::roll_pitch) + angle, wrap_angle(V(attitude.angle[angle] - read)),
                    w, turning(angle));
    }
  }
  if (slot(Channel::absolute_yaw) >= 0) {  // F_χ
    V read = reading(Channel::absolute_yaw, 0);
    const V w = weight_of(read, weight(Channel::absolute_yaw));
    rows.absolute(slot(Channel::absolute_yaw), wrap_angle(V(attitude.angle[2] - read)), w,
                  turning(2));
  }
  if (slot(Channel::position) >= 0) {  // F_p
    for (int axis = 0; axis < 3; ++axis) {
      V read = reading(Channel::position, axis);
      const V w = weight_of(read, weight(Channel::position));
      std::array<V, 6> unit{};
      unit[static_cast<std::size_t>(axis)] = V{} + 1.0;
      rows.absolute(slot(Channel::position) + axis, pose[axis] - read, w, unit);
    }
  }
  if (slot(Channel::balance) < 0) {
    in.valid &= all(valid);
    return;
  }

  const Vector3 g = in.robot.gravity_force_N();
  const Triple<V> gravity{V{} + g.x(), V{} + g.y(), V{} + g.z()};
  const Triple<V> mass_arm = rotate(r, in.robot.platform.centre_of_mass_m);
  V tension[kMaxCables], wrench[6];
  Stiffness<V> stiffness;
  if (at.statics == StaticsModel::wrench) {  // eq. 6
    for (int i = 0; i < n; ++i) tension[i] = reading(Channel::balance, i);
    balance_of(statics, n, tension, gravity, mass_arm, wrench, stiffness);
    for (int i = 0; i < 6; ++i) {
      V value = {};
      std::array<V, 6> row{};
      for (int k = 0; k < 6; ++k) {
        const V w = whitening[6 * i + k];
        value += w * wrench[k];
        for (std::size_t a = 0; a < 6; ++a) row[a] += w * stiffness.k[k][a];
      }
      rows.absolute(slot(Channel::balance) + i, value, V{} + 1.0, row);
      rows.values.set(slot(Channel::balance) + i, wrench[i]);
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
    rows.absolute(slot(Channel::balance) + i,
                  asked ? tension[i] - reading(Channel::balance, i) : V{}, w, row);
  }
  in.valid &= all(valid);
}

CDPRCAL_DEFINE_FOR_PROCESSORS(write_lanes, write, RowBatch)

}  // namespace

void write_batch(const RowBatch& in) { write_lanes(in); }

}  // namespace cdprcal
