// The frame is twisted: two of its opposite corners stand high, the others low.
#include "cdprcal/effects/moved_pulleys.hpp"

namespace cdprcal {
namespace {

/// 1 at the corners of high x and high y, and of low x and low y; -1 at the others.
double saddle(const Vector3& place_m, const Vector3& reach_m) {
  return place_m.x() / reach_m.x() * place_m.y() / reach_m.y();
}

class FrameWarp final : public FrameShape {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "frame_warp",
        .equation = "d_z* = d_z + w (d_x - c_x) (d_y - c_y) / (reach_x reach_y)",
        .parameters = {{.name = "corner_m",
                        .unit = "m",
                        .shape = ParameterShape::scalar,
                        .typical = 0.002,
                        .plausible = 0.02,
                        .of = Yardstick::frame}},
        .scope = EffectScope::robot,
        .confused_with = {"frame_anchors"},
        .sentence = "the frame is twisted: its pulleys are not in the planes of the robot file",
        .remedy = "level the corners, or correct the heights of the pulleys in the robot file",
        .settle = "level the pulleys against each other by hose or laser"};
    return info;
  }

 protected:
  [[nodiscard]] Vector3 moved(const EffectValues& corner_m, const Vector3& place_m,
                              const Vector3& reach_m) const override {
    return place_m + corner_m[0] * saddle(place_m, reach_m) * Vector3::UnitZ();
  }
  [[nodiscard]] Eigen::Matrix3Xd by_value(const EffectValues&, const Vector3& place_m,
                                          const Vector3& reach_m) const override {
    return saddle(place_m, reach_m) * Vector3::UnitZ();
  }
};

}  // namespace

std::shared_ptr<const Effect> frame_warp() { return std::make_shared<FrameWarp>(); }

}  // namespace cdprcal
