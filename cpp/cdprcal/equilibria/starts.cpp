#include "cdprcal/equilibria/starts.hpp"

#include <algorithm>
#include <utility>

#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {
namespace {

Vector3 anchor_centroid_m(const Robot& robot) {
  Vector3 sum = Vector3::Zero();
  for (const Cable& cable : robot.cables) sum += cable.platform_anchor_m;
  return sum / std::max(1, robot.cable_count());
}

Vector3 pulley_centroid_m(const Robot& robot, const CableVector& weights) {
  const double total = weights.sum();
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < robot.cable_count(); ++i) {
    const double w = total > 0.0 ? weights[i] / total : 1.0 / robot.cable_count();
    sum += w * robot.cables[i].pulley.position_m;
  }
  return sum;
}

/// The turn about the vertical that best lays the anchors in the direction of their pulleys:
/// the plane Procrustes problem, solved by one atan2.
double facing_yaw_rad(const Robot& robot, const Eigen::Quaterniond& tilt) {
  const CableVector equal = CableVector::Ones(robot.cable_count());
  const Vector3 pulleys = pulley_centroid_m(robot, equal);
  const Vector3 anchors = anchor_centroid_m(robot);
  double cosine = 0.0;
  double sine = 0.0;
  for (const Cable& cable : robot.cables) {
    const Vector3 d = cable.pulley.position_m - pulleys;
    const Vector3 a = tilt * (cable.platform_anchor_m - anchors);
    cosine += a.x() * d.x() + a.y() * d.y();
    sine += a.x() * d.y() - a.y() * d.x();
  }
  const double size = robot_size_m(robot);
  return std::hypot(cosine, sine) > 1e-9 * size * size ? std::atan2(sine, cosine) : 0.0;
}

Eigen::Quaterniond turned(double angle_rad, const Vector3& axis, const Eigen::Quaterniond& q) {
  return (exp_so3(angle_rad * axis) * q).normalized();
}

Eigen::Quaterniond facing(const Robot& robot, const Eigen::Quaterniond& tilt) {
  return turned(facing_yaw_rad(robot, tilt), Vector3::UnitZ(), tilt);
}

/// Root of an increasing function on [low, high] to 1e-3 of the bracket: enough for a start.
template <typename F>
double bisect(F&& increasing, double low, double high) {
  for (int k = 0; k < 12; ++k) {
    const double middle = 0.5 * (low + high);
    (increasing(middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

StartRotations start_rotations(const Robot& robot) {
  std::vector<Eigen::Quaterniond> rotations;
  rotations.push_back(facing(robot, Eigen::Quaterniond::Identity()));
  const Vector3 up = anchor_centroid_m(robot) - robot.platform.centre_of_mass_m;
  if (up.norm() > 1e-6 * robot_size_m(robot) && up.normalized().z() < std::cos(kPi / 6.0)) {
    rotations.push_back(facing(robot, rotation_between(up, Vector3::UnitZ()).normalized()));
  }
  const std::size_t likely = rotations.size();
  for (std::size_t k = 0; k < likely; ++k) {
    const Eigen::Quaterniond base = rotations[k];
    // Axes that turn with the robot, so that the starts do too.
    const Vector3 x = base * Vector3::UnitX();
    const Vector3 y = base * Vector3::UnitY();
    for (const double yaw : {0.5 * kPi, kPi, -0.5 * kPi}) {
      rotations.push_back(turned(yaw, Vector3::UnitZ(), base));
    }
    for (const Vector3& axis : {x, y}) {
      for (const double tilt : {kPi / 3.0, -kPi / 3.0, kPi}) {
        rotations.push_back(turned(tilt, axis, base));
      }
    }
  }
  return {std::move(rotations), likely};
}

Pose hanging_pose(const Robot& robot, const Eigen::Quaterniond& rotation,
                  const CableVector& weights, double drop_m) {
  const Vector3 target = pulley_centroid_m(robot, weights) - drop_m * Vector3::UnitZ();
  return {target - rotation * anchor_centroid_m(robot), rotation};
}

double drop_for_tensions(const Robot& robot, const Eigen::Quaterniond& rotation,
                         const CableVector& tension_N) {
  const auto excess = [&](double drop_m) {
    const PlatformState state =
        platform_state(robot, hanging_pose(robot, rotation, tension_N, drop_m));
    double lift = 0.0;
    for (int i = 0; i < state.cable_count; ++i) {
      if (state.cable[i].status == CableStatus::ok) {
        lift += tension_N[i] * state.cable[i].direction.z();
      }
    }
    return -lift - robot.weight_N();  // the cables pull the platform up along −t
  };
  const double size = robot_size_m(robot);
  if (!(excess(10.0 * size) > 0.0)) return size;
  return bisect(excess, 0.02 * size, 10.0 * size);
}

double drop_for_lengths(const Robot& robot, const Eigen::Quaterniond& rotation,
                        const CableVector& length_m) {
  const auto excess = [&](double drop_m) {
    const PlatformState state = platform_state(
        robot, hanging_pose(robot, rotation, CableVector::Ones(robot.cable_count()), drop_m));
    return state.valid ? (state.length_m() - length_m).sum() : -1.0;
  };
  const double size = std::max(robot_size_m(robot), length_m.maxCoeff());
  return bisect(excess, 0.0, 2.0 * size);
}

}  // namespace cdprcal
