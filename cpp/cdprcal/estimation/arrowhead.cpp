#include "cdprcal/estimation/arrowhead.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace cdprcal {
namespace {

constexpr double kLeastDamping = 1e-14, kMostDamping = 1e32;
constexpr double kStrongDamping = 1.0;
constexpr double kRefusedDamping =
    1e-3;                            // at least, after a step that went wrong: less changes nothing
constexpr double kLeastGain = 1e-3;  // of the promised decrease, for a step to be accepted

/// Nielsen's factor on the damping after a step that gained `ratio` of what was promised.
double after_success(double ratio) {
  const double excess = 2.0 * ratio - 1.0;
  return std::max(1.0 / 3.0, 1.0 - excess * excess * excess);
}

/// Steps of the common unknowns.
class CommonStep {
 public:
  /// False where the damped information is not positive definite.
  bool solve(const CommonSystem& system, double damping) {
    damped_ = system.information;
    damped_.diagonal() += damping * system.diagonal;
    step_ = -system.gradient;
    if (step_.size() == 0) return true;
    factor_.compute(damped_);
    if (factor_.info() != Eigen::Success) return false;
    factor_.solveInPlace(step_);
    return step_.allFinite();
  }
  [[nodiscard]] const Eigen::VectorXd& operator()() const { return step_; }

 private:
  Eigen::MatrixXd damped_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd step_;
};

}  // namespace

void CommonSystem::clear(Eigen::Index unknowns) {
  information.setZero(unknowns, unknowns);
  gradient.setZero(unknowns);
  diagonal.setZero(unknowns);
  cost = decrease = largest_gradient = 0.0;
}

MinimiserSummary minimise(ArrowheadProblem& problem, const MinimiserOptions& options) {
  MinimiserSummary out;
  double damping = options.first_damping, growth = 2.0;
  CommonSystem system;
  const auto evaluate = [&](bool on_trial) {
    ++out.evaluations;
    return problem.linearise(on_trial, damping, system) && std::isfinite(system.cost);
  };
  const auto reject = [&] {
    damping = std::max(kRefusedDamping, damping * growth);
    growth *= 2.0;
  };
  if (!evaluate(false)) return out;
  out.usable = true;
  double cost = system.cost;
  CommonStep step;
  bool fresh = true;  // the system is that of the state at this damping
  int taken = 0;
  for (int i = 0; i < options.max_iterations && taken < options.max_steps; ++i) {
    if (!fresh) evaluate(false);
    if (system.largest_gradient <= options.gradient_tolerance) {
      out.converged = true;
      break;
    }
    const bool solved = step.solve(system, damping) && std::isfinite(system.decrease);
    double promised = 0.0;
    if (solved) {
      const TrialStep trial = problem.try_step(step());
      promised = system.decrease - 0.5 * system.gradient.dot(step()) +
                 0.5 * damping * (trial.damping + step().cwiseAbs2().dot(system.diagonal));
      const double norm = std::sqrt(trial.squared_norm + step().squaredNorm());
      const double state_norm = std::sqrt(trial.state_squared_norm);
      if (norm <= options.parameter_tolerance * (state_norm + options.parameter_tolerance)) {
        out.converged = true;
        break;
      }
      if (!std::isfinite(norm)) promised = 0.0;
    }
    if (!(promised > 0.0)) {
      if (damping >= kMostDamping) break;
      reject();
      fresh = false;
      continue;
    }
    const double before = damping;
    damping = std::max(kLeastDamping, damping / 3.0);
    const bool valid = evaluate(true);
    const double gain = valid ? cost - system.cost : -std::numeric_limits<double>::infinity();
    // A small gain under strong damping says nothing.
    const bool settled =
        before <= kStrongDamping &&
        std::abs(gain) <= options.function_tolerance * (options.function_floor + cost);
    if (gain > 0.0 && (settled || gain > kLeastGain * promised)) {
      problem.accept();
      ++taken;
      cost = system.cost;
      growth = 2.0;
      const double wanted = before * after_success(std::min(gain / promised, 1.0));
      fresh = wanted <= 2.0 * damping;  // near enough to what the sweep supposed
      if (!fresh) damping = wanted;
    } else {
      damping = before;
      if (promised <= options.least_promise) {
        out.converged = true;
        break;
      }
      if (damping >= kMostDamping) break;
      reject();
      fresh = false;
    }
    if (settled) {
      out.converged = true;
      break;
    }
  }
  out.cost = cost;
  return out;
}

}  // namespace cdprcal
