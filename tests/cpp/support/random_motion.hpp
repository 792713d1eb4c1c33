// A platform that moves at random.
#pragma once

#include "cdprcal/motion/motion_state.hpp"
#include "random_robot.hpp"

namespace cdprcal::test {

inline MotionState random_state(Rng& rng) {
  const auto vector = [&](double size) {
    return uniform_vector(rng, Vector3::Constant(-size), Vector3::Constant(size));
  };
  MotionState state;
  state.pose = {vector(2.0), random_rotation(rng)};
  state.twist << vector(1.0), vector(0.7);
  state.acceleration << vector(5.0), vector(5.0);
  return state;
}

}  // namespace cdprcal::test
