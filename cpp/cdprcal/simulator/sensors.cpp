#include "cdprcal/simulator/sensors.hpp"

#include <algorithm>

#include "cdprcal/readings/turn_over.hpp"
#include "cdprcal/simulator/history.hpp"
#include "cdprcal/simulator/written_effects.hpp"

namespace cdprcal {
namespace {

double reading(double value, const SensorChannel& channel, RandomNormal& random) {
  double v = value + channel.bias;
  if (channel.noise > 0.0) v += channel.noise * random();
  if (channel.resolution > 0.0) v = channel.resolution * std::round(v / channel.resolution);
  return v;
}

}  // namespace

SensorBank::SensorBank(const PlantParameters& parameters, const SimulatorOptions& options)
    : p_(parameters), options_(options.sensors), seed_(options.seed), unit_(p_, options.sensors) {
  const SensorOptions& s = options_;
  length_clock_ = {1.0 / s.length_m.rate_Hz, s.length_m.delay_s + p_.length_delay_s};
  swivel_clock_ = {1.0 / s.swivel_rad.rate_Hz, s.swivel_rad.delay_s + p_.swivel_delay_s};
  tension_clock_ = {1.0 / s.tension_N.rate_Hz, s.tension_N.delay_s + p_.tension_delay_s};
  attitude_clock_ = {1.0 / s.roll_pitch_rad.rate_Hz,
                     s.roll_pitch_rad.delay_s + p_.attitude_delay_s};
  for (const Clock& c : {length_clock_, swivel_clock_, tension_clock_, attitude_clock_}) {
    history_s_ = std::max(history_s_, c.delay_s);
  }
}

PlantSnapshot SensorBank::snapshot(const PlantDynamics& plant) {
  const int n = p_.robot.cable_count();
  PlantSnapshot now{plant.time_s(), plant.pose(), CableVector(n), CableVector(n), CableVector(n)};
  for (int i = 0; i < n; ++i) {
    now.encoder_m[i] = plant.encoder_m(i);
    const double swivel = plant.strand(i).cable.swivel_rad;
    double& lagging = swivel_play_rad_[i];
    lagging =
        std::clamp(lagging, swivel - p_.swivel_half_width_rad, swivel + p_.swivel_half_width_rad);
    now.swivel_rad[i] = lagging;
    now.load_cell_N[i] = plant.load_cell_tension_N(i);
  }
  if (!p_.written.empty()) add_written(plant, now);
  return now;
}

void SensorBank::add_written(const PlantDynamics& plant, PlantSnapshot& now) {
  for (Eigen::Index i = 0; i < swivel_turn_.size(); ++i) {
    const double swivel = plant.strand(static_cast<int>(i)).cable.swivel_rad;
    const double turned = wrap_angle(swivel - swivel_seen_rad_[i]);
    swivel_turn_[i] = turned_over(swivel_turn_[i], turned, kTurnOver_rad);
    swivel_seen_rad_[i] = swivel;
  }
  const WrittenReadings added = written_readings(p_, plant, swivel_turn_);
  now.encoder_m += added.length_m;
  now.swivel_rad += added.swivel_rad;
  now.load_cell_N = added.load_cell_N;
  now.written_rad = added.roll_pitch_yaw_rad;
}

void SensorBank::reset(const PlantDynamics& plant) {
  const int n = p_.robot.cable_count();
  length_noise_ = RandomNormal(stream(seed_, 1));
  swivel_noise_ = RandomNormal(stream(seed_, 2));
  tension_noise_ = RandomNormal(stream(seed_, 3));
  attitude_noise_ = RandomNormal(stream(seed_, 4));
  drive_noise_ = RandomNormal(stream(seed_, 6));
  RandomNormal random(stream(seed_, 5));
  offsets_ = {CableVector::Zero(n), CableVector::Zero(n), 0.0};
  if (options_.random_offsets) offsets_ = random_offsets(n, random);
  for (Clock* c : {&length_clock_, &swivel_clock_, &tension_clock_, &attitude_clock_}) c->taken = 0;
  swivel_play_rad_.resize(n);
  for (int i = 0; i < n; ++i) swivel_play_rad_[i] = plant.strand(i).cable.swivel_rad;
  swivel_seen_rad_ = swivel_play_rad_;
  if (options_.random_offsets) {
    swivel_play_rad_ -=
        p_.swivel_half_width_rad * directions_left(n, RandomNormal(stream(seed_, 9)));
  }
  swivel_turn_.setZero(n);
  history_.clear();
  sample_ = {};
  sample_.length_m.resize(n);
  sample_.swivel_rad.resize(n);
  sample_.tension_N.resize(n);
  drive_error_N_.setZero(n);
  unit_.reset(plant, RandomNormal(stream(seed_, 7)), RandomNormal(stream(seed_, 8)));
  update(plant);
}

PlantSnapshot SensorBank::seen(double time_s) const {
  // A delay may ask for times before the first one: the robot hung there at rest.
  if (time_s <= history_.front().time_s) return history_.front();
  const auto after =
      std::partition_point(history_.begin(), history_.end(),
                           [&](const PlantSnapshot& s) { return s.time_s < time_s - 1e-12; });
  if (after == history_.end()) return history_.back();
  const PlantSnapshot& b = *after;
  const PlantSnapshot& a = *std::prev(after);
  const double f = (time_s - a.time_s) / (b.time_s - a.time_s);
  PlantSnapshot out{time_s,
                    plus(a.pose, f * minus(b.pose, a.pose)),
                    a.encoder_m + f * (b.encoder_m - a.encoder_m),
                    a.swivel_rad,
                    a.load_cell_N + f * (b.load_cell_N - a.load_cell_N),
                    a.written_rad + f * (b.written_rad - a.written_rad)};
  for (Eigen::Index i = 0; i < out.swivel_rad.size(); ++i) {
    out.swivel_rad[i] += f * wrap_angle(b.swivel_rad[i] - a.swivel_rad[i]);
  }
  return out;
}

void SensorBank::update(const PlantDynamics& plant) {
  const double now_s = plant.time_s();
  if (p_.robot.platform.inertial_unit_m) unit_.update(plant);
  const bool due = length_clock_.due(now_s) || swivel_clock_.due(now_s) ||
                   tension_clock_.due(now_s) || attitude_clock_.due(now_s);
  sample_.time_s = now_s;
  if (!due && history_s_ == 0.0 && p_.swivel_half_width_rad == 0.0) return;
  if (history_s_ == 0.0) history_.clear();
  history_.push_back(snapshot(plant));
  while (history_.size() > 2 && history_[1].time_s < now_s - history_s_ - 1e-9)
    history_.pop_front();
  if (!due) return;
  const auto take = [&](Clock& clock, auto read) {
    if (!clock.due(now_s)) return;
    ++clock.taken;
    (this->*read)(clock.delay_s > 0.0 ? seen(now_s - clock.delay_s) : history_.back());
  };
  take(length_clock_, &SensorBank::read_lengths);
  take(swivel_clock_, &SensorBank::read_swivels);
  take(tension_clock_, &SensorBank::read_tensions);
  take(attitude_clock_, &SensorBank::read_attitude);
}

void SensorBank::read_lengths(const PlantSnapshot& world) {
  sample_.drives_time_s = sample_.time_s;
  for (Eigen::Index i = 0; i < sample_.length_m.size(); ++i) {
    const int source = p_.cable_order[static_cast<std::size_t>(i)];
    const double value = reading(world.encoder_m[source], options_.length_m, length_noise_);
    sample_.length_m[i] =
        p_.length_factor[source] * (p_.length_sign[source] * value + offsets_.length_m[source]);
  }
}

void SensorBank::read_swivels(const PlantSnapshot& world) {
  for (Eigen::Index i = 0; i < sample_.swivel_rad.size(); ++i) {
    const int source = p_.cable_order[static_cast<std::size_t>(i)];
    const double told = changed(p_.swivel_rad, world.swivel_rad[source], source, world.time_s);
    const double value = reading(told, options_.swivel_rad, swivel_noise_);
    sample_.swivel_rad[i] =
        p_.swivel_factor[source] * (p_.swivel_sign[source] * value + offsets_.swivel_rad[source]);
  }
}

double SensorBank::load_cell_N(int cable, double tension_N, double time_s) const {
  // Zero and drift are newtons of force at the bridge, which the amplifier's gain then scales: as
  // in the catalogue, where each effect's newtons are true ones.
  return (1.0 + p_.load_cell_gain[cable]) * changed(p_.load_cell_N, tension_N, cable, time_s);
}

const CableVector& SensorBank::drive_reading_error_N(const PlantDynamics& plant) {
  const CableVector written_N =
      p_.written.empty() ? CableVector() : written_readings(p_, plant, swivel_turn_).load_cell_N;
  for (int i = 0; i < p_.robot.cable_count(); ++i) {
    const double tension = plant.load_cell_tension_N(i);
    const double shown = written_N.size() > 0 ? written_N[i] : tension;
    drive_error_N_[i] = load_cell_N(i, shown, plant.time_s()) - tension;
    if (p_.drive_noise_N > 0.0) drive_error_N_[i] += p_.drive_noise_N * drive_noise_();
  }
  return drive_error_N_;
}

void SensorBank::read_tensions(const PlantSnapshot& world) {
  const double all_N = world.load_cell_N.sum();
  for (Eigen::Index i = 0; i < sample_.tension_N.size(); ++i) {
    const double load_N = world.load_cell_N[i];
    const double felt_N = load_N + p_.load_cell_cross_talk * (all_N - load_N);
    const double value = load_cell_N(static_cast<int>(i), felt_N, world.time_s);
    sample_.tension_N[i] =
        p_.tension_factor[i] * reading(value, options_.tension_N, tension_noise_);
  }
}

void SensorBank::read_attitude(const PlantSnapshot& world) {
  sample_.attitude_time_s = sample_.time_s;
  if (p_.robot.platform.inertial_unit_m) unit_.read(sample_);
  const Matrix3 rotation = (p_.level * world.pose.rotation * p_.ahrs_rotation).toRotationMatrix();
  Vector3 angles = euler_from_rotation(rotation, p_.euler_convention);
  for (const auto& effect : p_.attitude_rad) effect(world.pose, world.time_s, angles);
  angles += world.written_rad;
  for (int a = 0; a < 3; ++a) {
    const SensorChannel& channel = a < 2 ? options_.roll_pitch_rad : options_.yaw_rad;
    angles[a] = reading(angles[a], channel, attitude_noise_);
  }
  angles[2] += offsets_.yaw_rad;
  for (int a = 0; a < 3; ++a) {
    sample_.roll_pitch_yaw_rad[a] =
        p_.attitude_factor * p_.attitude_sign[a] * wrap_angle(angles[a]);
  }
}

}  // namespace cdprcal
