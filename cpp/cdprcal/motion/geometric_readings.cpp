#include "cdprcal/motion/geometric_readings.hpp"

namespace cdprcal {
namespace {

/// Whether it reads where the platform is; load cells read forces, and inertial units motion.
bool is_geometric(const Sensor& sensor) {
  return sensor.sigma != nullptr && !sensor.is_inertial() &&
         &sensor != &row_of(Channel::balance).of();
}

}  // namespace

std::vector<RowLabel> geometric_rows(int cable_count) {
  std::vector<RowLabel> rows;
  const auto add = [&](Channel channel) {
    const ChannelRow& row = row_of(channel);
    const int count = row.of().width == kOneACable ? cable_count : row.count;
    for (int i = 0; i < count; ++i) rows.push_back({channel, i});
  };
  for (const ChannelRow& row : kChannelTable) {
    if (is_geometric(row.of())) add(channel_of(row));
  }
  return rows;
}

bool is_angle(const RowLabel& row) { return row_of(row.channel).of().is_angle(); }

bool has_offset(const RowLabel& row) { return row_of(row.channel).has_offset; }

std::string in_words(const RowLabel& row) {
  const ChannelRow& channel = row_of(row.channel);
  return channel.of().column(channel.first + row.component);
}

bool evaluate(const Robot& robot, const ActiveEffects& effects, const Measurement& m,
              const Pose& pose, GeometricReadings& out) {
  evaluate_pose(robot, m, pose, StaticsModel::none, {}, effects, true, out.model);
  if (!out.model.valid) return false;
  const int n = robot.cable_count();
  Eigen::Index size = 0;
  for (const Sensor& sensor : kSensorTable) {
    if (is_geometric(sensor)) size += sensor.columns_of(n);
  }
  out.misfit.setConstant(size, kNaN);
  out.by_pose.resize(size, 6);
  Eigen::Index next = 0;
  // All of a sensor; one that is absent leaves NaN.
  const auto put = [&](const Sensor& sensor, const auto& field, const auto& predicted,
                       const auto& by_twist) {
    if (!is_geometric(sensor)) return;
    const auto read = numbers(field);
    const auto model = numbers(predicted);
    for (Eigen::Index i = 0; i < sensor.columns_of(n); ++i, ++next) {
      const auto at = static_cast<std::size_t>(i);
      out.by_pose.row(next) = by_twist.row(i);
      if (at >= read.size()) continue;
      const double misfit = model[at] - read[at];
      out.misfit[next] = sensor.is_angle() ? wrap_angle(misfit) : misfit;
    }
  };
  const PoseEvaluation& model = out.model;
  const auto sensor_of = [](Channel channel) -> const Sensor& { return row_of(channel).of(); };
  put(sensor_of(Channel::length), m.length_m, model.length_m, model.length_by_twist);
  put(sensor_of(Channel::swivel), m.swivel_rad, model.swivel_rad, model.swivel_by_twist);
  put(sensor_of(Channel::yaw), m.roll_pitch_yaw_rad, model.roll_pitch_yaw_rad,
      model.attitude_by_twist);
  for_each_absolute(put, static_cast<const AbsoluteFields<ReadingOf>&>(m),
                    static_cast<const AbsoluteFields<ReadingOf>&>(model), model.absolute_by_twist);
  return true;
}

}  // namespace cdprcal
