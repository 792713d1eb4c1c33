// The same least squares by Ceres: slower, written by others, and so a check of ours.
#pragma once

#include "cdprcal/estimation/arrowhead.hpp"

namespace cdprcal {

class Assembly;

/// As Assembly::minimise: from the state that the assembly holds to the minimum, left there.
/// One parameter block a pose and one of reference errors; one cost function a pose (Ceres' own
/// work a block is several times that of the equations in it), with analytic derivatives; Schur
/// complement. `evaluations` counts Ceres' iterations.
MinimiserSummary minimise_with_ceres(Assembly& assembly, const MinimiserOptions& options);

}  // namespace cdprcal
