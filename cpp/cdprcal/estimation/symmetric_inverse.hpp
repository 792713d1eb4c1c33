// The inverse of an information about numbers of different units.
#pragma once

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Pseudo-inverse of a symmetric, positive semidefinite matrix [n, n]: symmetric and positive
/// semidefinite itself, 0 along what the matrix tells nothing of. Metres, radians and typical sizes
/// may stand side by side: it is solved with a unit diagonal, which conditions it about as well as
/// any scaling can (van der Sluis 1969). As it is where it is not finite.
Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& information);

}  // namespace cdprcal
