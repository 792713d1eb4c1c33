// F_ε of eqs 13, 16: absolute roll and pitch (2 rows), yaw change (1 row) [rad/σ].
#pragma once

#include "cdprcal/estimation/residuals/term.hpp"

namespace cdprcal {

/// φ(ζi) − φ*_i and θ(ζi) − θ*_i, in the sensor's own Euler convention. At the reference too,
/// unless the formulation leaves it out as the paper does.
struct RollPitchTerm {
  static bool used(const TermInput& in, int axis) {
    return std::isfinite(in.measured().roll_pitch_yaw_rad[axis]) &&
           (in.index > 0 || in.problem.reference_attitude);
  }
  static int rows(const TermInput& in) { return (used(in, 0) ? 1 : 0) + (used(in, 1) ? 1 : 0); }
  static void write(const TermInput& in, RowWriter& rows) {
    for (int axis = 0; axis < 2; ++axis) {
      if (!used(in, axis)) continue;
      rows.absolute(
          {Channel::roll_pitch, axis},
          wrap_angle(in.pose().roll_pitch_yaw_rad[axis] - in.measured().roll_pitch_yaw_rad[axis]),
          in.weight(Channel::roll_pitch), in.pose().attitude_by_twist.row(axis));
    }
  }
};

/// χ(ζi) − χ(ζ0) − Δχ*_i − e_χ.
struct YawTerm {
  static int rows(const TermInput& in) { return in.index > 0 && std::isfinite(change(in)) ? 1 : 0; }
  static void write(const TermInput& in, RowWriter& rows) {
    if (YawTerm::rows(in) == 0) return;
    rows.relative({Channel::yaw, 2},
                  wrap_angle(in.pose().roll_pitch_yaw_rad[2] - in.initial().roll_pitch_yaw_rad[2] -
                             change(in) - in.reference.yaw_error_rad()),
                  in.weight(Channel::yaw), in.pose().attitude_by_twist.row(2),
                  in.reference.yaw_error());
  }

 private:
  static double change(const TermInput& in) {
    return in.measured().roll_pitch_yaw_rad[2] - in.reference.yaw_rad;
  }
};

}  // namespace cdprcal
