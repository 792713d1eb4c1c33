#include "cdprcal/effects/reading_faults.hpp"

#include <cmath>

#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/readings/lengths.hpp"

namespace cdprcal {
namespace {

const std::vector<double>& values_of(const AppliedEffect& fault) {
  return fault.parameters.front().values;
}

/// Of the parameter of that name; where it is absent, of the first.
const std::vector<double>& values_of(const AppliedEffect& fault, const std::string& parameter) {
  for (const AppliedEffect::Parameter& given : fault.parameters) {
    if (given.name == parameter) return given.values;
  }
  return values_of(fault);
}

Eigen::Map<const Eigen::RowVectorXd> row_of(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

void scale_columns(const std::vector<double>& by, LogMatrix& readings) {
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) *= by[static_cast<std::size_t>(i)];
  }
}

void scale_lengths(const AppliedEffect& fault, const Robot&, Log& log) {
  if (LogMatrix* read = read_lengths(log)) scale_columns(values_of(fault), *read);
}
void scale_swivels(const AppliedEffect& fault, const Robot&, Log& log) {
  scale_columns(values_of(fault), log.swivel_rad);
}
void scale_tensions(const AppliedEffect& fault, const Robot&, Log& log) {
  scale_columns(values_of(fault), log.tension_N);
}

void reorder(const std::vector<double>& order, LogMatrix& readings) {
  const LogMatrix read = readings;
  for (Eigen::Index i = 0; i < readings.cols(); ++i) {
    readings.col(i) = read.col(static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]) - 1);
  }
}

