// What follows where the pulleys sit elsewhere than the robot file says.
#pragma once

#include <algorithm>

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// Derivatives of readings and balance by the places of the pulleys: ReadingRows × 3n, x, y, z of
/// one pulley after another [m]. Writes into a zeroed matrix.
inline void columns_of_pulley_places(const EffectContext& context, EffectColumns out) {
  const ReadingRows rows{context.state.cable_count};
  for (int i = 0; i < rows.cables; ++i) {  // q = a - d
    const CableState& cable = context.state.cable[i];
    out.row(rows.length() + i).segment<3>(3 * i) = -cable.direction.transpose();
    out.row(rows.swivel() + i).segment<3>(3 * i) = -swivel_by_q(cable).transpose();
    const Matrix3 force = -context.tension_N[i] * direction_by_q(cable);
    out.block<3, 3>(rows.wrench(), 3 * i) = force;
    out.block<3, 3>(rows.wrench() + 3, 3 * i) = skew(context.state.anchor_arm_m[i]) * force;
  }
}

/// How far out the pulleys stand from their middle along x, y, z; 1 where none does. A wrong shape
/// of the frame leaves the middle where it is, since readings cannot tell a shift of the whole
/// frame from one of the platform.
inline Vector3 reach_of_pulleys(const Robot& robot) {
  const Vector3 middle = middle_of_pulleys(robot);
  Vector3 out = Vector3::Zero();
  for (int i = 0; i < robot.cable_count(); ++i) {
    out = out.cwiseMax((robot.cables[i].pulley.position_m - middle).cwiseAbs());
  }
  return (out.array() > 1e-9).select(out, 1.0);
}

/// A frame of another shape: all pulleys move by few numbers together.
class FrameShape : public Effect {
 public:
  [[nodiscard]] bool moves_cables() const final { return true; }
  void apply(const EffectValues& values, Robot& robot) const final {
    const Vector3 middle = middle_of_pulleys(robot), reach = reach_of_pulleys(robot);
    for (int i = 0; i < robot.cable_count(); ++i) {
      Vector3& place = robot.cables[i].pulley.position_m;
      place = middle + moved(values, place - middle, reach);
    }
  }
  void columns(const EffectContext& context, const EffectValues& values,
               EffectColumns out) const final {
    const int n = context.state.cable_count;
    Eigen::MatrixXd by_place = Eigen::MatrixXd::Zero(out.rows(), 3 * n);
    columns_of_pulley_places(context, by_place);
    const Vector3 middle = middle_of_pulleys(context.robot);
    const Vector3 reach = reach_of_pulleys(context.robot);
    for (int i = 0; i < n; ++i) {
      const Vector3 place = context.robot.cables[i].pulley.position_m - middle;
      out += by_place.middleCols<3>(3 * i) * by_value(values, place, reach);
    }
  }

 protected:
  /// Where a pulley is, from the middle, that would be at `place_m` in a frame of the right shape;
  /// `reach_m`: of all pulleys.
  [[nodiscard]] virtual Vector3 moved(const EffectValues& values, const Vector3& place_m,
                                      const Vector3& reach_m) const = 0;
  /// Its derivatives by the values (3 × size) for one that is at `place_m` now.
  [[nodiscard]] virtual Eigen::Matrix3Xd by_value(const EffectValues& values,
                                                  const Vector3& place_m,
                                                  const Vector3& reach_m) const = 0;
};

}  // namespace cdprcal
