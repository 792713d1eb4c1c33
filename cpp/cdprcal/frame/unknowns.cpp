#include "cdprcal/frame/unknowns.hpp"

#include <algorithm>

#include "cdprcal/frame/each_its_own.hpp"
#include "cdprcal/frame/gauge.hpp"
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
  if (options.scale == LengthScale::each && u.cables > 1) add_own(robot, Own::scale, u);
  const double size = robot_size_m(robot), grown = times_reference(Yardstick::frame, robot);
  const bool said = std::any_of(robot.cables.begin(), robot.cables.end(), [](const Cable& cable) {
    return !cable.pulley.position_sigma_m.hasNaN();
  });
  const auto sigma_of = [&](int cable) -> Vector3 {
    const Vector3& told = robot.cables[static_cast<std::size_t>(cable)].pulley.position_sigma_m;
    return told.hasNaN() ? Vector3::Constant(grown * (said ? kTape_m : kDecimetre_m)) : told;
  };
  std::vector<bool> known;
  for (int i = 0; i < u.cables; ++i) {
    known.push_back(said && sigma_of(i).maxCoeff() < kUnknown * size);
  }
  u.reference = reference_pulleys(robot, known);
  const Matrix3 by_pulleys = reference_axes(robot, u.reference);
  u.mirror_normal = by_pulleys.col(u.axis_count - 1);
  const auto look_along = [&](const Matrix3& axes) {
    u.axes = axes;
    for (int i = 0; i < u.cables; ++i) {
      for (int axis = 0; axis < u.axis_count; ++axis) {
        const double own = sigma_of(i).cwiseProduct(axes.col(axis)).norm();
        const bool unknown = own >= kUnknown * size || (is_point && !said);
        u.precision[u.anchor(i, axis)] = unknown && is_point ? 0.0 : 1.0 / (own * own);
      }
    }
  };
  // The file's σ are along the axes of the world.
  look_along(u.axis_count == 2 ? by_pulleys : Matrix3(Matrix3::Identity()));
  if (!is_point || tracked || fixes_place(u, robot)) return u;
  look_along(by_pulleys);
  hold_place(robot, u);
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
