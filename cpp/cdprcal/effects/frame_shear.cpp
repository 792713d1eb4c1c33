// The frame is out of square.
#include <Eigen/LU>

#include "cdprcal/effects/moved_pulleys.hpp"

namespace cdprcal {
namespace {

/// By how much the angles between x and y, x and z, y and z differ from right ones. The half on
/// either axis: no turn of the frame as a whole is in it.
Matrix3 strain(const EffectValues& shear_rad) {
  Matrix3 out = Matrix3::Zero();
  out(0, 1) = out(1, 0) = 0.5 * shear_rad[0];
  out(0, 2) = out(2, 0) = 0.5 * shear_rad[1];
  out(1, 2) = out(2, 1) = 0.5 * shear_rad[2];
  return out;
}

class FrameShear final : public FrameShape {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "frame_shear",
        .equation = "d* = c + (1 + E) (d - c), E = [0 xy xz; xy 0 yz; xz yz 0] / 2",
        .parameters = {{.name = "xy_rad",
                        .unit = "rad",
                        .shape = ParameterShape::scalar,
                        .typical = 0.002,
                        .plausible = 0.02},
                       {.name = "xz_rad",
                        .unit = "rad",
                        .shape = ParameterShape::scalar,
                        .typical = 0.002,
                        .plausible = 0.02},
                       {.name = "yz_rad",
                        .unit = "rad",
                        .shape = ParameterShape::scalar,
                        .typical = 0.002,
                        .plausible = 0.02}},
        .scope = EffectScope::robot,
        .confused_with = {"frame_anchors", "base_tilt"},
        .sentence = "the frame is out of square: its pulleys stand on a slanted box",
        .remedy = "square the frame, or correct the pulley positions in the robot file",
        .settle = "compare the diagonals between the pulleys by tape"};
    return info;
  }

 protected:
  [[nodiscard]] Vector3 moved(const EffectValues& shear_rad, const Vector3& place_m,
                              const Vector3&) const override {
    return place_m + strain(shear_rad) * place_m;
  }
  [[nodiscard]] Eigen::Matrix3Xd by_value(const EffectValues& shear_rad, const Vector3& place_m,
                                          const Vector3&) const override {
    const Vector3 right = (Matrix3::Identity() + strain(shear_rad)).inverse() * place_m;
    Matrix3 out;
    for (int k = 0; k < 3; ++k) out.col(k) = strain(Vector3::Unit(k)) * right;
    return out;
  }
};

}  // namespace

std::shared_ptr<const Effect> frame_shear() { return std::make_shared<FrameShear>(); }

}  // namespace cdprcal
