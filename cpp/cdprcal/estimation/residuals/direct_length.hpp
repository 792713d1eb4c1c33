// F_d: whole cable lengths as a laser or a tape reads them, up to n rows [m/σ]. Not in the paper.
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// l(ζi) − d*_i: the model's own length, arc on the pulley included; at the reference too.
struct DirectLengthTerm {
  static int rows(const TermInput& in) {
    return static_cast<int>(in.measured().direct_length_m.array().isFinite().count());
  }
  static void write(const TermInput& in, RowWriter& rows) {
    const CableVector& read = in.measured().direct_length_m;
    for (Eigen::Index c = 0; c < read.size(); ++c) {
      if (!std::isfinite(read[c])) continue;
      rows.absolute({Channel::direct_length, static_cast<int>(c)},
                    in.pose().direct_length_m[c] - read[c], in.weight(Channel::direct_length),
                    in.pose().direct_length_by_twist.row(c));
    }
  }
};

}  // namespace cdprcal
