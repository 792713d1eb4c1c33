// Robots and a simulator for the planning tests.
#pragma once

#include <optional>
#include <vector>

#include "../support/random_robot.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/planning/path.hpp"
#include "cdprcal/planning/pose_grid.hpp"
#include "cdprcal/planning/timing.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {

/// Set-points of a grid in a box; the positions that are none are left out.
inline std::vector<SetPoint> set_points_in(const SetPointSolver& solver, const Box& box,
                                           const std::array<int, 3>& counts) {
  std::vector<SetPoint> out;
  for (const Vector3& position : grid_positions(box, counts)) {
    if (auto result = solver.at(position); result.set_point) out.push_back(*result.set_point);
  }
  return out;
}

/// The robot turned by `angle_rad` about the vertical through the origin.
inline Robot turned(Robot robot, double angle_rad) {
  const Matrix3 turn = exp_so3({0.0, 0.0, angle_rad}).toRotationMatrix();
  robot.name += " turned";
  for (Cable& cable : robot.cables) {
    cable.pulley.position_m = turn * cable.pulley.position_m;
    cable.pulley.axes_world = turn * cable.pulley.axes_world;
  }
  finalise(robot);
  return robot;
}

/// The platform as a free rigid body on cables of given tensions, with modal damping: the full
/// equations of motion (large rotations, gyroscopic terms), integrated by Runge and Kutta.
class Simulator {
 public:
  Simulator(const Robot& robot, double damping_ratio) : robot_(robot), damping_(damping_ratio) {}

  struct State {
    Pose pose;
    Vector6 velocity = Vector6::Zero();  ///< of P, and angular; world axes
  };

  /// D = Σ 2ζω (Mv)(Mv)ᵀ over the modes at a set-point.
  Matrix6 damping_at(const SetPoint& at) const {
    const PlatformState state = platform_state(robot_, at.pose);
    const Modes modes = constant_tension_modes(robot_, state, at.tension_N);
    const Matrix6 mass = mass_matrix(robot_, state);
    Matrix6 damping = Matrix6::Zero();
    for (int k = 0; k < 6; ++k) {
      const Vector6 v = mass * modes.shape.col(k);
      damping += 4.0 * kPi * damping_ * modes.natural_frequency_hz[k] * v * v.transpose();
    }
    return damping;
  }

  template <class TensionAt>
  State step(const State& from, double time_s, double step_s, const TensionAt& tension_at,
             const Matrix6& damping) const {
    const Vector6 a1 = acceleration(from, tension_at(time_s), damping);
    const State s2{plus(from.pose, 0.5 * step_s * from.velocity),
                   from.velocity + 0.5 * step_s * a1};
    const Vector6 a2 = acceleration(s2, tension_at(time_s + 0.5 * step_s), damping);
    const State s3{plus(from.pose, 0.5 * step_s * s2.velocity), from.velocity + 0.5 * step_s * a2};
    const Vector6 a3 = acceleration(s3, tension_at(time_s + 0.5 * step_s), damping);
    const State s4{plus(from.pose, step_s * s3.velocity), from.velocity + step_s * a3};
    const Vector6 a4 = acceleration(s4, tension_at(time_s + step_s), damping);
    const Vector6 velocity =
        (from.velocity + 2.0 * s2.velocity + 2.0 * s3.velocity + s4.velocity) / 6.0;
    return {plus(from.pose, step_s * velocity),
            from.velocity + step_s * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0};
  }

 private:
  Vector6 acceleration(const State& at, const CableVector& tension_N,
                       const Matrix6& damping) const {
    const PlatformState state = platform_state(robot_, at.pose);
    const Vector3 arm = state.centre_of_mass_arm_m, spin = at.velocity.tail<3>();
    const double m = robot_.platform.mass_kg;
    const Matrix3 inertia_at_p =
        state.rotation * robot_.platform.inertia_kg_m2 * state.rotation.transpose() -
        m * skew(arm) * skew(arm);
    Vector6 bias;
    bias << m * spin.cross(spin.cross(arm)), spin.cross(inertia_at_p * spin);
    const Vector6 wrench =
        -wrench_residual(robot_, state, tension_N) - damping * at.velocity - bias;
    return solve_symmetric(mass_matrix(robot_, state), wrench);
  }

  const Robot& robot_;
  double damping_;
};

/// Largest reading [σ] by which a pose differs from a set-point.
inline double readings_away(const Robot& robot, const SetPoint& from, const Pose& pose) {
  const PlatformState state = platform_state(robot, from.pose);
  const Vector6 twist = minus(pose, from.pose);
  return std::max({(length_jacobian(state) * twist).cwiseAbs().maxCoeff() / robot.sigma.length_m,
                   (swivel_jacobian(state) * twist).cwiseAbs().maxCoeff() / robot.sigma.swivel_rad,
                   twist.tail<3>().cwiseAbs().maxCoeff() / robot.sigma.attitude_rad});
}

}  // namespace cdprcal::test
