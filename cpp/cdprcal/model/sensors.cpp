#include "cdprcal/model/sensors.hpp"

#include <algorithm>

namespace cdprcal {

// clang-format off
constexpr std::array<Sensor, kLogGroups> kSensorTable{{
    // name, unit, width, columns, σ and its key in the robot file, in words, what it reads
    {"length", "m", kOneACable, {}, &SensorSigma::length_m, "length", "cable length", "relative"},
    {"swivel", "rad", kOneACable, {}, &SensorSigma::swivel_rad, "swivel", "swivel angle", "relative"},
    {"tension", "N", kOneACable, {}, &SensorSigma::tension_N, "tension", "cable tension", "load cells"},
    {"roll_pitch_yaw", "rad", 3, {"roll", "pitch", "yaw"}, &SensorSigma::attitude_rad, "attitude",
     "attitude", "in the sensor's Euler convention; yaw is relative"},
    {"absolute_yaw", "rad", 1, {"absolute_yaw"}, &SensorSigma::absolute_yaw_rad, "absolute_yaw",
     "absolute yaw", "yaw without an offset (compass, camera)"},
    {"direct_length", "m", kOneACable, {}, &SensorSigma::direct_length_m, "direct_length",
     "direct length", "whole cable lengths, arc included (laser, tape)"},
    {"position", "m", 3, {"position_x", "position_y", "position_z"}, &SensorSigma::position_m,
     "position", "position", "of P in the world (tracker)"},
    {"specific_force", "m_s2", 3, {"specific_force_x", "specific_force_y", "specific_force_z"},
     &SensorSigma::specific_force_m_s2, "specific_force", "specific force",
     "accelerometer, platform axes: at rest 9.81 m/s2 upward"},
    {"angular_velocity", "rad_s", 3, {"angular_velocity_x", "angular_velocity_y", "angular_velocity_z"},
     &SensorSigma::angular_velocity_rad_s, "angular_velocity", "angular velocity", "gyroscope, platform axes"},
    {"tension_setpoint", "N", kOneACable, {}, nullptr, "", "tension set-point",
     "what the tensions were told to be"},
}};

constexpr std::array<ChannelRow, kChannels> kChannelTable{{
    // name, field of the rms, sensor, its columns, offset, in tables, in sentences, with its article
    {"length", "length_m", 0, 0, kMaxCables, true, "length", "lengths", "the cable lengths"},
    {"swivel", "swivel_rad", 1, 0, kMaxCables, true, "swivel angle", "swivel angles", "the swivel angles"},
    {"roll_pitch", "roll_pitch_rad", 3, 0, 2, false, "roll, pitch", "roll and pitch", "roll and pitch"},
    {"yaw", "yaw_rad", 3, 2, 1, true, "yaw", "yaw", "the yaw changes"},
    {"balance", "tension_N", 2, 0, kMaxCables, false, "tension", "tensions", "the balance of forces and moments"},
    {"absolute_yaw", "absolute_yaw_rad", 4, 0, 1, false, "absolute yaw", "absolute yaw", "the absolute yaw"},
    {"direct_length", "direct_length_m", 5, 0, kMaxCables, false, "whole length", "direct lengths", "the direct lengths"},
    {"position", "position_m", 6, 0, 3, false, "position", "position", "the measured position"},
    {"specific_force", "specific_force_m_s2", 7, 0, 3, false, "specific force", "the specific force", "the specific force at rest"},
    {"angular_velocity", "angular_velocity_rad_s", 8, 0, 3, false, "angular velocity", "the angular velocity", "the angular velocity"},
}};
// clang-format on
static_assert(kSensorTable.back().name && kChannelTable.back().name, "a row is missing");

constexpr std::array<std::span<const ChannelRow>, kLogGroups> kChannelsOfSensor = [] {
  std::array<std::span<const ChannelRow>, kLogGroups> out;
  for (const ChannelRow& row : kChannelTable) {
    std::span<const ChannelRow>& own = out[static_cast<std::size_t>(row.sensor)];
    const ChannelRow* const first = own.empty() ? &row : own.data();
    if (first + own.size() != &row) throw "a sensor's channels are not side by side";
    own = {first, own.size() + 1};
  }
  return out;
}();

bool Sensor::is_absolute() const {
  // By name and not by place: a row may be a copy.
  return std::any_of(kSensorTable.end() - 1 - kAbsoluteSensors, kSensorTable.end() - 1,
                     [&](const Sensor& sensor) { return sensor.name == name; });
}

std::string Sensor::field() const { return std::string(name) + "_" + unit; }

std::string Sensor::column(int index) const {
  const std::string stem = width == kOneACable
                               ? std::string(name) + "_" + std::to_string(index + 1)
                               : std::string(columns[static_cast<std::size_t>(index)]);
  return stem + "_" + unit;
}

std::string Sensor::sigma_field() const { return std::string(sigma_name) + "_" + unit; }

const char* to_string(Channel channel) {
  const auto index = static_cast<std::size_t>(channel);
  return index < kChannelTable.size() ? kChannelTable[index].name : "unknown";
}

}  // namespace cdprcal
