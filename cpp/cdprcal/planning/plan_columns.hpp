// Private to planning/: the columns of a plan file.
#pragma once

#include <array>
#include <string>

#include "cdprcal/types.hpp"

namespace cdprcal::detail {

inline constexpr std::array<const char*, 7> kPoseColumns{
    "position_x_m", "position_y_m", "position_z_m", "quaternion_w",
    "quaternion_x", "quaternion_y", "quaternion_z"};

inline std::string tension_column(Eigen::Index i) {
  return "tension_" + std::to_string(i + 1) + "_N";
}
inline std::string natural_column(Eigen::Index i) {
  return "natural_frequency_" + std::to_string(i + 1) + "_hz";
}
inline std::string constant_tension_column(Eigen::Index i) {
  return "constant_tension_frequency_" + std::to_string(i + 1) + "_hz";
}

}  // namespace cdprcal::detail
