#include "cdprcal/frame/unknowns.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/model/yardstick.hpp"

namespace cdprcal::detail {
namespace {

/// How well a pulley's place is known where the file does not say [m]: as well as a tape measures
/// on irma4, whose frame it grows with.
constexpr double kTape_m = 0.002;
/// Where no pulley of the file says: to a decimetre, on bodies. Points need no guess.
constexpr double kDecimetre_m = 0.1;
/// As a share of the robot's size: a position known no better is not known.
constexpr double kUnknown = 0.25;
/// Tensions tell a stiffness where they differ by this share of their mean.
constexpr double kTensionSpread = 0.1;

/// Axes along which pulleys are looked for: the first from pulley 1 to 2, the second towards 3.
Matrix3 unknown_axes(const Robot& robot) {
  const auto place = [&](std::size_t i) -> Vector3 {
    return i < robot.cables.size() ? robot.cables[i].pulley.position_m : Vector3::Zero();
  };
  const bool planar = row_of(robot.platform.motion).is_planar();
  Vector3 normal = planar ? robot.platform.motion_plane_normal
                          : Vector3((place(1) - place(0)).cross(place(2) - place(0)));
  if (!(normal.norm() > 1e-9))
    normal = (place(1) - place(0)).norm() > 1e-9 ? Vector3((place(1) - place(0)).unitOrthogonal())
                                                 : Vector3::UnitZ();
  normal.normalize();
  Vector3 first = place(1) - place(0);
  first -= first.dot(normal) * normal;
  if (!(first.norm() > 1e-9)) first = normal.unitOrthogonal();
  Matrix3 axes;
  axes.col(0) = first.normalized();
  axes.col(1) = normal.cross(axes.col(0));
  axes.col(2) = normal;
  // A plane's normal may point either way: the file's third pulley is on the positive side.
  const double side = axes.col(1).dot(place(2) - place(0));
  if (side < 0.0 && planar) axes.col(1) *= -1.0;
  return axes;
}

/// Stiffness, where tensions tell one, and what is not known of the tensions that were not read.
void add_stiffness(const std::vector<FramePose>& poses, FrameUnknowns& u) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  bool all_told = true;
  for (const FramePose& pose : poses) {
    const CableVector& tensions = pose.reading.tension_N;
    all_told = all_told && tensions.size() == u.cables && tensions.allFinite();
    for (const double tension : tensions) {
      if (!std::isfinite(tension)) continue;
      sum += tension;
      squares += tension * tension;
      count += 1.0;
    }
  }
  const double mean = sum / count, variance = squares / count - mean * mean;
  if (!(count > 2.0) || !(variance > std::pow(kTensionSpread * mean, 2.0))) return;
  u.mean_tension_N = mean;
  u.tension_spread_N = std::sqrt(variance);
  u.compliance = u.size++;
  if (all_told) return;
  u.untold_tension = u.size;
  u.size += u.cables;
}

}  // namespace

Eigen::MatrixXd rigid_motions(const FrameUnknowns& u, const Robot& robot) {
  const bool flat = u.axis_count == 2;
  Vector3 middle = Vector3::Zero();
  for (const Cable& cable : robot.cables) {
    middle += cable.pulley.position_m / u.cables;
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(u.axis_count * u.cables, flat ? 3 : 6);
  for (int i = 0; i < u.cables; ++i) {
    const Vector3 arm = robot.cables[static_cast<std::size_t>(i)].pulley.position_m - middle;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      const int row = u.anchor(i, axis);
      out(row, axis) = 1.0;
      for (int turn = 0; turn < (flat ? 1 : 3); ++turn) {
        const Vector3 about = u.axes.col(flat ? 2 : turn);
        out(row, u.axis_count + turn) = about.cross(arm).dot(u.axes.col(axis));
      }
    }
  }
  return out;
}

