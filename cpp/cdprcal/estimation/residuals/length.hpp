// F_l of eqs 13, 16: cable-length changes, up to n rows [m/σ].
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// F_l,i = l(ζi) − l(ζ0) − Δl*_i − e_l.
struct LengthTerm {
  static int rows(const TermInput& in) {
    return in.index == 0 ? 0 : count_changes(in.measured().length_m, in.reference.length_m);
  }
  static void write(const TermInput& in, RowWriter& rows) {
    if (in.index == 0) return;
    write_changes({in.measured().length_m, in.reference.length_m, in.pose().length_m,
                   in.initial().length_m, in.pose().length_by_twist, Channel::length,
                   in.weight(Channel::length), in.reference.length_error(0), false},
                  in.reference.errors().data() + in.reference.length_error(0), rows);
  }
};

}  // namespace cdprcal
