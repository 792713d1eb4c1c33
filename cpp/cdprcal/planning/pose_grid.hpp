// The grid of measurement positions (paper §3.2.1, Fig. 2b) and the box it fills (eq. 19).
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/planning/set_point.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {

/// counts[0]·counts[1]·counts[2] positions at equal steps from face to face of a box, in a
/// serpentine: the top layer first, neighbours one step apart (with 2×2×2 the order of Table II).
/// A count of 1 puts its positions in the middle. Throws InputError for counts below 1, over 10⁵
/// positions in all, or a box that is empty or not finite; a flat box is fine where the count is 1.
std::vector<Vector3> grid_positions(const Box& box, const std::array<int, 3>& counts);

/// "(0.1, 0.2, 0.3) m", for people.
std::string in_words(const Vector3& position_m);

/// The box of eq. 19, that the authors chose for their robot, when `robot` is the built-in irma4:
/// the same name, and no anchor moved by more than 5 cm (so also after a calibration).
std::optional<Box> published_measurement_box(const Robot& robot);

/// Where to measure.
struct BoxProposal {
  std::optional<Box> box;
  std::string reason;    ///< when there is a box: where it comes from; otherwise why there is none
  bool stopped = false;  ///< `proceed` said so
};

/// The published box, or else the largest one inscribed in the robot's static workspace, shrunk
/// about its middle until every position of a 3×3×3 grid in it is a set-point with margin that
/// survives a tension error of one σ (survives_tension_error). `proceed`, when given, is called
/// now and then; false ends the search. Throws InputError as SetPointSolver does.
BoxProposal propose_measurement_box(const Robot& robot, const SetPointOptions& options = {},
                                    const std::function<bool()>& proceed = {});

}  // namespace cdprcal