bool fixes_place(const FrameUnknowns& u, const Robot& robot) {
  const Eigen::MatrixXd rigid = rigid_motions(u, robot);
  const Eigen::VectorXd root = u.precision.head(rigid.rows()).cwiseSqrt();
  // Some σ and places are rounded numbers: what is left of a motion by them is not known.
  return Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(root.asDiagonal() * rigid)
             .setThreshold(1e-6)
             .rank() == rigid.cols();
}

bool any_reading(const std::vector<FramePose>& poses, int log, Channel channel) {
  return std::any_of(poses.begin(), poses.end(), [&](const FramePose& pose) {
    if (log >= 0 && pose.log != log) return false;
    return readings_of(pose.reading, channel).array().isFinite().any();
  });
}

FrameUnknowns unknowns_of(const Robot& robot, const std::vector<FramePose>& poses, int logs,
                          const FrameOptions& options) {
  FrameUnknowns u;
  const bool is_point = row_of(robot.platform.motion).is_point();
  u.cables = robot.cable_count();
  u.axis_count = row_of(robot.platform.motion).is_planar() ? 2 : 3;
  const bool tracked = any_reading(poses, -1, Channel::position);
  const bool fixed = is_point && !tracked;  // by a convention
  u.axes = fixed || u.axis_count == 2 ? unknown_axes(robot) : Matrix3(Matrix3::Identity());
  u.size = u.axis_count * u.cables;
  const auto add = [&](int count) {
    const int begin = u.size;
    u.size += count;
    return begin;
  };
  const bool whole = any_reading(poses, -1, Channel::direct_length);
  if (whole && options.offset != LengthOffset::none) {
    u.direct_offset_count = options.offset == LengthOffset::common ? 1 : u.cables;
    u.direct_offsets = add(u.direct_offset_count);
  }
  for (int log = 0; log < logs; ++log) {
    const auto offsets = [&](Channel channel, int count) {
      return any_reading(poses, log, channel) ? add(count) : -1;
    };
    u.length_offsets.push_back(offsets(Channel::length, u.cables));
    u.swivel_offsets.push_back(offsets(Channel::swivel, u.cables));
    u.yaw_offset.push_back(offsets(Channel::yaw, 1));
  }
  u.offsets_end = u.size;
  if (tracked) u.scale = add(1);
  add_stiffness(poses, u);
  u.precision = Eigen::VectorXd::Zero(u.size);
  if (u.untold_tension >= 0) u.precision.segment(u.untold_tension, u.cables).setOnes();
  u.held.assign(static_cast<std::size_t>(u.size), false);
  const double size = robot_size_m(robot), grown = times_reference(Yardstick::frame, robot);
  const bool said = std::any_of(robot.cables.begin(), robot.cables.end(), [](const Cable& cable) {
    return !cable.pulley.position_sigma_m.hasNaN();
  });
  for (int i = 0; i < u.cables; ++i) {
    const Vector3& sigma = robot.cables[static_cast<std::size_t>(i)].pulley.position_sigma_m;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      double own = sigma.cwiseProduct(u.axes.col(axis)).norm();
      if (sigma.hasNaN()) own = grown * (said ? kTape_m : kDecimetre_m);
      const bool unknown = own >= kUnknown * size || (is_point && !said);
      u.precision[u.anchor(i, axis)] = unknown && is_point ? 0.0 : 1.0 / (own * own);
    }
  }
  if (!fixed || fixes_place(u, robot)) return u;
  for (int i = 0; i < u.axis_count; ++i) {
    for (int axis = i; axis < u.axis_count; ++axis) {
      u.held[static_cast<std::size_t>(u.anchor(i, axis))] = true;
    }
  }
  return u;
}

ChannelSigma specified_sigma(const SensorSigma& sigma) {
  ChannelSigma out;
  out.fill(1.0);
  for (const ChannelRow& row : kChannelTable) {
    if (row.of().sigma) out[static_cast<std::size_t>(channel_of(row))] = sigma.*row.of().sigma;
  }
  return out;
}

}  // namespace cdprcal::detail
