// The frame is not quite as large as the robot file says.
#include "cdprcal/effects/moved_pulleys.hpp"

namespace cdprcal {
namespace {

class FrameScale final : public FrameShape {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "frame_scale",
        .equation = "d* = c + diag(1 + s) (d - c)",
        .parameters = {{.name = "scale_error",
                        .unit = "1",
                        .shape = ParameterShape::vector3,
                        .typical = 0.001,
                        .plausible = 0.02,
                        .range = ValueRange::above_minus_one}},
        .scope = EffectScope::robot,
        .confused_with = {"transmission_ratio", "frame_anchors"},
        .sentence = "the pulleys stand closer together or further apart than the robot file says",
        .remedy = "measure the distances between the pulleys and correct the robot file",
        .settle = "measure one long distance between two pulleys by tape"};
    return info;
  }

 protected:
  [[nodiscard]] Vector3 moved(const EffectValues& scale_error, const Vector3& place_m,
                              const Vector3&) const override {
    return place_m + scale_error.cwiseProduct(place_m);
  }
  [[nodiscard]] Eigen::Matrix3Xd by_value(const EffectValues& scale_error, const Vector3& place_m,
                                          const Vector3&) const override {
    const Vector3 right = place_m.array() / (1.0 + scale_error.array());
    return right.asDiagonal().toDenseMatrix();
  }
};

}  // namespace

std::shared_ptr<const Effect> frame_scale() { return std::make_shared<FrameScale>(); }

}  // namespace cdprcal
