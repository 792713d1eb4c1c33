// What the geometry says of the readings of one sample: residuals and derivatives, a row each.
#pragma once

#include <vector>

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// The most readings of one pose: lengths, swivels, roll, pitch and yaw, and those of absolute
/// sensors; an inertial unit's (inertial_readings.hpp) are no geometric ones.
inline constexpr int kMostReadings = 2 * kMaxCables + 3 + kMostAbsoluteReadings;

/// One number a geometric reading, in the order of geometric_rows().
using ReadingVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostReadings, 1>;
using ReadingMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                    kMostReadings, kMostReadings>;

/// What each geometric reading is, in order: lengths (n), swivels (n), roll, pitch, yaw, and those
/// of absolute sensors.
std::vector<RowLabel> geometric_rows(int cable_count);
/// Whether a row is an angle, and whether it counts from an unknown start.
bool is_angle(const RowLabel& row);
bool has_offset(const RowLabel& row);
/// As its column of a log is called: "length_3_m", "pitch_deg", "position_y_m".
std::string in_words(const RowLabel& row);

using ReadingsByPose = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMostReadings, 6>;

struct GeometricReadings {
  ReadingVector misfit;  ///< model − reading, offsets left out; NaN where nothing was read
  ReadingsByPose by_pose;
  PoseEvaluation model;  ///< behind it
};

/// False where the kinematics have no solution at the pose. `robot` as effects have made it
/// (with_effects).
bool evaluate(const Robot& robot, const ActiveEffects& effects, const Measurement& m,
              const Pose& pose, GeometricReadings& out);

}  // namespace cdprcal
