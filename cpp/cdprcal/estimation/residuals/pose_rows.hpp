// All equations of one pose.
#pragma once

#include "cdprcal/estimation/residuals/absolute_yaw.hpp"
#include "cdprcal/estimation/residuals/attitude.hpp"
#include "cdprcal/estimation/residuals/direct_length.hpp"
#include "cdprcal/estimation/residuals/length.hpp"
#include "cdprcal/estimation/residuals/position.hpp"
#include "cdprcal/estimation/residuals/reference_error.hpp"
#include "cdprcal/estimation/residuals/swivel.hpp"
#include "cdprcal/estimation/residuals/tension.hpp"
#include "cdprcal/estimation/residuals/wrench.hpp"

namespace cdprcal {

/// Calls `visit.operator()<Term>()` for every equation, in the order of its rows. A new equation is
/// a file beside the others and a line here; row_batch.cpp writes the same for eight poses at once,
/// and is not used for problems with equations that it does not know.
template <typename Visit>
void for_each_term(const Visit& visit) {
  visit.template operator()<LengthTerm>();
  visit.template operator()<SwivelTerm>();
  visit.template operator()<YawTerm>();
  visit.template operator()<RollPitchTerm>();
  visit.template operator()<TensionTerm>();
  visit.template operator()<WrenchTerm>();
  visit.template operator()<AbsoluteYawTerm>();
  visit.template operator()<DirectLengthTerm>();
  visit.template operator()<PositionTerm>();
  visit.template operator()<ReferenceErrorTerm>();
}

/// F_i of eq. 13, whitened, with derivatives. Both poses must have been evaluated with Jacobians
/// and be valid.
inline void write_rows(const TermInput& input, PoseRows& out) {
  RowWriter writer(out);
  for_each_term([&]<typename Term>() { Term::write(input, writer); });
}

/// How many rows write_rows writes; needs no evaluation.
inline int row_count(const TermInput& input) {
  int rows = 0;
  for_each_term([&]<typename Term>() { rows += Term::rows(input); });
  return rows;
}

}  // namespace cdprcal
