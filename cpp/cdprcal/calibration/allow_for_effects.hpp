// What effects that nobody named may do to the initial pose: all of the catalogue where the model
// is known to lack something, those that the log cannot rule out where it is not.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Whether the residuals of a refined calibration say that the model lacks something: in some
/// channel poses misfit by more than single readings scatter. Empty: no; else which channels and
/// how much.
std::string misfit(const Calibration& calibration);

/// What poses may misfit the readings of a channel by: what single readings scatter by, or, where
/// nothing tells that (a list of rests), twice what the robot file says.
double scatter_of(const CalibrationProblem& problem, Channel channel);

/// For a converged calibration with a misfit: fits again with all effects of the catalogue as
/// unknowns under priors of their typical sizes (maximum a posteriori), and puts the poses of the
/// reference and of the rests and the first one's covariance in the result (poses in motion and the
/// residuals, which are what misfits, stay). Readings that share an unmodelled error are then no
/// longer taken for independent ones, so the covariance counts what such errors can do. The reason
/// says so; when the larger fit does not settle, that the uncertainty leaves out the misfit.
/// Without a misfit the poses stay, and the covariance grows by what the log cannot rule out
/// (evidence/model_average.hpp), as it does in diagnose before that finds anything. So it does with
/// one that no effect explains better than errors that stay over a rest, if it is no larger than
/// twice what the robot file says of the sensors and load cells check it. With specified noise
/// nothing changes. False where there is a misfit that the uncertainty leaves out. Of the last
/// `kinematic_poses` of a calibration in motion, which are in balance too, so many as
/// `moments_a_reading` count as one.
bool allow_for_effects(const CalibrateOptions& options, Calibration& calibration,
                       double moments_a_reading = 1.0);

/// The poses in balance of a calibration as a model to which effects can be added, noise as its
/// signals say.
DiagnosisModel model_of(const Calibration& calibration);

}  // namespace cdprcal
