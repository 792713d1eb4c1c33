// What may be read, and how it was reached, at a pose: for effects that look at it.
#pragma once

#include "cdprcal/readings/measurement.hpp"
#include "random_robot.hpp"

namespace cdprcal::test {

inline Measurement random_measurement(Rng& rng, const RobotPose& at) {
  const int n = at.robot.cable_count();
  Measurement m;
  m.length_m = m.swivel_rad = CableVector::Zero(n);
  m.tension_N = random_tensions(rng, at.robot);
  m.run_time_s = uniform(rng, 1.0, 300.0);
  m.length_direction.resize(n);
  m.swivel_direction.resize(n);
  for (int i = 0; i < n; ++i) {
    m.length_direction[i] = uniform(rng, -1.0, 1.0);
    m.swivel_direction[i] = uniform(rng, -1.0, 1.0);
  }
  for (const auto of : {&Measurement::twist, &Measurement::acceleration}) {
    (m.*of) << uniform_vector(rng, Vector3::Constant(-0.5), Vector3::Constant(0.5)),
        uniform_vector(rng, Vector3::Constant(-1.0), Vector3::Constant(1.0));
  }
  for (const auto rate : {&Measurement::length_rate_m_s, &Measurement::swivel_rate_rad_s}) {
    (m.*rate).resize(n);
    for (double& one : m.*rate) one = uniform(rng, -0.3, 0.3);
  }
  m.rising_wrench << uniform_vector(rng, Vector3::Constant(-5.0), Vector3::Constant(5.0)),
      uniform_vector(rng, Vector3::Constant(-1.0), Vector3::Constant(1.0));
  m.attitude_rate_rad_s = uniform_vector(rng, Vector3::Constant(-0.3), Vector3::Constant(0.3));
  return m;
}

}  // namespace cdprcal::test
