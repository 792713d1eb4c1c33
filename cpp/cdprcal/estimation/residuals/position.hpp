// F_p: position of the platform as a tracker reads it, up to 3 rows [m/σ]. Not in the paper.
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// p_i − p*_i, world axes; at the reference too.
struct PositionTerm {
  static int rows(const TermInput& in) {
    return static_cast<int>(in.measured().position_m.array().isFinite().count());
  }
  static void write(const TermInput& in, RowWriter& rows) {
    const Vector3& read = in.measured().position_m;
    for (int axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(read[axis])) continue;
      rows.absolute({Channel::position, axis}, in.position_m[axis] - read[axis],
                    in.weight(Channel::position), Vector6::Unit(axis).transpose());
    }
  }
};

}  // namespace cdprcal
