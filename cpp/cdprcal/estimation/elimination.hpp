// The poses leave the normal equations (Schur complement), eight at a time.
#pragma once

#include <vector>

#include "cdprcal/estimation/run_rows.hpp"

namespace cdprcal {

/// Unknowns that nothing measures: the diagonal of JᵀJ counts at least so much in the damping.
inline constexpr double kLeastDiagonal = 1e-6;
/// Just enough damping for a factor of poses with directions that no reading sees; what those say
/// of the common unknowns is zero, and stays so.
inline constexpr double kBarely = 1e-14;

/// What the eliminated poses of a run say about what they have in common: its offsets, then the
/// values of effects. With H, C and g a pose's blocks of JᵀJ, JᵀJ_c and Jᵀr, and D the diagonal of
/// H:
struct EliminatedSums {
  Eigen::MatrixXd information;   ///< Σ J_cᵀJ_c − Cᵀ (H + λD)⁻¹ C
  Eigen::VectorXd gradient;      ///< Σ J_cᵀr − Cᵀ (H + λD)⁻¹ g
  Eigen::VectorXd raw_gradient;  ///< Σ J_cᵀr
  Eigen::VectorXd raw_diagonal;  ///< Σ of squares of J_c's columns
  double cost = 0.0;             ///< ½ Σ r²
  double decrease = 0.0;         ///< ½ Σ gᵀ (H + λD)⁻¹ g
  double largest_gradient = 0.0;
};

/// What moving the common unknowns moves in the poses.
struct PoseSteps {
  double squared_norm = 0.0;  ///< Σ ‖δ‖²
  double damping = 0.0;       ///< Σ δᵀDδ
};

/// Adds up a run's batches of rows one after another; keeps their factors for the way back. The
/// arithmetic is that of a Cholesky factor a pose, done for eight poses side by side: the widest
/// vectors that the processor has do it (AVX-512, AVX2, or what every x86-64 has), so the last bits
/// of results may differ between kinds of processors, never between runs on one.
class PoseElimination {
 public:
  /// Keeps factors when `steps_wanted`: (33 + 6 · unknowns) numbers a pose. `across`: the projector
  /// on what guides prevent, of which rows say nothing; no pose steps there.
  PoseElimination(std::size_t poses, int offsets, int columns, bool steps_wanted,
                  const Matrix6& across = Matrix6::Zero());

  /// Starts anew with the damping λ > 0 of H + λD. These slots count, offsets first; to outlive the
  /// sums.
  void begin(double damping, const std::vector<int>& slots);
  /// The next eight poses, as RunRows has them: rows, by_offset, by_effect. Lanes without a pose
  /// have rows of zeros.
  void add(const double* rows, const double* by_offset, const double* by_effect);
  /// The sums over all poses added. Not finite when a pose has no positive definite H + λD.
  const EliminatedSums& finish();

  /// Steps of all poses for a step of the common unknowns.
  PoseSteps back_substitute(const Eigen::VectorXd& common_step);
  /// Those of a batch, world-frame twists: [6][lane].
  [[nodiscard]] const double* steps(std::size_t batch) const;

  /// ½ Σ log|H + λD| over the first `poses` poses, without the directions that nothing measures;
  /// for factors that were kept.
  [[nodiscard]] double half_log_determinant(std::size_t poses) const;

  /// Of the rows of the batch added last, [slot][2][lane]: what is left of the residual when its
  /// pose moves freely, and 1 − the row's leverage, where `covariance` is that of the common
  /// unknowns. Slots that do not count stay as they are.
  void left_over(const double* rows, const double* by_offset, const double* by_effect,
                 const Eigen::MatrixXd& covariance, double* out) const;

 private:
  int offsets_, columns_, unknowns_;
  bool steps_wanted_;
  std::size_t factor_size_;  ///< numbers a batch
  Matrix6 across_;
  std::vector<double> stiffness_;  ///< across_, packed; empty where nothing is guided
  double damping_ = 0.0;
  std::size_t batches_ = 0;
  const std::vector<int>* slots_ = nullptr;
  int present_offsets_ = 0;  ///< so many of the slots are those of offsets
  lanes::Buffer sums_;       ///< and behind them factors_
  double* factors_;          ///< one batch after another; the steps end in them
  EliminatedSums out_;
};

}  // namespace cdprcal
