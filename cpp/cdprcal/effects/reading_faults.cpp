#include "cdprcal/effects/reading_faults.hpp"

namespace cdprcal {
namespace {

const std::vector<double>& values_of(const AppliedEffect& fault) {
  return fault.parameters.front().values;
}

void scale_columns(const std::vector<double>& signs, LogMatrix& readings) {
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) *= signs[static_cast<std::size_t>(i)];
  }
}

void reorder(const std::vector<double>& order, LogMatrix& readings) {
  const LogMatrix read = readings;
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) = read.col(static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]) - 1);
  }
}

const ReadingFault* find(const std::string& name) {
  for (const ReadingFault& fault : reading_faults()) {
    if (fault.name == name) return &fault;
  }
  return nullptr;
}

}  // namespace

const std::vector<ReadingFault>& reading_faults() {
  constexpr auto kPerCable = ParameterShape::per_cable;
  static const std::vector<ReadingFault> table{
      {"length_sign",
       {{"sign", kPerCable, ValueRange::sign}},
       [](const AppliedEffect& fault, Log& log) { scale_columns(values_of(fault), log.length_m); }},
      {"swivel_sign",
       {{"sign", kPerCable, ValueRange::sign}},
       [](const AppliedEffect& fault, Log& log) {
         scale_columns(values_of(fault), log.swivel_rad);
       }},
      // Cable i is read on channel order[i]; its load cell on tension_order[i], where given.
      {"cable_order",
       {{"order", kPerCable, ValueRange::order},
        {"tension_order", kPerCable, ValueRange::order, true}},
       [](const AppliedEffect& fault, Log& log) {
         for (LogMatrix* read : {&log.length_m, &log.swivel_rad}) reorder(values_of(fault), *read);
         for (LogMatrix* read : {&log.tension_N, &log.tension_setpoint_N}) {
           reorder(fault.parameters.back().values, *read);
         }
       }},
      // Readings × factor are metres, or radians: of the swivels, and of the attitude.
      {"length_unit",
       {{"factor", ParameterShape::scalar, ValueRange::positive}},
       [](const AppliedEffect& fault, Log& log) { log.length_m *= values_of(fault)[0]; }},
      {"angle_unit",
       {{"factor", ParameterShape::pair, ValueRange::positive}},
       [](const AppliedEffect& fault, Log& log) {
         log.swivel_rad *= values_of(fault)[0];
         log.roll_pitch_yaw_rad *= values_of(fault)[1];
       }},
      // Readings × sign are roll, pitch and yaw: an AHRS whose axes point down, or backwards.
      {"attitude_sign",
       {{"sign", ParameterShape::vector3, ValueRange::sign}},
       [](const AppliedEffect& fault, Log& log) {
         scale_columns(values_of(fault), log.roll_pitch_yaw_rad);
       }},
      // Readings × factor are newtons; what the tensions were told to be is in the same unit.
      {"tension_unit",
       {{"factor", ParameterShape::scalar, ValueRange::positive}},
       [](const AppliedEffect& fault, Log& log) {
         log.tension_N *= values_of(fault)[0];
         log.tension_setpoint_N *= values_of(fault)[0];
       }},
      // Readings − offset are lengths, of sensors that read whole ones. `geometry` finds it; the
      // simulated plant has no such sensor.
      {"whole_length_offset",
       {{"offset_m", kPerCable, ValueRange::any}},
       [](const AppliedEffect& fault, Log& log) {
         for_each_absolute(
             [&](const Sensor& sensor, LogMatrix& readings) {
               if (!sensor.is_length() || sensor.width != kOneACable) return;
               for (Eigen::Index i = 0; i < readings.cols(); ++i) {
                 readings.col(i).array() -= values_of(fault)[static_cast<std::size_t>(i)];
               }
             },
             log);
       }}};
  return table;
}

bool is_reading_fault(const std::string& name) { return find(name) != nullptr; }

Robot without_reading_faults(Robot robot) {
  std::erase_if(robot.effects, [](const AppliedEffect& e) { return is_reading_fault(e.name); });
  return robot;
}

void set_right(const AppliedEffect& fault, Log& log) {
  if (const ReadingFault* row = find(fault.name)) row->set_right(fault, log);
}

}  // namespace cdprcal
