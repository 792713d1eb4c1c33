// The plan file (CSV) that `acquire` reads.
//
//   # cdprcal plan
//   # robot: irma4
//   # start_tension_N: 78.2, 78.3, 78.3, 78.2
//   # start_position_m: 0, 0, 0.9
//   # start_quaternion_wxyz: 1, 0, 0, 0
//   # start_dwell_s: 10.6
//   # stops: 8
//   # predicted_standard_deviation_m_rad: 0.015, 0.015, 0.011, 0.0062, 0.0064, 0.0040
//   purpose,position_x_m,position_y_m,position_z_m,quaternion_w,quaternion_x,quaternion_y,
//     quaternion_z,tension_1_N,…,transition_s,dwell_s,natural_frequency_1_hz,…,
//     constant_tension_frequency_1_hz,…                                        (one line)
//   measure,0.4,-0.4,0.6,…
//
// One row a stop, in visiting order; purpose is measure, or via for a stop that is only passed
// through. Position and quaternion are of R_world_platform; tensions are set-points as the load
// cells read them (Plan). Other comment lines are ignored.
#pragma once

#include <cstddef>
#include <string>

#include "cdprcal/planning/plan.hpp"

namespace cdprcal {

/// Text of a plan file; parse_plan gives back the same plan to the last bit (duration_s is the sum
/// of its times). Throws InputError for a plan whose sizes do not agree or that has no stops.
std::string format_plan(const Plan& plan);
void write_plan(const Plan& plan, const std::string& path);

/// Far beyond the largest grid that can be planned.
inline constexpr std::size_t kMostPlanBytes = 64'000'000;

/// Reads a plan file; `source` is what messages call it. Columns in any order; the frequencies may
/// be left out (empty then), all else is required.
/// Throws InputError "source:line:column: what is wrong and what to do" for an empty, binary, cut
/// or too large file, missing, unknown or duplicate columns or header comments, ragged rows, text
/// or infinities in a number, tensions that are not positive, negative times, a quaternion whose
/// norm is not 1 (to 1e-6), and other than the announced number of stops.
Plan parse_plan(const std::string& text, const std::string& source);
Plan read_plan(const std::string& path);

}  // namespace cdprcal
