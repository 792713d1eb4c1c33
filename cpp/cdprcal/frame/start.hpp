// Private to frame/: where to begin.
#pragma once

#include <optional>

#include "cdprcal/frame/minimise.hpp"

namespace cdprcal::detail {

/// Pulleys and places of a point from whole lengths alone, without any guess; poses whose lengths
/// are not all there are left out (NaN).
struct ClosedForm {
  Eigen::MatrixXd anchors;  ///< d × n
  Eigen::MatrixXd points;   ///< d × poses
};

/// The squared lengths S_ij = |p_i − a_j|², centred over poses and over pulleys, are −2 p_i·a_j: a
/// matrix of rank d, whose factors are points and pulleys up to an affine map. What that map is
/// follows, linearly, from the means over pulleys: they are quadratic in p_i (Pollefeys, Crocco).
/// `lengths`: poses × n [m]. nullopt: too few poses, or readings that no such map explains.
std::optional<ClosedForm> closed_form(const Eigen::MatrixXd& lengths, int dimensions);

/// Whether poses follow from the lengths alone, and not from what the file says of the pulleys.
bool is_closed_form(const FrameProblem& problem);
/// States to begin with, from the robot file's pulleys (of bodies with all readings, and with
/// lengths, roll and pitch alone where cables pull) and, of points, from the lengths alone at
/// several offsets, turned and mirrored to agree best with the file's pulleys.
std::vector<FrameState> starts(const FrameProblem& problem);
/// Pulleys drawn from what the robot file says of them, poses as they want them.
FrameState drawn_start(const FrameProblem& problem, std::uint64_t draw);
/// Offsets as the poses have them: means of reading − model.
void settle_offsets(const FrameProblem& problem, FrameState& state);
/// Poses of a platform that turns, or of a point whose whole lengths nobody read, may sit in minima
/// of their own that are not the best (above the pulleys, for one): each is tried again from
/// elsewhere with the pulleys as they are now. Says whether any is better so.
bool improve_poses(const FrameProblem& problem, FrameState& state);
/// Such poses bend the frame until they fit: it is solved without those that fit worst, and with
/// all of them, tried anew, from there. Says whether that is better.
bool improve_frame(const FrameProblem& problem, FrameState& state, int max_iterations);
/// The file's pulleys, and poses that are known roughly; offsets follow from both.
std::vector<FrameState> starts_at(const FrameProblem& problem, const std::vector<Pose>& poses);

}  // namespace cdprcal::detail