/// Each cable's whole length at a row, in every matrix that holds some: lasers, tapes, belts.
template <class Change>
void change_whole_lengths(Log& log, Change change) {
  for_each_absolute(
      [&](const Sensor& sensor, LogMatrix& readings) {
        if (!sensor.is_length() || sensor.width != kOneACable) return;
        for (Eigen::Index i = 0; i < readings.cols(); ++i) {
          for (Eigen::Index row = 0; row < readings.rows(); ++row) change(row, i, readings(row, i));
        }
      },
      log);
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
      {"length_sign", {{"sign", kPerCable, ValueRange::sign}}, &scale_lengths},
      {"swivel_sign", {{"sign", kPerCable, ValueRange::sign}}, &scale_swivels},
      // Cable i is read on channel order[i]; its swivel encoder on swivel_order[i] and its load
      // cell on tension_order[i], where given.
      {"cable_order",
       {{"order", kPerCable, ValueRange::order},
        {"tension_order", kPerCable, ValueRange::order, true},
        {"swivel_order", kPerCable, ValueRange::order, true}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         if (LogMatrix* read = read_lengths(log)) reorder(values_of(fault), *read);
         reorder(values_of(fault, "swivel_order"), log.swivel_rad);
         for (LogMatrix* read : {&log.tension_N, &log.tension_setpoint_N}) {
           reorder(values_of(fault, "tension_order"), *read);
         }
       }},
      // Readings × factor are metres, or radians: of the swivels, and of the attitude.
      {"length_unit",
       {{"factor", ParameterShape::scalar, ValueRange::positive}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         if (LogMatrix* read = read_lengths(log)) *read *= values_of(fault)[0];
       }},
      {"angle_unit",
       {{"factor", ParameterShape::pair, ValueRange::positive}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         log.swivel_rad *= values_of(fault)[0];
         log.roll_pitch_yaw_rad *= values_of(fault)[1];
       }},
      // Readings × sign are roll, pitch and yaw: an AHRS whose axes point down, or backwards.
      {"attitude_sign",
       {{"sign", ParameterShape::vector3, ValueRange::sign}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         scale_columns(values_of(fault), log.roll_pitch_yaw_rad);
       }},
      // Readings × sign are tensions: load cells that count pulls as negative.
      {"tension_sign", {{"sign", kPerCable, ValueRange::sign}}, &scale_tensions},
      // Readings × factor are newtons; what the tensions were told to be is in the same unit.
      {"tension_unit",
       {{"factor", ParameterShape::scalar, ValueRange::positive}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         log.tension_N *= values_of(fault)[0];
         log.tension_setpoint_N *= values_of(fault)[0];
       }},
      // The same of each sensor by itself: one amplifier or encoder that was set up otherwise.
      {"length_factor", {{"factor", kPerCable, ValueRange::positive}}, &scale_lengths},
      {"swivel_factor", {{"factor", kPerCable, ValueRange::positive}}, &scale_swivels},
      {"tension_factor", {{"factor", kPerCable, ValueRange::positive}}, &scale_tensions},
      // The platform's attitude is R* exp(rotation)ᵀ: an AHRS upside down, on its side, or zeroed
      // where the platform was not level.
      {"attitude_mounting",
       {{"rotation_rad", ParameterShape::vector3, ValueRange::any}},
       [](const AppliedEffect& fault, const Robot& robot, Log& log) {
         const Matrix3 back =
             exp_so3(Vector3(row_of(values_of(fault)).transpose())).toRotationMatrix().transpose();
         for (Eigen::Index row = 0; row < log.roll_pitch_yaw_rad.rows(); ++row) {
           const Vector3 read = log.roll_pitch_yaw_rad.row(row).transpose();
           const Matrix3 sensor =
               rotation_from_euler(read, robot.euler_convention).toRotationMatrix();
           log.roll_pitch_yaw_rad.row(row) =
               euler_from_rotation(sensor * back, robot.euler_convention).transpose();
         }
       }},
      // Readings + offset are roll, pitch and yaw: angles of which those of a moment were taken.
      {"attitude_offset",
       {{"offset_rad", ParameterShape::vector3, ValueRange::any}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         log.roll_pitch_yaw_rad.rowwise() += row_of(values_of(fault));
       }},
      // Readings + offset are tensions: load cells that were zeroed under load.
      {"tension_offset",
       {{"offset_N", kPerCable, ValueRange::any}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         log.tension_N.rowwise() += row_of(values_of(fault));
       }},
      // Of sensors that read whole lengths: readings − offset are lengths; so are readings by
      // 1 + ratio_error, and readings of unstretched cables by 1 − tension / EA. `geometry` finds
      // them; the simulated plant has no such sensor.
      {"whole_length_offset",
       {{"offset_m", kPerCable, ValueRange::any}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         change_whole_lengths(log, [&](Eigen::Index, Eigen::Index cable, double& length_m) {
           length_m -= values_of(fault)[static_cast<std::size_t>(cable)];
         });
       }},
      {"whole_length_scale",
       {{"ratio_error", kPerCable, ValueRange::above_minus_one}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         change_whole_lengths(log, [&](Eigen::Index, Eigen::Index cable, double& length_m) {
           length_m /= 1.0 + values_of(fault)[static_cast<std::size_t>(cable)];
         });
       }},
      {"whole_length_stretch",
       {{"axial_stiffness_N", ParameterShape::scalar, ValueRange::positive}},
       [](const AppliedEffect& fault, const Robot&, Log& log) {
         const auto read = log.tension_N.array().isFinite();
         if (!read.any()) return;
         const double mean_N =  // of a cable whose tension was not read
             read.select(log.tension_N, 0.0).sum() / static_cast<double>(read.count());
         change_whole_lengths(log, [&](Eigen::Index row, Eigen::Index cable, double& length_m) {
           const double read_N = log.tension_N(row, cable);
           const double tension_N = std::isfinite(read_N) ? read_N : mean_N;
           length_m /= 1.0 - tension_N / values_of(fault)[0];
         });
       }}};
  return table;
}

bool is_reading_fault(const std::string& name) { return find(name) != nullptr; }

Robot without_reading_faults(Robot robot) {
  std::erase_if(robot.effects, [](const AppliedEffect& e) { return is_reading_fault(e.name); });
  return robot;
}

void set_right(const AppliedEffect& fault, const Robot& robot, Log& log) {
  if (const ReadingFault* row = find(fault.name)) row->set_right(fault, robot, log);
}

}  // namespace cdprcal
