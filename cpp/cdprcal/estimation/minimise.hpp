// The least-squares minimiser of the calibration: Levenberg-Marquardt on its arrowhead structure.
#pragma once

#include "cdprcal/estimation/elimination.hpp"
#include "cdprcal/estimation/problem.hpp"
#include "cdprcal/estimation/row_lanes.hpp"

namespace cdprcal {

class Assembly;

/// When to stop; SolveOptions says what each means.
struct MinimiserOptions {
  int max_iterations = 200;
  double function_tolerance = 1e-12;
  double parameter_tolerance = 1e-12;
  double gradient_tolerance = 1e-12;
  bool hold_initial_pose = false;  ///< ζ0 stays where it is
};

struct MinimiserSummary {
  bool usable = false;  ///< false: no valid state was met
  bool converged = false;
  int evaluations = 0;  ///< of all poses with derivatives, the first included
  double cost = kNaN;   ///< where it ended
};

/// Minimises ½ Σ (F/σ)² (eq. 14) over all poses and the free reference errors, from the state an
/// assembly holds, and leaves the minimum there.
///
/// Every pose meets the rest only through the 2n + 1 offsets o = m(ζ0) + e, so a step costs one
/// evaluation of each pose, its 6×6 Cholesky factor (elimination.hpp), and one system of ζ0 and e.
/// Damping and its control are those of Nielsen (1999), "Damping parameter in Marquardt's method",
/// as in Ceres, scaled by the diagonal of JᵀJ. One sweep over the poses evaluates and eliminates:
/// it takes the step to be accepted as nearly all are, and is repeated when it was not.
class Minimiser {
 public:
  explicit Minimiser(Assembly& assembly);
  MinimiserSummary minimise(const MinimiserOptions& options);

 private:
  using CommonVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostCommon, 1>;

  /// ζ0 and the other poses.
  struct State {
    Pose initial;
    PoseLanes others;
  };

  /// Evaluates everything at a state and eliminates its poses. False when a pose is invalid there.
  bool sweep(const State& state, double damping);
  /// Adds the poses but ζ0 to the elimination. False when one is invalid.
  bool eliminate(const PoseLanes& poses, double damping);
  /// Whether the last sweep's common system has a step; it is in step_ then.
  bool solve_common(double damping);
  /// candidate_: current_ moved by the step.
  void move();

  Assembly& assembly_;
  State current_, candidate_;
  PoseElimination elimination_;
  RowLanes* row_lanes_;  ///< where they serve
  RowSlots slots_;       ///< of them
  PoseEvaluation initial_, evaluation_;
  PoseRows rows_;
  std::vector<int> free_;  ///< unknowns that are: ζ0's, then 6 + index of the error
  bool hold_initial_pose_ = false;

  // Of the last sweep.
  double cost_ = kNaN;
  double largest_gradient_ = 0.0;
  double pose_decrease_ = 0.0;
  OffsetJacobian by_initial_;
  CommonMatrix information_;  ///< of ζ0, and of the errors where any is free
  CommonVector gradient_;     ///< reduced: of the common system
  CommonVector diagonal_;     ///< of JᵀJ, for the damping
  CommonVector step_;
  double decrease_ = 0.0;   ///< that the linear model promises
  double step_norm_ = 0.0;  ///< of all unknowns
  double state_norm_ = 0.0;
};

}  // namespace cdprcal
