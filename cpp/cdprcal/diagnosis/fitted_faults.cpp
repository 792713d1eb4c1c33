#include "cdprcal/diagnosis/fitted_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/singular_values.hpp"
#include "cdprcal/statics/tension.hpp"
#include "cdprcal/statics/wrench.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr double kPrior = 0.001;  // of a value that fits among so many
/// A sensor that is askew by less is an effect [rad]: `plausible` of ahrs_misalignment.
constexpr double kAskew_rad = 0.105;
/// Cells that were zeroed while the platform hung on them read that load too little; what bears
/// less of the weight than this share is an effect.
constexpr double kHung = 0.25;

/// A row of the log, and where the platform was then by the sensors that are left.
struct Place {
  Eigen::Index row = 0;
  Pose pose;
};
/// Of a log without one group of sensors; empty where it leaves poses open.
std::vector<Place> places_of(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  const Calibration found = calibrate(robot, log, options);
  std::vector<Place> out;
  // How well a pose is known does not matter here: what is fitted to it must agree afterwards.
  if (found.result.status == CalibrationStatus::not_converged) return out;
  if (found.result.poses.size() != found.problem.measurements.size()) return out;
  for (std::size_t i = 0; i < found.problem.measurements.size(); ++i) {
    const auto at = std::ranges::lower_bound(log.time_s, found.problem.measurements[i].time_s);
    if (at == log.time_s.end()) continue;
    const auto row = static_cast<Eigen::Index>(at - log.time_s.begin());
    if (out.empty() || out.back().row != row) out.push_back({row, found.result.poses[i]});
  }
  return out;
}

/// M of R* = Rz(ψ) R M that fits best, whatever the heading ψ: from where down is, and from turns
/// between one rest and the next, both as the platform sees them (Wahba's problem; Markley, J.
/// Astronaut. Sci. 36, 1988).
Matrix3 mounting_of(const std::vector<Matrix3>& platform, const std::vector<Matrix3>& sensor) {
  Matrix3 products = Matrix3::Zero();
  const auto add = [&](const Vector3& by_platform, const Vector3& by_sensor) {
    products += by_platform * by_sensor.transpose();
  };
  const auto turn = [](const Matrix3& from, const Matrix3& to) {
    return log_so3(Eigen::Quaterniond(Matrix3(from.transpose() * to)));
  };
  for (std::size_t k = 0; k < platform.size(); ++k) {
    add(platform[k].row(2).transpose(), sensor[k].row(2).transpose());
    if (k > 0) add(turn(platform[k - 1], platform[k]), turn(sensor[k - 1], sensor[k]));
  }
  const Svd parts = svd(products);
  Vector3 proper = Vector3::Ones();
  proper[2] = (parts.u * parts.v.transpose()).determinant();
  return parts.u * proper.asDiagonal() * parts.v.transpose();
}

double angle_between(const Matrix3& one, const Matrix3& other) {
  return log_so3(Eigen::Quaterniond(Matrix3(one.transpose() * other))).norm();
}

/// Whether an offset of yaw turns the sensor about the platform's z: yaw is the last of the angles.
bool yaw_is_of_platform(EulerConvention convention) { return to_string(convention).back() == 'Z'; }

/// Rz(α) A with the α that brings it nearest to a mounting; α is 0 where `turns` is false.
Matrix3 turned_nearest(const Matrix3& axes, const Matrix3& mounting, bool turns) {
  if (!turns) return axes;
  const Matrix3 n = mounting * axes.transpose();
  const double angle_rad = std::atan2(n(1, 0) - n(0, 1), n(0, 0) + n(1, 1));
  return Eigen::AngleAxisd(angle_rad, Vector3::UnitZ()).toRotationMatrix() * axes;
}

/// A mounting without what an offset of yaw may be of it, and the rotation that turns axes into
/// axes in its place where that is near.
Matrix3 plain(const Matrix3& mounting, bool turns) {
  Matrix3 best = Matrix3::Identity();
  double nearest_rad = std::numeric_limits<double>::infinity();
  int axes[] = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3 other = Matrix3::Zero();
      for (int i = 0; i < 3; ++i) other(i, axes[i]) = ((signs >> i) & 1) != 0 ? -1.0 : 1.0;
      if (other.determinant() < 0.0) continue;
      const Matrix3 turned = turned_nearest(other, mounting, turns);
      // Of those that are the same but for yaw the least turn.
      const double apart_rad =
          angle_between(turned, mounting) + 1e-6 * angle_between(Matrix3::Identity(), other);
      if (apart_rad < nearest_rad) nearest_rad = apart_rad, best = other;
    }
  } while (std::next_permutation(std::begin(axes), std::end(axes)));
  if (nearest_rad < kAskew_rad) return best;
  const Matrix3 of_yaw = turned_nearest(Matrix3::Identity(), mounting, turns);
  return of_yaw.transpose() * mounting;
}

