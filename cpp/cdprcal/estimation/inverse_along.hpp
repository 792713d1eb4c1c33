// Private to estimation/ and planning/: a covariance of the twists that a platform may make.
#pragma once

#include <optional>

#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {

/// Inverse of an information within the span of a basis, zero across it; nothing where some
/// direction of the span is not seen.
std::optional<Matrix6> inverse_along(const TwistBasis& motion, const Matrix6& information);

}  // namespace cdprcal
