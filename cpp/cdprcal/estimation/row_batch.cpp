#include "cdprcal/estimation/row_batch.hpp"

#include "cdprcal/geometry/euler_equations.hpp"
#include "cdprcal/kinematics/cable_equations.hpp"
#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"
#include "cdprcal/statics/balance_equations.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

/// The arrays of a batch, seen from some of its lanes.
template <typename V>
struct View {
  const RowBatch& in;
  Lanes<V> pose, readings, tension, whitening;
  WritableLanes<V> rows, by_offset, values, state, columns;

  CDPRCAL_INLINE View(const RowBatch& batch, int first)
      : in(batch),
        pose(batch.poses, first),
        readings(batch.readings, first),
        tension(batch.tension, first),
        whitening(batch.whitening, first),
        rows(batch.rows, first),
        by_offset(batch.by_offset, first),
        values(batch.values, first),
        state(batch.state, first),
        columns(batch.columns, first) {}

  CDPRCAL_INLINE Triple<V> triple(int number) const {
    return {state[number], state[number + 1], state[number + 2]};
  }
  CDPRCAL_INLINE void set(int number, const Triple<V>& value) const {
    state.set(number, value.x);
    state.set(number + 1, value.y);
    state.set(number + 2, value.z);
  }
};

/// Eqs 13, 16 and every sensor beyond them, the balance at tensions alone excepted:
/// F = (m(ζ) − reading − offset) / σ, angles wrapped; derivatives likewise. Where there is no
/// reading all is zero. Returns 1/σ, or 0.
template <typename V, typename Row>
CDPRCAL_INLINE V residual_row(const View<V>& view, int slot, const V& predicted,
                              const Row& by_twist) {
  const RowSlot& at = view.in.layout.slots[static_cast<std::size_t>(slot)];
  const V reading = view.readings[at.reading];
  const auto present = finite(reading);
  const V weight = present ? view.readings[at.weight] : V{};
  V residual = predicted - (present ? reading : V{});
  if (slot < view.in.layout.offsets()) {
    residual -= view.in.offsets[slot];
    view.by_offset.set(slot, -weight);
  }
  if (at.angle) residual = wrap_angle(residual);
  for (int a = 0; a < 6; ++a) view.rows.set(kRow * slot + a, weight * by_twist[a]);
  view.rows.set(kRow * slot + 6, weight * residual);
  view.values.set(slot, weight != V{} ? residual : V{} + kNaN);
  return weight;
}

/// The balance Ξᵀτ* − f, its six rows mixed so that they are independent and of unit variance.
template <typename V, typename Balance, typename ByTwist>
CDPRCAL_INLINE void balance_rows(const View<V>& view, int slot, const Balance& balance,
                                 const ByTwist& by_twist) {
  for (int i = 0; i < 6; ++i) {
    V residual = {};
    V row[6] = {};
    for (int k = 0; k < 6; ++k) {
      const V weight = view.whitening[6 * i + k];
      residual += weight * balance[k];
      for (int a = 0; a < 6; ++a) row[a] += weight * by_twist[k][a];
    }
    for (int a = 0; a < 6; ++a) view.rows.set(kRow * (slot + i) + a, row[a]);
    view.rows.set(kRow * (slot + i) + 6, residual);
    view.values.set(slot + i, balance[i]);
  }
}

/// Where predictions go: to residuals at once, or as they are for effects to change.
template <typename V, bool kAtOnce>
struct Emit {
  const View<V>& view;
  template <typename Row>
  CDPRCAL_INLINE void operator()(int slot, const V& predicted, const Row& by_twist) const {
    if constexpr (kAtOnce) {
      residual_row(view, slot, predicted, by_twist);
    } else {
      for (int a = 0; a < 6; ++a) view.rows.set(kRow * slot + a, by_twist[a]);
      view.rows.set(kRow * slot + 6, predicted);
    }
  }
};

/// R_world_platform as the kinematics left it.
template <typename V>
CDPRCAL_INLINE void rotation_of(const View<V>& view, V (&r)[3][3]) {
  const int at = StateNumbers::rotation(view.in.layout.cables);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r[i][j] = view.state[at + 3 * i + j];
  }
}

