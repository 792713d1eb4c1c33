// Eq. 6 as it stands: all six balance equations at the measured tensions, whitened.
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// W (Ξᵀτ*_i − f(ζi)), 6 rows: forces then moments about P, world axes. W is the inverse square
/// root of the covariance Ξᵀ σ_τ² Ξ + model noise; it is held constant within a solve and
/// refreshed between solves (PoseCache::update_wrench_whitening).
struct WrenchTerm {
  static int rows(const TermInput& in) {
    return in.cache.statics_of(in.index) == StaticsModel::wrench ? 6 : 0;
  }
  static void write(const TermInput& in, RowWriter& rows) {
    if (WrenchTerm::rows(in) == 0) return;
    const Matrix6& whitening = in.cache.wrench_whitening(in.index);
    const Vector6 balance = whitening * in.pose().wrench;
    const Matrix6 by_twist = whitening * in.pose().wrench_by_twist;
    for (int i = 0; i < 6; ++i) {
      rows.absolute({Channel::balance, i}, balance[i], 1.0, by_twist.row(i));
    }
  }
};

}  // namespace cdprcal
