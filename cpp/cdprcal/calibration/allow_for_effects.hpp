// The initial pose when the model is known to lack something, but not what: every effect of the
// catalogue may be there at its typical size.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// Whether the residuals of a refined calibration say that the model lacks something: in some
/// channel poses misfit by more than single readings scatter. Empty: no; else which channels and
/// how much.
std::string misfit(const Calibration& calibration);

/// For a converged calibration with a misfit: fits again with all effects of the catalogue as
/// unknowns under priors of their typical sizes (maximum a posteriori), and puts the poses of the
/// reference and of the rests and the first one's covariance in the result (poses in motion and the
/// residuals, which are what misfits, stay). Readings that share an unmodelled error are then no
/// longer taken for independent ones, so the covariance counts what such errors can do. The reason
/// says so. Without a misfit, with specified noise, or when the larger fit does not settle, the
/// estimate stays as it is (in the last case the reason says that its uncertainty leaves out the
/// misfit).
void allow_for_effects(const CalibrateOptions& options, Calibration& calibration);

}  // namespace cdprcal
