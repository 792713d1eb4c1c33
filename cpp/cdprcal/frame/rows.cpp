#include "cdprcal/frame/rows.hpp"

#include "cdprcal/effects/effect.hpp"

namespace cdprcal::detail {
namespace {

/// Appends rows of one pose.
class RowWriter {
 public:
  RowWriter(const FrameProblem& problem, Eigen::Index most, bool with_jacobian, FrameRows& out)
      : problem_(problem), with_jacobian_(with_jacobian), out_(out) {
    out.residual.resize(most);
    if (!with_jacobian) return;
    out.by_pose.resize(most, problem.basis.cols());
    out.by_common = Eigen::MatrixXd::Zero(most, problem.unknowns.size);
  }

  /// Begins a row of this residual, whose error has a part besides the channel's noise; false when
  /// there is no reading.
  bool add(Channel channel, int component, double residual, double more_sigma = 0.0) {
    if (!std::isfinite(residual)) return false;
    const double sigma = std::hypot(problem_.sigma[static_cast<std::size_t>(channel)], more_sigma);
    weight_ = 1.0 / sigma;
    out_.channel.push_back(channel);
    out_.component.push_back(component);
    out_.sigma.push_back(sigma);
    out_.residual[++row_] = weight_ * residual;
    return with_jacobian_;
  }
  /// Derivatives of the row that was begun.
  void by_twist(const Eigen::Matrix<double, 1, 6>& row, double factor = 1.0) {
    out_.by_pose.row(row_) = weight_ * factor * row * problem_.basis;
  }
  void by_anchor(int cable, const Vector3& gradient, double factor = 1.0) {
    const FrameUnknowns& u = problem_.unknowns;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      by(u.anchor(cable, axis), factor * gradient.dot(u.axes.col(axis)));
    }
  }
  void by(int column, double derivative) {
    if (column >= 0) out_.by_common(row_, column) += weight_ * derivative;
  }

  void by_own(Own what, int cable, double derivative) {
    const FrameUnknowns& u = problem_.unknowns;
    const int at = u.own_column(what);
    if (at < 0) return;
    out_.by_common.row(row_).segment(at, u.cables - 1) +=
        weight_ * derivative * u.contrasts.row(cable);
  }

  void finish() {
    const Eigen::Index rows = row_ + 1;
    out_.residual.conservativeResize(rows);
    if (!with_jacobian_) return;
    out_.by_pose.conservativeResize(rows, Eigen::NoChange);
    out_.by_common.conservativeResize(rows, Eigen::NoChange);
  }

 private:
  const FrameProblem& problem_;
  bool with_jacobian_;
  FrameRows& out_;
  double weight_ = 1.0;
  Eigen::Index row_ = -1;
};

double at(const Eigen::VectorXd& values, int column) { return column < 0 ? 0.0 : values[column]; }

/// Lengths of one kind, which differ in their offsets alone.
void add_lengths(const FrameProblem& problem, const Eigen::VectorXd& values,
                 const Measurement& reading, const CableVector& read, Channel channel,
                 int first_offset, bool one_offset, const PoseEvaluation& model,
                 const PlatformState& state, RowWriter& rows) {
  const FrameUnknowns& u = problem.unknowns;
  const bool whole = channel == Channel::direct_length;
  const bool tensions = reading.tension_N.size() == u.cables && u.compliance >= 0;
  for (int i = 0; i < read.size(); ++i) {
    const int offset = first_offset < 0 ? -1 : first_offset + (one_offset ? 0 : i);
    const double flat = model.length_m[i];
    const double square =
        flat * flat + at(values, u.off_plane) + u.own_value(values, Own::square, i);
    const double length = std::sqrt(std::max(square, 1e-12));
    const bool told = tensions && std::isfinite(reading.tension_N[i]);
    const int untold = told || u.untold_tension < 0 ? -1 : u.untold_tension + i;
    const double tension =
        told ? reading.tension_N[i] : u.mean_tension_N + u.tension_spread_N * at(values, untold);
    const double known = whole || problem.ratio.size() == 0 ? 0.0 : problem.ratio[i];
    const double gain = 1.0 + known + at(values, u.scale) + u.own_value(values, Own::scale, i) -
                        at(values, u.compliance) * tension;
    const double added = at(values, offset) + (whole ? u.own_value(values, Own::offset, i) : 0.0);
    if (!rows.add(channel, i, gain * length + added - read[i],
                  told ? 0.0 : problem.untold_stretch * length)) {
      continue;
    }
    const double slope = gain * flat / length;
    rows.by_twist(model.length_by_twist.row(i), slope);
    rows.by_anchor(i, state.cable[static_cast<std::size_t>(i)].direction, -slope);  // q = a − d
    rows.by(offset, 1.0);
    rows.by(u.scale, length);
    rows.by(u.compliance, -tension * length);
    rows.by(untold, -at(values, u.compliance) * u.tension_spread_N * length);
    rows.by(u.off_plane, 0.5 * gain / length);
    if (whole) rows.by_own(Own::offset, i, 1.0);
    rows.by_own(Own::scale, i, length);
    rows.by_own(Own::square, i, 0.5 * gain / length);
  }
}

}  // namespace

