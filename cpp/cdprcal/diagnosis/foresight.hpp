// Before a run: which effects would its rests show, from what size, and which would look alike?
#pragma once

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

struct ForeseenEffect {
  std::shared_ptr<const Effect> effect;
  /// Size, in typical sizes, from which on four of five such effects would be found; NaN: none.
  double detectable = kNaN;
  /// Share of a typical effect's signature that each of Foresight::names would imitate (0 … 1); 1
  /// for itself.
  std::vector<double> imitated;
};

struct Foresight {
  std::vector<ForeseenEffect> effects;  ///< those asked for
  std::vector<std::string> names;       ///< the catalogue's and the robot's own that rest can show
  int poses = 0;
};

struct ForesightOptions {
  double noise = 1.0;  ///< of a rest's readings, in the robot file's σ
  double dwell_s = 5.0, move_s = 5.0;
  std::vector<std::string> of;  ///< names of effects; empty: all that rest can show
};

/// Of a run through these set-points (with poses, one a set-point, where lengths lead the
/// platform), the first of which it begins with. As structural isolability, with sizes. Throws
/// InputError as synthetic_log does, and for a name that rest cannot show.
Foresight foresee(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                  const std::vector<Pose>& poses = {}, const ForesightOptions& options = {});

}  // namespace cdprcal
