// The reference reading is one reading like any other: its error e has the sensor's σ.
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// F_e = e / σ, one row for each reading at the reference whose error is estimated. Not in the
/// paper, whose residuals all share the reference's noise without saying so.
struct ReferenceErrorTerm {
  static int rows(const TermInput& in) { return in.index == 0 ? in.reference.known_errors() : 0; }
  static void write(const TermInput& in, RowWriter& rows) {
    if (in.index > 0) return;
    for (int e = 0; e < in.reference.size(); ++e) {
      if (!in.reference.is_known(e)) continue;
      const RowLabel label = in.reference.label(e);
      rows.error(label, in.reference.errors()[e], in.weight(label.channel), e);
    }
  }
};

}  // namespace cdprcal