/// Ξᵀτ* − f at given tensions (eq. 6), or the tensions of eqs 10–12 as tensions_left_inverse has
/// them.
template <typename Kind, bool kAtOnce, typename V = typename Kind::V>
CDPRCAL_INLINE void balance(const View<V>& view, const V (&r)[3][3], const Attitude<V>& attitude,
                            const CableStatics<V>* statics) {
  const RowBatch& in = view.in;
  const int n = in.layout.cables, slot = in.layout.slot(Channel::balance);
  const Emit<V, kAtOnce> emit{view};
  const Vector3 g = in.robot.gravity_force_N();
  const Triple<V> gravity{V{} + g.x(), V{} + g.y(), V{} + g.z()};
  const Triple<V> mass_arm = rotate(r, in.robot.platform.centre_of_mass_m);
  V tension[kMaxCables], wrench[6];
  Stiffness<V> stiffness;
  if (in.layout.statics == StaticsModel::wrench) {
    for (int i = 0; i < n; ++i) tension[i] = view.tension[i];
    balance_of(statics, n, tension, gravity, mass_arm, wrench, stiffness);
    if constexpr (kAtOnce) {
      balance_rows(view, slot, wrench, stiffness.k);
    } else {
      for (int i = 0; i < 6; ++i) emit(slot + i, wrench[i], stiffness.k[i]);
    }
    return;
  }

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
  const V w = view.readings[in.layout.slots[static_cast<std::size_t>(slot)].weight];
  // kSingular of tension.cpp; or not asked for
  in.valid &= all((condition < 1e12) | (w == V{}));
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
  const auto asked = w != V{};  // else 0 · NaN
  for (int i = 0; i < n; ++i) {
    V row[6] = {};
    for (int k = 0; k < n; ++k) {
      for (int a = 0; a < 6; ++a) row[a] += inverse[i][k] * right[k][a];
    }
    for (V& number : row) number = asked ? number : V{};
    emit(slot + i, asked ? tension[i] : V{}, row);
  }
}

/// Lanes `first` … of a batch: kinematics, and with kAtOnce the balance too.
template <typename Kind, bool kAtOnce, typename V = typename Kind::V>
CDPRCAL_INLINE void geometry(const RowBatch& in, int first) {
  const View<V> view(in, first);
  const RowLayout& at = in.layout;
  const int n = at.cables;
  const Emit<V, kAtOnce> emit{view};
  const Triple<V> p{view.pose[0], view.pose[1], view.pose[2]};
  V r[3][3];
  rotation_matrix(view.pose, r);
  auto valid = finite(p.x) & finite(p.y) & finite(p.z);

  CableStatics<V> statics[kMaxCables];
  const int direct = at.slot(Channel::direct_length);
  const bool balanced = kAtOnce && at.slot(Channel::balance) >= 0;
  for (int i = 0; i < n; ++i) {
    const Cable& cable = in.robot.cables[static_cast<std::size_t>(i)];
    const Triple<V> arm = rotate(r, cable.platform_anchor_m);
    const Vector3& d = cable.pulley.position_m;
    const Triple<V> q{p.x + arm.x - d.x(), p.y + arm.y - d.y(), p.z + arm.z - d.z()};
    const CableEquations<V> s = cable_equations<Kind>(cable.pulley, q);
    valid &= s.is_tangent();
    const Twist<V> pull = twist_of(s.direction, arm), swivel = twist_of(s.groove_normal, arm);
    const V per_radius = 1.0 / s.radial_distance_m;
    emit(i, s.length_m, pull);
    emit(n + i, s.swivel_rad, per_radius * swivel);
    if (direct >= 0) emit(direct + i, s.length_m, pull);
    if (balanced) {
      statics[i].arm = arm;
      statics[i].direction = s.direction;
      statics[i].pull = pull;
      statics[i].swivel = swivel;
      statics[i].tangency = twist_of(s.contact, arm);
      statics[i].by_swivel = s.sin_tangency * per_radius;
      statics[i].by_tangency = 1.0 / s.free_length_m;
    }
    if constexpr (!kAtOnce) {
      using S = StateNumbers;
      const int to = S::cable(i);
      view.state.set(to + S::length, s.length_m);
      view.state.set(to + S::swivel, s.swivel_rad);
      view.state.set(to + S::tangency, s.tangency_rad);
      view.state.set(to + S::free, s.free_length_m);
      view.state.set(to + S::radial_distance, s.radial_distance_m);
      view.state.set(to + S::sin_tangency, s.sin_tangency);
      view.set(to + S::radial, s.radial);
      view.set(to + S::groove_normal, s.groove_normal);
      view.set(to + S::contact, s.contact);
      view.set(to + S::direction, s.direction);
      view.set(to + S::arm, arm);
    }
  }
  if constexpr (!kAtOnce) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) view.state.set(StateNumbers::rotation(n) + 3 * i + j, r[i][j]);
    }
    view.set(StateNumbers::mass_arm(n), rotate(r, in.robot.platform.centre_of_mass_m));
  }

  Attitude<V> attitude;
  attitude_of<Kind>(r, in.robot.euler_convention, attitude);
  valid &= attitude.cos_middle > 1e-12;  // gimbal lock
  const auto angle = [&](int slot, int which) CDPRCAL_INLINE_LAMBDA {
    const V* by_omega = attitude.by_omega[which];
    const V row[6] = {V{}, V{}, V{}, by_omega[0], by_omega[1], by_omega[2]};
    emit(slot, attitude.angle[which], row);
  };
  angle(2 * n, 2);
  if (const int slot = at.slot(Channel::roll_pitch); slot >= 0) {
    for (int which = 0; which < 2; ++which) angle(slot + which, which);
  }
  if (const int slot = at.slot(Channel::absolute_yaw); slot >= 0) angle(slot, 2);
  if (const int slot = at.slot(Channel::position); slot >= 0) {
    for (int axis = 0; axis < 3; ++axis) {
      V unit[6] = {};
      unit[axis] = V{} + 1.0;
      emit(slot + axis, view.pose[axis], unit);
    }
  }
  if (const int slot = at.slot(Channel::specific_force); slot >= 0) {
    const Triple<V> up{V{}, V{}, V{} + in.robot.gravity_m_s2};
    for (int axis = 0; axis < 3; ++axis) {
      const Triple<V> own{r[0][axis], r[1][axis], r[2][axis]};
      const Triple<V> turn = cross(own, up);
      const V row[6] = {V{}, V{}, V{}, turn.x, turn.y, turn.z};
      emit(slot + axis, dot(own, up), row);
    }
  }
  in.valid &= all(valid);
  if (balanced) balance<Kind, kAtOnce>(view, r, attitude, statics);
}

