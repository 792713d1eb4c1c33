// Table II of the paper to six decimals: poses of irma4 and the tensions that balance them.
#pragma once

#include <array>

#include "cdprcal/geometry/euler.hpp"

namespace cdprcal::test {

/// One row: position [m], roll, pitch, yaw [rad] (R = Rx Ry Rz), tensions [N].
struct Table2Row {
  std::array<double, 3> position_m;
  std::array<double, 3> euler_rad;
  std::array<double, 4> tension_N;

  [[nodiscard]] Vector3 euler() const { return {euler_rad[0], euler_rad[1], euler_rad[2]}; }
  [[nodiscard]] Pose pose() const { return pose(euler()); }
  /// The row's position at other angles.
  [[nodiscard]] Pose pose(const Vector3& angles) const {
    return {{position_m[0], position_m[1], position_m[2]},
            rotation_from_euler(angles, EulerConvention::XYZ)};
  }
  [[nodiscard]] CableVector tension() const {
    return Eigen::Map<const Eigen::Vector4d>(tension_N.data());
  }
};

/// The paper prints two decimals, and wrong tensions in row 6; these satisfy eq. 6.
inline constexpr double kTable2AngleRounding_rad = 0.5e-6;
inline constexpr double kTable2TensionRounding_N = 0.5e-6;
inline constexpr std::array<Table2Row, 8> kTable2{{
    {{0.4, 0.4, 1.2},
     {0.084023, -0.090510, 0.004690},
     {118.476264, 170.828165, 115.569155, 82.981581}},
    {{-0.4, 0.4, 1.2},
     {0.084023, 0.090510, -0.004690},
     {82.981579, 115.569157, 170.828164, 118.476265}},
    {{-0.4, -0.4, 1.2},
     {-0.084052, 0.090581, 0.004850},
     {115.489778, 82.967942, 118.540763, 170.725470}},
    {{0.4, -0.4, 1.2},
     {-0.084052, -0.090581, -0.004850},
     {170.725469, 118.540765, 82.967940, 115.489780}},
    {{0.4, -0.4, 0.6},
     {-0.145595, -0.154499, -0.011161},
     {81.175193, 55.900918, 31.006417, 53.855798}},
    {{-0.4, -0.4, 0.6},
     {-0.145595, 0.154499, 0.011161},
     {53.855797, 31.006417, 55.900918, 81.175194}},
    {{-0.4, 0.4, 0.6},
     {0.145546, 0.154432, -0.010997},
     {31.018552, 53.872214, 81.210513, 55.871600}},
    {{0.4, 0.4, 0.6},
     {0.145546, -0.154432, 0.010997},
     {55.871600, 81.210513, 53.872213, 31.018553}},
}};

}  // namespace cdprcal::test
