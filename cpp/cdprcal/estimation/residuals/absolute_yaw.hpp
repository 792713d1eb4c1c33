// F_χ: yaw as a compass or a camera reads it, without an offset, one row [rad/σ]. Not in the paper.
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// χ(ζi) − χ*_i, in the AHRS's Euler convention; at the reference too.
struct AbsoluteYawTerm {
  static int rows(const TermInput& in) {
    return std::isfinite(in.measured().absolute_yaw_rad) ? 1 : 0;
  }
  static void write(const TermInput& in, RowWriter& rows) {
    if (AbsoluteYawTerm::rows(in) == 0) return;
    rows.absolute({Channel::absolute_yaw, 2},
                  wrap_angle(in.pose().absolute_yaw_rad - in.measured().absolute_yaw_rad),
                  in.weight(Channel::absolute_yaw), in.pose().absolute_yaw_by_twist);
  }
};

}  // namespace cdprcal
