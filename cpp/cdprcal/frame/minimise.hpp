// Private to frame/: poses eliminated one by one, steps until the cost settles.
#pragma once

#include "cdprcal/frame/rows.hpp"

namespace cdprcal::detail {

/// Where everything stands.
struct FrameState {
  Eigen::VectorXd values;  ///< of the common unknowns
  std::vector<Pose> poses;
  double cost = kNaN;  ///< ½ Σ (residual/σ)² + prior
  bool settled = false;
  int iterations = 0;
  bool hangs = false;  ///< whether poses at which cables would have to push are passed over
};

/// ½ Σ (residual/σ)² + prior; NaN where a pose cannot be evaluated.
double frame_cost(const FrameProblem& problem, const FrameState& state);

/// Levenberg and Marquardt from `state`, common unknowns and poses at once.
void minimise(const FrameProblem& problem, FrameState& state, int max_iterations);

/// What the poses leave of the information about the common unknowns, at a state.
struct FrameInformation {
  bool valid = false;
  Eigen::MatrixXd normal;   ///< Σ Bᵀ M B: of the readings alone, poses free; no prior
  Eigen::MatrixXd scores;   ///< column for each pose: Bᵀ M r
  Eigen::VectorXd misfit;   ///< rᵀ M r of each pose
  Eigen::VectorXi freedom;  ///< rows − rank of its pose
  std::vector<FrameRows> rows;
};
FrameInformation information(const FrameProblem& problem, const FrameState& state);

/// One pose to its own readings, the common unknowns held; its cost, NaN where it cannot be.
double settle_pose(const FrameProblem& problem, const Robot& robot, const Eigen::VectorXd& values,
                   const FramePose& from, Pose& pose, int max_iterations = 40);

}  // namespace cdprcal::detail
