// Every sensor that a robot may have, one row each. The log, measurements, residuals, noise, files,
// tables and messages follow from these rows; a new sensor is one field and one row of each table.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Readings that share one noise level.
enum class Channel {
  length,
  swivel,
  roll_pitch,
  yaw,
  balance,
  absolute_yaw,
  direct_length,
  position,
  specific_force,
  angular_velocity
};
inline constexpr int kChannels = 10;
/// The first five are those of the paper's sensors, which every robot file and log may have; the
/// others are of absolute sensors, which few robots have.
inline constexpr int kPaperChannels = 5;

/// Width of a sensor that reads one number a cable.
inline constexpr int kOneACable = 0;

// What there is one of for each sensor, by the sensor's width.
template <int width>
using NumberOf = double;  ///< a σ, an rms
template <int width>
using ReadingOf =  ///< what it reads at one pose
    std::conditional_t<width == 1, double,
                       std::conditional_t<width == kOneACable, CableVector, Vector3>>;
template <int width>
using JacobianOf =  ///< derivative of that by the platform's twist
    std::conditional_t<width == kOneACable, CableJacobian, Eigen::Matrix<double, width, 6>>;

template <int width>
struct MostOf {  ///< how many numbers it reads on a robot of any size
  static constexpr int kNumbers = width == kOneACable ? kMaxCables : width;
};

/// NaN where the size is known, otherwise empty.
template <class T>
constexpr T absent() {
  if constexpr (std::is_same_v<T, double>) {
    return kNaN;
  } else if constexpr (requires { requires T::SizeAtCompileTime != Eigen::Dynamic; }) {
    return T::Constant(kNaN);
  } else {
    return T();
  }
}

/// The numbers of a field: of one number, or a vector of them.
template <class T>
auto numbers(T& field) {
  using Number = std::conditional_t<std::is_const_v<T>, const double, double>;
  if constexpr (std::is_same_v<std::remove_const_t<T>, double>) {
    return std::span<Number>(&field, 1);
  } else {
    return std::span<Number>(field.data(), static_cast<std::size_t>(field.size()));
  }
}

/// One field for each absolute sensor: those without an offset, beyond the paper's.
template <template <int width> class Of>
struct AbsoluteFields {
  Of<1> absolute_yaw_rad = absent<Of<1>>();                   ///< compass, camera
  Of<kOneACable> direct_length_m = absent<Of<kOneACable>>();  ///< whole lengths: laser, tape
  Of<3> position_m = absent<Of<3>>();                         ///< of P in the world: tracker
  Of<3> specific_force_m_s2 = absent<Of<3>>();                ///< accelerometer, platform axes
  Of<3> angular_velocity_rad_s = absent<Of<3>>();             ///< gyroscope, platform axes
};

/// One-sigma errors of the readings and of the statics model (paper eq. 18 by default).
struct SensorSigma : AbsoluteFields<NumberOf> {
  SensorSigma() : AbsoluteFields{2.0 * kDegree, 2e-3, 1e-3, 0.2, 0.02} {}
  double length_m = 0.01;
  double swivel_rad = 1.0 * kDegree;
  double attitude_rad = 2.0 * kDegree;
  double tension_N = 10.0;
  /// What the wrench balance itself may be wrong by, beyond the load cells. Not in the paper.
  /// 0 means: what a geometry known to 1 mm leaves on irma4. `finalise` then puts weight × 1e-3
  /// here (a cable direction wrong by 1 mm a metre) and weight × 1 mm below (the weight's lever; as
  /// much more as the frame is larger than irma4's).
  double wrench_force_N = 0.0;
  double wrench_moment_Nm = 0.0;
};

/// One sensor: a matrix of the log, a vector of a measurement.
struct Sensor {
  const char* name;                    ///< "direct_length"
  const char* unit;                    ///< SI: m, rad, N, m_s2, rad_s
  int width;                           ///< readings at one pose: kOneACable, 1 or 3
  std::array<const char*, 3> columns;  ///< what a log calls them, without unit; kOneACable: none
  double SensorSigma::* sigma;         ///< its σ; none: it is told, not read
  const char* sigma_name;              ///< of that in the robot file, without unit
  const char* in_words;                ///< "direct length"
  const char* about;                   ///< what it reads, for descriptions

  [[nodiscard]] bool is_angle() const { return std::string_view(unit) == "rad"; }
  [[nodiscard]] bool is_length() const { return std::string_view(unit) == "m"; }
  /// Of an inertial unit: it reads how the platform moves, and of its pose only which way is up,
  /// and that at rest.
  [[nodiscard]] bool is_inertial() const { return std::string_view(unit).find('_') != npos; }
  [[nodiscard]] bool is_absolute() const;  ///< one that few robots have, in AbsoluteFields
  [[nodiscard]] int columns_of(int cable_count) const {
    return width == kOneACable ? cable_count : width;
  }
  [[nodiscard]] std::string field() const;            ///< of Log, Measurement…: "direct_length_m"
  [[nodiscard]] std::string column(int index) const;  ///< "direct_length_1_m", "position_x_m"
  [[nodiscard]] std::string sigma_field() const;      ///< of SensorSigma: "direct_length_m"