Vector3 FrameUnknowns::shift(const Eigen::VectorXd& values, int cable) const {
  Vector3 sum = Vector3::Zero();
  for (int axis = 0; axis < axis_count; ++axis) {
    sum += values[anchor(cable, axis)] * axes.col(axis);
  }
  return sum;
}

Robot moved(const FrameProblem& problem, const Eigen::VectorXd& values) {
  Robot robot = problem.robot;
  for (int i = 0; i < robot.cable_count(); ++i) {
    robot.cables[static_cast<std::size_t>(i)].pulley.position_m +=
        problem.unknowns.shift(values, i);
  }
  return robot;
}

FrameRows frame_rows(const FrameProblem& problem, const Robot& robot, const Eigen::VectorXd& values,
                     const FramePose& from, const Pose& pose, bool with_jacobian) {
  const FrameUnknowns& u = problem.unknowns;
  const auto log = static_cast<std::size_t>(from.log);
  FrameRows out;
  PoseEvaluation model;
  const PlatformState state = platform_state(robot, pose);
  evaluate_geometry(robot, state, pose, with_jacobian, model);
  if (!model.valid) return out;
  RowWriter rows(problem, 3 * u.cables + 7, with_jacobian, out);
  const Measurement& m = from.reading;
  add_lengths(problem, values, m, m.direct_length_m, Channel::direct_length, u.direct_offsets,
              u.direct_offset_count == 1, model, state, rows);
  add_lengths(problem, values, m, m.length_m, Channel::length, u.length_offsets[log], false, model,
              state, rows);
  for (int i = 0; i < m.swivel_rad.size(); ++i) {
    const int offset = u.swivel_offsets[log] < 0 ? -1 : u.swivel_offsets[log] + i;
    const double residual = wrap_angle(model.swivel_rad[i] + at(values, offset) - m.swivel_rad[i]);
    if (!rows.add(Channel::swivel, i, residual)) continue;
    rows.by_twist(model.swivel_by_twist.row(i));
    rows.by_anchor(i, swivel_by_q(state.cable[static_cast<std::size_t>(i)]), -1.0);
    rows.by(offset, 1.0);
  }
  for (int i = 0; i < 3; ++i) {
    const int offset = i == 2 ? u.yaw_offset[log] : -1;
    const double residual =
        wrap_angle(model.roll_pitch_yaw_rad[i] + at(values, offset) - m.roll_pitch_yaw_rad[i]);
    if (!rows.add(i == 2 ? Channel::yaw : Channel::roll_pitch, i, residual)) continue;
    rows.by_twist(model.attitude_by_twist.row(i));
    rows.by(offset, 1.0);
  }
  if (rows.add(Channel::absolute_yaw, 0, wrap_angle(model.absolute_yaw_rad - m.absolute_yaw_rad))) {
    rows.by_twist(model.absolute_by_twist.absolute_yaw_rad);
  }
  for (int i = 0; i < 3; ++i) {
    if (!rows.add(Channel::position, i, model.position_m[i] - m.position_m[i])) continue;
    rows.by_twist(model.absolute_by_twist.position_m.row(i));
  }
  rows.finish();
  out.valid = true;
  return out;
}

}  // namespace cdprcal::detail
