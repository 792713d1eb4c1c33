// F_τ of eqs 10–13: tensions by the paper's left inverse, n rows [N/σ].
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// F_τ,i = τ(ζi) − τ*_i with τ(ζ) of eqs 11, 12. σ follows the graduation.
struct TensionTerm {
  static int rows(const TermInput& in) {
    return in.cache.statics_of(in.index) == StaticsModel::left_inverse
               ? in.problem.robot.cable_count()
               : 0;
  }
  static void write(const TermInput& in, RowWriter& rows) {
    if (TensionTerm::rows(in) == 0) return;
    for (Eigen::Index c = 0; c < in.measured().tension_N.size(); ++c) {
      rows.absolute({Channel::balance, static_cast<int>(c)},
                    in.pose().tension_N[c] - in.measured().tension_N[c],
                    in.cache.tension_weight(in.index), in.pose().tension_by_twist.row(c));
    }
  }
};

}  // namespace cdprcal