 private:
  static constexpr auto npos = std::string_view::npos;
};

/// How a sensor's readings are said to people: millimetres, degrees and degrees a second.
struct Quantity {
  const char* unit;
  double scale;  ///< of the SI unit
};
inline Quantity quantity_of(const Sensor& sensor) {
  const bool turns = sensor.unit[0] == 'r';
  if (sensor.is_inertial()) return turns ? Quantity{"deg/s", 1.0 / kDegree} : Quantity{"m/s2", 1.0};
  if (turns) return {"deg", 1.0 / kDegree};
  return sensor.is_length() ? Quantity{"mm", 1e3} : Quantity{"N", 1.0};
}

/// The sensors; behind them what a log holds beside readings: the set-points of the tensions.
inline constexpr int kSensors = 9;
inline constexpr int kAbsoluteSensors = 5;  ///< the last of them
inline constexpr int kLogGroups = kSensors + 1;
extern const std::array<Sensor, kLogGroups> kSensorTable;

/// One channel: some of the readings of a sensor.
struct ChannelRow {
  const char* name;       ///< "direct_length"
  const char* rms_field;  ///< of its residuals in results: "direct_length_m"
  int sensor;             ///< row of kSensorTable
  int first, count;       ///< of the sensor's columns; per cable: all
  bool has_offset;        ///< its readings count from an unknown start
  const char* label;      ///< in tables: "whole length"
  const char* plural;     ///< in sentences: "direct lengths"
  const char* in_words;   ///< with its article: "the direct lengths"

  [[nodiscard]] const Sensor& of() const { return kSensorTable[static_cast<std::size_t>(sensor)]; }
};
extern const std::array<ChannelRow, kChannels> kChannelTable;
inline const ChannelRow& row_of(Channel channel) {
  return kChannelTable[static_cast<std::size_t>(channel)];
}
/// Those of each sensor, which stand side by side; none of the set-points.
extern const std::array<std::span<const ChannelRow>, kLogGroups> kChannelsOfSensor;
/// Those of a row of kSensorTable.
inline std::span<const ChannelRow> channels_of(const Sensor& sensor) {
  return kChannelsOfSensor[static_cast<std::size_t>(&sensor - kSensorTable.data())];
}
/// A row of kChannelTable.
inline Channel channel_of(const ChannelRow& row) {
  return static_cast<Channel>(&row - kChannelTable.data());
}
/// "length", "swivel", "roll_pitch", "yaw", "balance", "absolute_yaw", "direct_length", "position",
/// "specific_force", "angular_velocity".
const char* to_string(Channel channel);

/// f(sensor, its field of each of `all`) for every absolute sensor.
template <class F, class... Fields>
constexpr void for_each_absolute(const F& f, Fields&... all) {
  f(kSensorTable[4], all.absolute_yaw_rad...);
  f(kSensorTable[5], all.direct_length_m...);
  f(kSensorTable[6], all.position_m...);
  f(kSensorTable[7], all.specific_force_m_s2...);
  f(kSensorTable[8], all.angular_velocity_rad_s...);
}
/// The most that all absolute sensors read at one pose.
inline constexpr int kMostAbsoluteReadings = [] {
  int sum = 0;
  const AbsoluteFields<MostOf> all;
  for_each_absolute([&]<class Most>(const Sensor&, const Most&) { sum += Most::kNumbers; }, all);
  return sum;
}();

/// The same for every sensor of a Log, a Measurement or a PoseResidual.
template <class F, class... Fields>
void for_each_sensor(const F& f, Fields&... all) {
  f(kSensorTable[0], all.length_m...);
  f(kSensorTable[1], all.swivel_rad...);
  f(kSensorTable[2], all.tension_N...);
  f(kSensorTable[3], all.roll_pitch_yaw_rad...);
  for_each_absolute(f, all...);
}
/// f(name, number of each of `all`) for every number that there is a channel: of a ReadingNoise or
/// a ResidualRms.
template <class F, class... Fields>
void for_each_channel(const F& f, Fields&... all) {
  f(kChannelTable[0], all.length_m...);
  f(kChannelTable[1], all.swivel_rad...);
  f(kChannelTable[2], all.roll_pitch_rad...);
  f(kChannelTable[3], all.yaw_rad...);
  f(kChannelTable[4], all.tension_N...);
  std::size_t channel = kPaperChannels;
  for_each_absolute([&](const Sensor&, auto&... fields) { f(kChannelTable[channel++], fields...); },
                    all...);
}

}  // namespace cdprcal
