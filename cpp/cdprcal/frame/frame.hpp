// A frame that nobody measured: where its pulleys are, and what whole lengths are wrong by, from
// many poses that nobody knows either.
//
// Not a DiagnosisModel: there poses hang in a balance of forces and effects are small beside what
// the robot file says. Here nothing may be known but the lengths themselves, the frame's place in
// the world is a convention, and what is found is the frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"
#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// What whole lengths may be wrong by: nothing, one number for all cables (an arm or a belt's end
/// that nobody counted), or one a cable.
enum class LengthOffset { none, common, each };
LengthOffset parse_length_offset(const std::string& name);
const char* to_string(LengthOffset offset);

/// Whether readings a metre are one number for all cables, or one a cable (belts that were
/// stretched, drums of other diameters).
enum class LengthScale { common, each };
LengthScale parse_length_scale(const std::string& name);

/// Which samples of a log are poses. automatic: the rests of a log that is sampled more often than
/// twice a second, else every sample.
enum class FramePoses { automatic, samples, rests };
FramePoses parse_frame_poses(const std::string& name);

struct FrameOptions {
  /// Of whole lengths. With common, σ allows for one a cable as far as the lengths do.
  LengthOffset offset = LengthOffset::common;
  LengthScale scale = LengthScale::common;  ///< and so here
  FramePoses poses = FramePoses::automatic;
  bool leave_out = true;  ///< poses that do not belong, named in `left_out`
  /// Whether belts may run outside the plane of a planar robot, at a common distance that the file
  /// does not have, where the readings say so.
  bool off_plane = true;
  int max_iterations = 200;
};

enum class FrameStatus { converged, not_converged, unobservable };
const char* to_string(FrameStatus status);

/// A pose that was left out.
struct LeftOutPose {
  int log = 0, sample = 0;  ///< from 0; the first sample of a rest
  int cable = -1;           ///< the one whose reading does not fit the others; −1: no single one
  double error_m = kNaN;    ///< by which that reading is off
};

/// One number and its standard deviation.
struct Estimate {
  double value = kNaN;
  double sigma = kNaN;
};

struct FrameResult {
  FrameStatus status = FrameStatus::not_converged;
  std::string reason;  ///< one sentence for people
  /// With these pulleys, their σ and what lengths are wrong by: whole ones by whole_length_offset,
  /// whole_length_scale and whole_length_stretch, changes by transmission_ratio and
  /// cable_elasticity.
  Robot corrected;
  std::vector<Vector3> anchors_m, anchors_sigma_m;  ///< D of each pulley, in `gauge`
  Eigen::MatrixXd covariance;                       ///< of all anchors [3n, 3n]
  std::string gauge;                                ///< what fixes the frame in the world, in words
  std::vector<Estimate> offset_m;   ///< of whole lengths, reading − length: none, 1 or n
  std::optional<Estimate> scale;    ///< readings a metre − 1, where a tracker shows it
  std::vector<Estimate> own_scale;  ///< of each cable beside the mean of all: none, or n
  /// EA of all cables, where tensions are read; NaN where they do not tell it from none.
  std::optional<Estimate> stiffness_N;
  std::optional<Estimate> off_plane_m;  ///< where belts run outside the plane
  std::optional<Estimate> weight_N;     ///< of the platform, from the tensions
  double rms_m = kNaN;                  ///< of the lengths' residuals
  double held_out_rms_m = kNaN;         ///< of poses that the frame was not fitted to
  double noise_m = kNaN;                ///< of one length, from the residuals
  /// σ are this much larger than those of independent readings, since residuals of neighbouring
  /// poses hang together; 1: they do not.
  double lack_of_fit = 1.0;
  std::vector<std::string> not_determined;  ///< in words
  std::vector<std::string> next;            ///< which poses or measures would determine it
  std::vector<LeftOutPose> left_out;
  std::vector<Pose> poses;  ///< of the measurements that were kept
  std::vector<Measurement> measurements;
  std::vector<Eigen::VectorXd> residual_m;  ///< of whole or else relative lengths, at each
  int iterations = 0;
  double solve_time_s = 0.0;
};

/// Pulley positions, offsets and scale from the poses of one or more logs of one robot. Pulleys
/// start from the robot file's positions, or, of platforms that cannot turn, from the lengths alone
/// (start.hpp). `position_sigma_m` weighs the file's positions; a pulley without it is known to
/// 2 mm where others have it, and otherwise none is known. Never throws on numerical failure: see
/// status. Throws InputError for logs that do not fit the robot or hold no lengths.
FrameResult find_frame(const Robot& robot, const std::vector<Log>& logs,
                       const FrameOptions& options = {});

}  // namespace cdprcal
