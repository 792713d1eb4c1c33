// Private to robot_file/: the robot files that are compiled in.
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

/// Examples of other numbers of cables. Their swivel axes are vertical.
inline constexpr const char* kRing3Yaml =
    R"(# 3 cables on pulleys evenly around a circle of 1 m: not like irma4 in any number.
name: ring3
gravity_m_s2: 9.81
platform:
  mass_kg: 9
  centre_of_mass_m: [0.01, -0.015, -0.12]
  inertia_kg_m2: [[0.11, 0.01, 0], [0.01, 0.14, 0], [0, 0, 0.09]]
cables:
  - pulley: {radius_m: 0.025, position_m: [0.9632, 0.2689, 1.6], x_axis: [-0.963163, -0.268920, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.1156, 0.0323, 0]
  - pulley: {radius_m: 0.025, position_m: [-0.7145, 0.6997, 1.6], x_axis: [0.714473, -0.699663, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.0857, 0.0840, 0.05]
  - pulley: {radius_m: 0.025, position_m: [-0.2487, -0.9686, 1.6], x_axis: [0.248690, 0.968583, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.0298, -0.1162, 0]
tension_limits_N: [5, 250]
sensors:
  euler_convention: XYZ
  sigma: {length_m: 0.01, swivel_deg: 1, attitude_deg: 2, tension_N: 10}
)";
inline constexpr const char* kRing5Yaml =
    R"(# 5 cables on pulleys evenly around a circle of 1 m: not like irma4 in any number.
name: ring5
gravity_m_s2: 9.81
platform:
  mass_kg: 9
  centre_of_mass_m: [0.01, -0.015, -0.12]
  inertia_kg_m2: [[0.11, 0.01, 0], [0.01, 0.14, 0], [0, 0, 0.09]]
cables:
  - pulley: {radius_m: 0.025, position_m: [0.9867, 0.1626, 1.6], x_axis: [-0.986686, -0.162637, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.1184, 0.0195, 0]
  - pulley: {radius_m: 0.025, position_m: [0.1502, 0.9887, 1.6], x_axis: [-0.150226, -0.988652, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.0180, 0.1186, 0.05]
  - pulley: {radius_m: 0.025, position_m: [-0.8938, 0.4484, 1.6], x_axis: [0.893841, -0.448383, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.1073, 0.0538, 0]
  - pulley: {radius_m: 0.025, position_m: [-0.7026, -0.7115, 1.6], x_axis: [0.702650, 0.711536, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.0843, -0.0854, 0.05]
  - pulley: {radius_m: 0.025, position_m: [0.4596, -0.8881, 1.6], x_axis: [-0.459580, 0.888136, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.0551, -0.1066, 0]
tension_limits_N: [5, 250]
sensors:
  euler_convention: XYZ
  sigma: {length_m: 0.01, swivel_deg: 1, attitude_deg: 2, tension_N: 10}
)";

inline constexpr const char* kPosts8Yaml =
    R"(# 8 cables from four posts, two each, to the corners of a box: lengths alone hold the platform.
name: posts8
gravity_m_s2: 9.81
platform:
  mass_kg: 15
  centre_of_mass_m: [0.005, -0.004, 0.03]
  inertia_kg_m2: [[0.21, 0.004, 0], [0.004, 0.32, 0], [0, 0, 0.38]]
cables:
  - pulley: {radius_m: 0.03, position_m: [1.58, -1.12, 2.20], x_axis: [-0.815821, 0.578304, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.22, -0.16, 0.15]
  - pulley: {radius_m: 0.03, position_m: [1.42, -1.28, 2.30], x_axis: [-0.742774, 0.669543, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.22, 0.16, -0.05]
  - pulley: {radius_m: 0.03, position_m: [1.42, 1.28, 2.20], x_axis: [-0.742774, -0.669543, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.22, 0.16, 0.15]
  - pulley: {radius_m: 0.03, position_m: [1.58, 1.12, 2.30], x_axis: [-0.815821, -0.578304, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.22, 0.16, -0.05]
  - pulley: {radius_m: 0.03, position_m: [-1.58, 1.12, 2.20], x_axis: [0.815821, -0.578304, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.22, 0.16, 0.15]
  - pulley: {radius_m: 0.03, position_m: [-1.42, 1.28, 2.30], x_axis: [0.742774, -0.669543, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.22, -0.16, -0.05]
  - pulley: {radius_m: 0.03, position_m: [-1.42, -1.28, 2.20], x_axis: [0.742774, 0.669543, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [-0.22, -0.16, 0.15]
  - pulley: {radius_m: 0.03, position_m: [-1.58, -1.12, 2.30], x_axis: [0.815821, 0.578304, 0], swivel_axis: [0, 0, -1]}
    platform_anchor_m: [0.22, -0.16, -0.05]
tension_limits_N: [5, 300]
sensors:
  euler_convention: XYZ
  sigma: {length_m: 0.01, swivel_deg: 1, attitude_deg: 2, tension_N: 10}
)";

inline constexpr const char* kBelts4Yaml =
    R"(# 4 belts in an upright plane to the middle of a sled, as of a wall plotter or a router.
name: belts4
gravity_m_s2: 9.81
platform:
  mass_kg: 6
  motion: 2T
  motion_plane_normal: [0, 1, 0]
cables:
  - pulley: {radius_m: 0, position_m: [-1.6, 0, 2.2]}
  - pulley: {radius_m: 0, position_m: [1.6, 0, 2.2]}
  - pulley: {radius_m: 0, position_m: [1.6, 0, 0]}
  - pulley: {radius_m: 0, position_m: [-1.6, 0, 0]}
tension_limits_N: [10, 150]
sensors:
  sigma: {length_m: 0.001, tension_N: 3}
)";

inline constexpr const char* kHang4Yaml =
    R"(# 4 lines to a carriage that cannot turn, one from the ceiling and three from the floor, as of a
# hanging printer, whose paired lines keep it level.
name: hang4
gravity_m_s2: 9.81
platform: {mass_kg: 2.5, motion: 3T}
cables:
  - pulley: {radius_m: 0, position_m: [0, -1.5, 0]}
  - pulley: {radius_m: 0, position_m: [1.3, 0.75, 0]}
  - pulley: {radius_m: 0, position_m: [-1.3, 0.75, 0]}
  - pulley: {radius_m: 0, position_m: [0, 0, 2.4]}
tension_limits_N: [4, 80]
floor_m: 0
sensors:
  sigma: {length_m: 0.001, tension_N: 2}
)";

inline constexpr std::array<BuiltinRobot, 6> kBuiltinRobots{{{"irma4", kIrma4Yaml},
                                                             {"ring3", kRing3Yaml},
                                                             {"ring5", kRing5Yaml},
                                                             {"posts8", kPosts8Yaml},
                                                             {"belts4", kBelts4Yaml},
                                                             {"hang4", kHang4Yaml}}};

}  // namespace cdprcal::detail