std::vector<double> values_of(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

DiscreteFault offset_fault(const Vector3& offset_rad) {
  return {"attitude_offset", "offset_rad", values_of(offset_rad),
          printed("roll and pitch were zeroed at %.3g and %.3g deg", offset_rad[0] / kDegree,
                  offset_rad[1] / kDegree)};
}

DiscreteFault mounting_fault(const Matrix3& mounting) {
  const Vector3 turned_rad = log_so3(Eigen::Quaterniond(mounting));
  const double angle_rad = turned_rad.norm();
  const Vector3 axis = turned_rad / angle_rad;
  return {"attitude_mounting", "rotation_rad", values_of(turned_rad),
          printed("the AHRS is mounted turned by %.4g deg about (%.2g, %.2g, %.2g) of the platform",
                  angle_rad / kDegree, axis[0], axis[1], axis[2])};
}

void add_of_attitude(const Robot& robot, const Log& log, const std::vector<Place>& places,
                     std::vector<DiscreteFault>& out) {
  std::vector<Matrix3> platform, sensor;
  Vector3 offset_rad = Vector3::Zero();
  for (const Place& place : places) {
    const Vector3 read = log.roll_pitch_yaw_rad.row(place.row).transpose();
    if (!read.allFinite()) continue;
    platform.push_back(place.pose.rotation_matrix());
    sensor.push_back(rotation_from_euler(read, robot.euler_convention).toRotationMatrix());
    const Vector3 angles = euler_from_rotation(platform.back(), robot.euler_convention);
    for (int a = 0; a < 2; ++a) offset_rad[a] += wrap_angle(angles[a] - read[a]);
  }
  if (platform.empty()) return;
  offset_rad /= static_cast<double>(platform.size());  // yaw has an offset of its own
  if (offset_rad.norm() > kAskew_rad) out.push_back(offset_fault(offset_rad));
  const Matrix3 mounting =
      plain(mounting_of(platform, sensor), yaw_is_of_platform(robot.euler_convention));
  if (angle_between(Matrix3::Identity(), mounting) > kAskew_rad) {
    out.push_back(mounting_fault(mounting));
  }
}

void add_of_tensions(const Robot& given, const Log& log, const std::vector<Place>& places,
                     std::vector<DiscreteFault>& out) {
  const Robot robot = with_effects(given, resolve_effects(given, log.source));
  Eigen::VectorXd sum_N = Eigen::VectorXd::Zero(robot.cable_count());
  Eigen::RowVectorXd upward = sum_N.transpose();  // of a pull of 1 N, what it bears
  double count = 0.0;
  for (const Place& place : places) {
    const PlatformState state = platform_state(robot, place.pose);
    const TensionModel model = tensions_least_squares(robot, state);
    const Eigen::VectorXd read = log.tension_N.row(place.row).transpose();
    if (!model.valid || !read.allFinite()) continue;
    sum_N += model.tension_N - read;
    upward -= structure_matrix(state).row(2);
    count += 1.0;
  }
  if (!(count > 0.0)) return;
  const Eigen::VectorXd offset_N = sum_N / count;
  if (!(upward.dot(offset_N) / count > kHung * robot.weight_N())) return;
  out.push_back(
      {"tension_offset", "offset_N", values_of(offset_N), "the load cells were zeroed under load"});
}

}  // namespace

std::vector<DiscreteFault> fitted_faults(const Robot& robot, const Log& log,
                                         CalibrateOptions options,
                                         const std::vector<double>& at_s) {
  options.at_s = at_s;
  std::vector<DiscreteFault> out;
  if (log.roll_pitch_yaw_rad.cols() > 0) {
    Log without = log;
    without.roll_pitch_yaw_rad.resize(log.roll_pitch_yaw_rad.rows(), 0);
    add_of_attitude(robot, log, places_of(robot, without, options), out);
  }
  // Without load cells rests on six cables or more say nothing.
  if (log.tension_N.cols() > 0 && robot.cable_count() < 6) {
    Log without = log;
    without.tension_N.resize(log.tension_N.rows(), 0);
    add_of_tensions(robot, log, places_of(robot, without, options), out);
  }
  for (DiscreteFault& fault : out) fault.prior = kPrior;
  return out;
}

}  // namespace cdprcal
