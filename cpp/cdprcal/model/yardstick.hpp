// What a size is measured against: an error of 8 N is large where the platform weighs 30 N, and
// nothing where it weighs 5 kN.
//
// Sizes are known best of one robot, irma4: they are written down as numbers of that robot, with
// the yardstick by which they follow for any other. No reason of physics fixes a size in newtons or
// metres; load cells, cables, pulleys and frames are chosen for the load and the room there is.
#pragma once

#include "cdprcal/model/robot.hpp"

namespace cdprcal {

enum class Yardstick {
  none,         ///< angles, ratios and times: the same on every robot
  mass,         ///< of the platform
  weight,       ///< of the platform: what cables carry and load cells are chosen for
  frame,        ///< robot_size_m: what cables and the error of a tape grow with
  platform,     ///< characteristic_length_m: the arms of the cables' anchors
  pulley,       ///< largest radius; eyelets alone: as the frame
  cable_mass,   ///< mass a metre of frame: thicker cables carry heavier platforms
  flexibility,  ///< stretch by the weight: cables are chosen for it, and files have its inverse
  gradient,     ///< a radian across the frame
  stiffness     ///< of what hangs on the platform: its weight across the frame
};

/// What a size, as files have it, grows with: "the weight of the platform". Empty for `none`.
const char* in_words(Yardstick yardstick);

/// How many times as large it is as irma4's, for which sizes are written down. 1 for `none`.
double times_reference(Yardstick yardstick, const Robot& robot);

}  // namespace cdprcal
