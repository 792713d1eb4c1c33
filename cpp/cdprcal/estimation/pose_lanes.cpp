#include "cdprcal/estimation/pose_lanes.hpp"

#include <algorithm>
#include <array>

#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

struct Move {
  const double* from;
  const double* twists;
  double* to;
  double* squared_norm;  ///< [lane]: ‖p‖² of `from`
};

/// plus() and exp_so3() of pose.cpp.
template <typename Kind>
CDPRCAL_INLINE void move(const Move& in, int first) {
  using V = typename Kind::V;
  const Lanes<V> from(in.from, first), twist(in.twists, first);
  const WritableLanes<V> to(in.to, first);
  V squares = {};
  for (int a = 0; a < 3; ++a) {
    squares += from[a] * from[a];
    to.set(a, from[a] + twist[a]);
  }
  WritableLanes<V>(in.squared_norm, first).set(0, squares);

  const Triple<V> turn{twist[3], twist[4], twist[5]};
  const V angle_squared = dot(turn, turn);
  const auto small = angle_squared < 1e-8;  // Taylor: exact to double precision here
  const V angle = Kind::sqrt(small ? V{} + 1.0 : angle_squared);
  const V dw = small ? 1.0 - angle_squared * 0.125 : Kind::cos(V(0.5 * angle));
  const V scale = small ? 0.5 - angle_squared * (1.0 / 48.0) : Kind::sin(V(0.5 * angle)) / angle;
  const Triple<V> d = scale * turn;
  const Triple<V> q{from[3], from[4], from[5]};
  const V w = from[6];
  const Triple<V> v = dw * q + w * d + cross(d, q);
  const V real = dw * w - dot(d, q);
  const V norm = 1.0 / Kind::sqrt(dot(v, v) + real * real);
  to.set(3, norm * v.x);
  to.set(4, norm * v.y);
  to.set(5, norm * v.z);
  to.set(6, norm * real);
}

CDPRCAL_DEFINE_FOR_PROCESSORS(move_lanes, move, Move)

}  // namespace

PoseLanes::PoseLanes(std::size_t size)
    : size_(size), numbers_(buffer(std::max<std::size_t>(1, batches(size)) * kNumbers)) {}

Pose PoseLanes::operator[](std::size_t pose) const {
  const double* at = numbers_.get() + first(pose);
  const auto number = [at](int index) { return at[index * kLanes]; };
  return {{number(0), number(1), number(2)}, {number(6), number(3), number(4), number(5)}};
}

void PoseLanes::set(std::size_t pose, const Pose& value) {
  const std::size_t end = pose + 1 < size_ ? pose + 1 : batches(size_) * kLanes;
  for (std::size_t lane = pose; lane < end; ++lane) {
    double* at = numbers_.get() + first(lane);
    for (int a = 0; a < 3; ++a) at[a * kLanes] = value.position_m[a];
    for (int a = 0; a < 4; ++a) at[(3 + a) * kLanes] = value.rotation.coeffs()[a];
  }
}

double PoseLanes::move(std::size_t batch, const PoseLanes& from, const double* twists) {
  alignas(kLanes * sizeof(double)) std::array<double, kLanes> squared_norm;
  move_lanes(
      {from.batch(batch), twists, numbers_.get() + batch * kNumbers * kLanes, squared_norm.data()});
  double sum = 0.0;
  const std::size_t poses = std::min<std::size_t>(kLanes, size_ - batch * kLanes);
  for (std::size_t l = 0; l < poses; ++l) sum += squared_norm[l] + 1.0;
  return sum;
}

}  // namespace cdprcal