template <typename Kind>
CDPRCAL_INLINE void everything(const RowBatch& in, int first) {
  geometry<Kind, true>(in, first);
}

template <typename Kind>
CDPRCAL_INLINE void kinematics(const RowBatch& in, int first) {
  geometry<Kind, false>(in, first);
}

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void statics(const RowBatch& in, int first) {
  const View<V> view(in, first);
  V r[3][3];
  rotation_of(view, r);
  Attitude<V> attitude;
  attitude_of<Kind>(r, in.robot.euler_convention, attitude);
  CableStatics<V> statics[kMaxCables];
  for (int i = 0; i < in.layout.cables; ++i) {
    using S = StateNumbers;
    const int from = S::cable(i);
    CableStatics<V>& s = statics[i];
    s.arm = view.triple(from + S::arm);
    s.direction = view.triple(from + S::direction);
    s.pull = twist_of(s.direction, s.arm);
    s.swivel = twist_of(view.triple(from + S::groove_normal), s.arm);
    s.tangency = twist_of(view.triple(from + S::contact), s.arm);
    s.by_swivel = view.state[from + S::sin_tangency] / view.state[from + S::radial_distance];
    s.by_tangency = 1.0 / view.state[from + S::free];
  }
  balance<Kind, false>(view, r, attitude, statics);
}

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void finish(const RowBatch& in, int first) {
  const View<V> view(in, first);
  const RowLayout& at = in.layout;
  const int mixed = at.statics == StaticsModel::wrench ? at.slot(Channel::balance) : -1;
  for (int s = 0; s < at.size(); ++s) {
    if (s == mixed) break;  // the last slots
    // Effects may leave anything where nothing is read.
    const auto present = finite(view.readings[at.slots[static_cast<std::size_t>(s)].reading]);
    V number[kRow];
    for (int a = 0; a < kRow; ++a) number[a] = present ? view.rows[kRow * s + a] : V{};
    const V weight = residual_row(view, s, number[6], number);
    for (int k = 0; k < at.columns; ++k) {
      const V column = present ? view.columns[s * at.columns + k] : V{};
      view.columns.set(s * at.columns + k, weight * column);
    }
  }
  if (mixed < 0) return;
  V balance[6], by_twist[6][6];
  for (int i = 0; i < 6; ++i) {
    balance[i] = view.rows[kRow * (mixed + i) + 6];
    for (int a = 0; a < 6; ++a) by_twist[i][a] = view.rows[kRow * (mixed + i) + a];
  }
  balance_rows(view, mixed, balance, by_twist);
  for (int k = 0; k < at.columns; ++k) {
    V column[6];
    for (int i = 0; i < 6; ++i) column[i] = view.columns[(mixed + i) * at.columns + k];
    for (int i = 0; i < 6; ++i) {
      V sum = {};
      for (int j = 0; j < 6; ++j) sum += view.whitening[6 * i + j] * column[j];
      view.columns.set((mixed + i) * at.columns + k, sum);
    }
  }
}

CDPRCAL_DEFINE_FOR_PROCESSORS(everything_lanes, everything, RowBatch)
CDPRCAL_DEFINE_FOR_PROCESSORS(kinematics_lanes, kinematics, RowBatch)
CDPRCAL_DEFINE_FOR_PROCESSORS(statics_lanes, statics, RowBatch)
CDPRCAL_DEFINE_FOR_PROCESSORS(finish_lanes, finish, RowBatch)

}  // namespace

void write_rows(const RowBatch& in) { everything_lanes(in); }
void predict_geometry(const RowBatch& in) { kinematics_lanes(in); }
void predict_balance(const RowBatch& in) { statics_lanes(in); }
void finish_rows(const RowBatch& in) { finish_lanes(in); }

}  // namespace cdprcal
