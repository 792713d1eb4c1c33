// Levenberg–Marquardt for least squares whose unknowns fall into many small blocks that meet only
// in a few common ones. It knows nothing of robots.
#pragma once

#include <Eigen/Core>
#include <limits>

namespace cdprcal {

/// When to stop; SolveOptions says what each means.
struct MinimiserOptions {
  int max_iterations = 200;                         ///< steps tried
  int max_steps = std::numeric_limits<int>::max();  ///< steps taken
  double function_tolerance = 1e-12;
  double parameter_tolerance = 1e-12;
  double gradient_tolerance = 1e-12;
  double function_floor = 0.0;  ///< added to the cost that the change is relative to
  double first_damping = 1e-4;  ///< small: the first step is Gauss and Newton's
  /// A step that promised no more than this and did not keep it ends the search: at a minimum, but
  /// for what the derivatives leave out.
  double least_promise = 0.0;
};

struct MinimiserSummary {
  bool usable = false;  ///< false: no valid state was met
  bool converged = false;
  int evaluations = 0;  ///< of everything with derivatives, the first included
  double cost = std::numeric_limits<double>::quiet_NaN();  ///< where it ended
};

/// A state's normal equations when its blocks are eliminated.
struct CommonSystem {
  Eigen::MatrixXd information;  ///< of the common unknowns
  Eigen::VectorXd gradient;     ///< reduced
  Eigen::VectorXd diagonal;     ///< of JᵀJ, for the damping
  double cost = 0.0;
  double decrease = 0.0;          ///< that the blocks' own steps promise
  double largest_gradient = 0.0;  ///< of any unknown, before the elimination

  /// All zero, for so many unknowns.
  void clear(Eigen::Index unknowns);
};

/// What a trial step moves.
struct TrialStep {
  double squared_norm = 0.0;  ///< of the blocks' steps
  double damping = 0.0;       ///< Σ δᵀDδ of them
  double state_squared_norm = 0.0;
};

/// What is minimised: it holds a state, and another on trial.
class ArrowheadProblem {
 public:
  ArrowheadProblem() = default;
  ArrowheadProblem(const ArrowheadProblem&) = delete;
  ArrowheadProblem& operator=(const ArrowheadProblem&) = delete;
  virtual ~ArrowheadProblem() = default;
  /// Evaluates the state, or that on trial, and eliminates its blocks with the damping λ of λD.
  /// False where it cannot be evaluated.
  virtual bool linearise(bool on_trial, double damping, CommonSystem& out) = 0;
  /// Puts the state, moved by this step of the common unknowns and its blocks by theirs, on trial.
  virtual TrialStep try_step(const Eigen::VectorXd& common_step) = 0;
  /// What is on trial becomes the state.
  virtual void accept() = 0;
};

/// Minimises ½ Σ r² from the problem's state, and leaves the minimum there.
///
/// Damping and its control are those of Nielsen (1999), "Damping parameter in Marquardt's method",
/// as in Ceres, scaled by the diagonal of JᵀJ. One sweep over the blocks evaluates and eliminates:
/// it takes the step to be accepted as nearly all are, and is repeated when it was not.
MinimiserSummary minimise(ArrowheadProblem& problem, const MinimiserOptions& options);

}  // namespace cdprcal
