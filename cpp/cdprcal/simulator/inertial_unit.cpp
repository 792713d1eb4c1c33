#include "cdprcal/simulator/inertial_unit.hpp"

#include <algorithm>

namespace cdprcal {
namespace {

/// What a reading is the mean of: a bandwidth of about 100 Hz.
constexpr double kWindow_s = 4e-3;

Vector3 normal3(double sigma, RandomNormal& random) {
  Vector3 out;
  for (double& v : out) v = sigma * random();
  return out;
}

}  // namespace

InertialUnit::InertialUnit(const PlantParameters& parameters, const SensorOptions& options)
    : options_(options),
      delay_s_(options.roll_pitch_rad.delay_s),
      up_m_s2_(parameters.robot.gravity_m_s2 * (parameters.level.conjugate() * Vector3::UnitZ())) {
  const Platform& platform = parameters.robot.platform;
  from_centre_m_ = platform.inertial_unit_m.value_or(Vector3::Zero()) - platform.centre_of_mass_m;
}

void InertialUnit::reset(const PlantDynamics& plant, RandomNormal biases, RandomNormal noise) {
  force_bias_m_s2_ = normal3(options_.specific_force_bias_m_s2, biases);
  rate_bias_rad_s_ = normal3(options_.angular_velocity_bias_rad_s, biases);
  noise_ = noise;
  moments_.clear();
  update(plant);
}

void InertialUnit::update(const PlantDynamics& plant) {
  const PlatformMotion& motion = plant.motion();
  const Vector3 in_platform = motion.body_rate_rad_s.cross(from_centre_m_);
  moments_.push_back(
      {plant.time_s(), motion.velocity_m_s + motion.rotation * in_platform, motion.rotation});
  const double first_s = plant.time_s() - delay_s_ - kWindow_s - 1e-9;
  while (moments_.size() > 2 && moments_[1].time_s < first_s) moments_.pop_front();
}

/// The platform hung at rest before the first moment.
InertialUnit::Moment InertialUnit::at(double time_s) const {
  const auto after = std::ranges::find_if(
      moments_, [&](const Moment& moment) { return moment.time_s > time_s - 1e-9; });
  return after == moments_.end() ? moments_.back() : *after;
}

void InertialUnit::read(RobotSample& sample) {
  const double now_s = moments_.back().time_s - delay_s_;
  const Moment begin = at(now_s - kWindow_s), end = at(now_s);
  const double lasted_s = end.time_s - begin.time_s;
  Vector3 force = up_m_s2_, rate = Vector3::Zero();
  if (lasted_s > 0.0) {
    force += (end.velocity_m_s - begin.velocity_m_s) / lasted_s;
    const Eigen::AngleAxisd turned(begin.rotation.conjugate() * end.rotation);
    rate = turned.angle() * turned.axis() / lasted_s;
  }
  sample.specific_force_m_s2 = end.rotation.conjugate() * force + force_bias_m_s2_ +
                               normal3(options_.specific_force_noise_m_s2, noise_);
  sample.angular_velocity_rad_s =
      rate + rate_bias_rad_s_ + normal3(options_.angular_velocity_noise_rad_s, noise_);
}

}  // namespace cdprcal
