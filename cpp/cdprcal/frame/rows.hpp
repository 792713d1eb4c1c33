// Private to frame/: what is unknown, and what the readings at one pose say about it.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "cdprcal/frame/frame.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal::detail {

/// What cables may each have of their own though a frame takes it to be one for all: an offset of
/// whole lengths, readings a metre, the square of the distance from the plane.
enum class Own { offset, scale, square };
inline constexpr std::size_t kOwn = 3;

/// The common unknowns: which there are, and where they stand among `size` values. −1: not there.
struct FrameUnknowns {
  int cables = 0;
  Matrix3 axes = Matrix3::Identity();  ///< columns: along which pulleys move
  int axis_count = 3;                  ///< 2 in a plane
  int direct_offsets = -1;             ///< of whole lengths
  int direct_offset_count = 0;         ///< 0, 1 or n
  std::vector<int> length_offsets, swivel_offsets, yaw_offset;  ///< of each log
  int offsets_end = 0;                                          ///< all of the above are before it
  int scale = -1, compliance = -1, off_plane = -1;
  /// n − 1 numbers each, along the columns of `contrasts`: the mean is a common unknown's.
  std::array<int, kOwn> own{-1, -1, -1};
  Eigen::MatrixXd contrasts;  ///< [n, n − 1], orthonormal, each column's sum 0
  /// Of each cable, by how many spreads the tensions that were not read are off the mean of all
  /// that were; there where lengths are read without tensions though others tell a stiffness.
  int untold_tension = -1;
  double mean_tension_N = 0.0, tension_spread_N = 0.0;  ///< of all tensions that were read
  int size = 0;
  Eigen::VectorXd precision;                 ///< 1/σ² of the prior about zero
  std::vector<bool> held;                    ///< values that a convention fixes at zero
  std::vector<int> reference;                ///< reference_pulleys
  Vector3 mirror_normal = Vector3::UnitZ();  ///< of the plane that frames are mirrored in

  [[nodiscard]] int anchor(int cable, int axis) const { return axis_count * cable + axis; }
  /// Whether a convention fixes some of the frame's place.
  [[nodiscard]] bool by_convention() const {
    return std::find(held.begin(), held.end(), true) != held.end();
  }
  [[nodiscard]] Vector3 shift(const Eigen::VectorXd& values, int cable) const;
  [[nodiscard]] int own_column(Own what) const { return own[static_cast<std::size_t>(what)]; }
  /// By how much a cable differs from the mean of all.
  [[nodiscard]] double own_value(const Eigen::VectorXd& values, Own what, int cable) const {
    const int at = own_column(what);
    return at < 0 ? 0.0 : contrasts.row(cable).dot(values.segment(at, cables - 1));
  }
};

/// One pose's readings and the log they are of.
struct FramePose {
  Measurement reading;
  int log = 0, sample = 0;
};

/// Noise of each channel.
using ChannelSigma = std::array<double, kChannels>;

/// Whitened residuals (model − reading)/σ of one pose, and their derivatives.
struct FrameRows {
  bool valid = false;
  std::vector<Channel> channel;  ///< of each row
  std::vector<int> component;    ///< cable or axis
  std::vector<double> sigma;     ///< of the reading, in its unit
  Eigen::VectorXd residual;
  Eigen::MatrixXd by_pose;    ///< along motion_basis
  Eigen::MatrixXd by_common;  ///< by the unknowns
};

struct FrameProblem {
  Robot robot;        ///< as its file has it
  CableVector ratio;  ///< by which its winches are known to read too much [1]; empty: by nothing
  FrameUnknowns unknowns;
  std::vector<FramePose> poses;
  ChannelSigma sigma{};
  double untold_stretch = 0.0;  ///< σ of the stretch of a cable whose tension was not read [1]
  TwistBasis basis;             ///< motion_basis
};

/// The robot with its pulleys moved.
Robot moved(const FrameProblem& problem, const Eigen::VectorXd& values);

/// The rows of one pose for `robot` = moved(problem, values); derivatives where `with_jacobian`.
FrameRows frame_rows(const FrameProblem& problem, const Robot& robot, const Eigen::VectorXd& values,
                     const FramePose& at, const Pose& pose, bool with_jacobian);

}  // namespace cdprcal::detail
