// Private to diagnosis/: whether the platform turns enough for anything to depend on how.
#pragma once

#include <array>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Which of roll, pitch and yaw differ over the poses of a fitted model by more than three times
/// what they are known to. Of others the noise is all there is to see, and what is left of the
/// readings that a pose was found from depends on that (errors in variables).
std::array<bool, 3> angles_that_vary(const DiagnosisModel& model);

}  // namespace cdprcal
