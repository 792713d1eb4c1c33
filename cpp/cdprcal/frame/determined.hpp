// Private to frame/: what the readings tell about the frame, how well, and what they do not.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/frame/mirror.hpp"

namespace cdprcal::detail {

/// Covariance of all common unknowns, and where it comes from.
struct Knowledge {
  bool valid = false;
  Eigen::MatrixXd covariance;  ///< held values: 0; rigid motions that nothing shows: left out
  Eigen::MatrixXd precision;   ///< readings and prior, before lack_of_fit
  Eigen::MatrixXd whole;       ///< the covariance with these motions, before lack_of_fit
  double lack_of_fit = 1.0;    ///< by which σ are larger than those of independent readings
  double parameters = 0.0;     ///< how many numbers the readings determine, the prior aside
  int free_motions = 0;        ///< rigid motions of the frame that only the file's positions fix
  /// By values of the anchors: how far the frame is moved by them, shifts and turns (m, rad).
  Eigen::MatrixXd unshown;
  Eigen::MatrixXd without_motions;  ///< takes them out of a step of all values
};

/// At a settled state. Neighbouring poses whose residuals hang together count for less: the scores
/// of blocks of poses scatter more than their rows do (a sandwich, as one factor).
Knowledge knowledge(const FrameProblem& problem, const FrameState& state,
                    const FrameInformation& information);

/// Puts the frame, and the poses with it, where it agrees best with the file's positions in the
/// motions that only these fix: readings that show a little of them do not move it.
void hold_unshown(const FrameProblem& problem, const Knowledge& known, FrameState& state);

/// The directions of anchors and offsets that are known to less than `enough_m`, in words, worst
/// first.
std::vector<std::string> weak_directions(const FrameProblem& problem, const Knowledge& known,
                                         double enough_m);

/// Where further poses would tell most about the least known direction, in words.
std::vector<std::string> further_poses(const FrameProblem& problem, const FrameState& state,
                                       const Knowledge& known);

/// Poses one after the other between which some cables read the same and others do not: pulled
/// tighter, in words. `tensions`: whether tensions were read.
std::vector<std::string> stretched_repeats(const FrameProblem& problem);

/// What fixes the frame in the world, in words.
std::string gauge_in_words(const FrameProblem& problem, const Knowledge& known, MirrorTold told);

}  // namespace cdprcal::detail
