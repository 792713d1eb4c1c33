// Private to model/: the robot files that are compiled in.
#pragma once

#include <array>

namespace cdprcal::detail {

struct BuiltinRobot {
  const char* name;
  const char* yaml;
};

/// The four-cable prototype of paper Table I; mass, centre of mass and sigma from paper §4.
inline constexpr const char* kIrma4Yaml =
    R"(# Four-cable underactuated robot of Zoffoli, Idà, Carricato, Robotica 43 (2025), Table I.
name: irma4
gravity_m_s2: 9.81
platform:
  mass_kg: 12.992
  centre_of_mass_m: [0, 0, 0.173]
  inertia_kg_m2: [[0.18396, 0, 0], [0, 0.11545, 0], [0, 0, 0.18643]]   # about the centre of mass
cables:                                   # y axis of a pulley = swivel_axis × x_axis
  - pulley: {radius_m: 0.03, position_m: [1.065, -1.155, 1.839], x_axis: [0, 0, -1], swivel_axis: [1, 0, 0]}
    platform_anchor_m: [0.075, -0.075, 0.266]
  - pulley: {radius_m: 0.03, position_m: [1.066, 1.155, 1.839], x_axis: [0, 0, -1], swivel_axis: [1, 0, 0]}
    platform_anchor_m: [0.075, 0.075, 0.266]
  - pulley: {radius_m: 0.03, position_m: [-1.066, 1.155, 1.839], x_axis: [0, 0, -1], swivel_axis: [-1, 0, 0]}
    platform_anchor_m: [-0.075, 0.075, 0.266]
  - pulley: {radius_m: 0.03, position_m: [-1.065, -1.155, 1.839], x_axis: [0, 0, -1], swivel_axis: [-1, 0, 0]}
    platform_anchor_m: [-0.075, -0.075, 0.266]
tension_limits_N: [20, 400]
sensors:
  euler_convention: XYZ                   # intrinsic order: R = Rx(roll) Ry(pitch) Rz(yaw)
  sigma: {length_m: 0.01, swivel_deg: 1, attitude_deg: 2, tension_N: 10}   # eq. 18
)";

inline constexpr std::array<BuiltinRobot, 1> kBuiltinRobots{{{"irma4", kIrma4Yaml}}};

}  // namespace cdprcal::detail
