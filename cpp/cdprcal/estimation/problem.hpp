// The initial-pose self-calibration problem (paper §3.1): what is free, how to solve, what came
// out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/estimation/pose_residual.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/readings/measurement.hpp"
#include "cdprcal/readings/noise.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {

/// What is modelled and what is free. measurements[0] is the reference: its pose is ζ0.
struct CalibrationProblem {
  Robot robot;
  std::vector<Measurement> measurements;
  StaticsModel statics = StaticsModel::wrench;
  ActiveEffects effects;                     ///< known effects, held at their values
  std::vector<WrenchRow> left_inverse_rows;  ///< empty: left_inverse_rows(n)
  std::optional<NoiseModel> noise;           ///< empty: what the robot file specifies
  /// What pose 0 knows by itself, which the paper leaves out: absolute roll and pitch, and (when it
  /// is a static pose) its balance; and the noise of its own readings, which every difference
  /// "relative to the reference" shares.
  bool reference_attitude = true;
  bool reference_statics = true;
  bool reference_noise = true;
};

/// Who minimises: our own (arrowhead.hpp), or Ceres on the same rows (minimise_ceres.hpp), which is
/// there to check the first against.
enum class MinimiserKind { arrowhead, ceres };

/// How to solve.
struct SolveOptions {
  MinimiserKind minimiser = MinimiserKind::arrowhead;
  /// Standard deviations of tensions and wrenches are multiplied by these in turn: forces
  /// change by kN per radian of attitude, so they start weak and tighten. The last must be 1.
  std::vector<double> graduation{100.0, 10.0, 1.0};
  int max_iterations = 1000;          ///< of each stage
  double function_tolerance = 1e-12;  ///< relative change of the cost
  double parameter_tolerance = 1e-12;
  double gradient_tolerance = 1e-12;
  /// The weights of the balance depend on the poses: solved again until ζ0 moves less [m, rad].
  double settled = 1e-9;
  /// Whether to say what least_observed says: which direction of the initial pose is least certain,
  /// and which readings see it. As much work as eight iterations of a small problem.
  bool explain = true;
};

/// For what goes on from there: no nearer than a relative change of the cost, and of ζ0 [m, rad].
SolveOptions loosened(SolveOptions options, double function_tolerance, double settled);

enum class CalibrationStatus { converged, not_converged, unobservable };

/// Standard deviations of a covariance, the roots of its diagonal; NaN without one.
inline Vector6 square_roots(const std::optional<Matrix6>& covariance) {
  return covariance ? Vector6(covariance->diagonal().cwiseSqrt()) : Vector6::Constant(kNaN);
}

/// What came out.
struct CalibrationResult {
  CalibrationStatus status = CalibrationStatus::not_converged;
  std::string reason;       ///< one sentence for people, always filled
  std::vector<Pose> poses;  ///< ζ0, ζ1 … in the order of the measurements
  std::vector<PoseResidual> residuals;
  std::optional<Matrix6> covariance;  ///< of ζ0: position [m], world-frame rotation vector [rad];
                                      ///< filled when ζ0 is observable
  [[nodiscard]] Vector6 standard_deviation() const { return square_roots(covariance); }
  bool lacks_something = false;  ///< the model does: an effect of the catalogue is more probable
                                 ///< than none, or poses misfit by more than sensors may
  bool covariance_holds = true;  ///< false: the model misfits, and the covariance leaves it out
  Eigen::VectorXd reference_errors;  ///< of the reference's lengths, swivels and yaw (2n + 1)
  std::string least_observed;        ///< the weakest direction of ζ0, in words (least_observed.hpp)
  CableVector initial_length_m;      ///< l(ζ0): what the relative length readings start from
  CableVector initial_swivel_rad;    ///< σ(ζ0)
  double cost = kNaN;                ///< ½ Σ (F/σ)², eq. 14
  int iterations = 0;
  double solve_time_s = 0.0;
  int residual_count = 0;
  int parameter_count = 0;
  double chi_square_p_value = kNaN;  ///< of 2·cost on residuals − parameters degrees of freedom
  ResidualRms residual_rms;
  bool curved = false;  ///< unobservable only because its covariance does not hold nearby
};

/// Solves from a guess (one pose a measurement). Never throws on numerical failure: see status.
/// Throws InputError when the problem itself makes no sense (sizes, no measurement, bad σ).
CalibrationResult solve(const CalibrationProblem& problem, const std::vector<Pose>& guess,
                        const SolveOptions& options = {});

/// Widens the covariance of a converged result where beside its minimum the readings allow more
/// than the slope there says, and takes the claim back where they allow twice as much or more
/// (nearby, curvature.hpp): what calibrate does with its last fit. The paper's formulation claims
/// what the paper does.
void look_around(const CalibrationProblem& problem, CalibrationResult& result);

/// Takes back the claim of a converged result: which direction is known least is said, the pose is
/// `unobservable` for that reason.
void withdraw(const CalibrationProblem& problem, std::string reason, CalibrationResult& result);

/// Says of a result solved without it what least_observed says; a result that has no covariance, or
/// says it already, stays as it is.
void explain(const CalibrationProblem& problem, CalibrationResult& result);

/// The problem with its defaults filled in: itself, or where something lacked, a copy in `filled`.
/// Throws InputError when it makes no sense (no measurement, sizes that do not fit the robot or the
/// poses).
const CalibrationProblem& completed(const CalibrationProblem& problem,
                                    const std::vector<Pose>& poses,
                                    std::optional<CalibrationProblem>& filled);
/// The same, always a copy.
CalibrationProblem completed(const CalibrationProblem& problem, const std::vector<Pose>& poses);

/// Root mean squares of residuals, one entry a pose, the reference first: there changes are zero by
/// construction and do not count, nor does its attitude unless `reference_attitude`.
ResidualRms residual_rms(const std::vector<PoseResidual>& residuals, bool reference_attitude);

const char* to_string(CalibrationStatus status);

}  // namespace cdprcal
