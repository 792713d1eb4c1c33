// F_σ of eqs 13, 16: swivel-angle changes, up to n rows [rad/σ].
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// F_σ,i = σ(ζi) − σ(ζ0) − Δσ*_i − e_σ, wrapped to (−π, π].
struct SwivelTerm {
  static int rows(const TermInput& in) {
    return in.index == 0 ? 0 : count_changes(in.measured().swivel_rad, in.reference.swivel_rad);
  }
  static void write(const TermInput& in, RowWriter& rows) {
    if (in.index == 0) return;
    write_changes({in.measured().swivel_rad, in.reference.swivel_rad, in.pose().swivel_rad,
                   in.initial().swivel_rad, in.pose().swivel_by_twist, Channel::swivel,
                   in.weight(Channel::swivel), in.reference.swivel_error(0), true},
                  in.reference.errors().data() + in.reference.swivel_error(0), rows);
  }
};

}  // namespace cdprcal
