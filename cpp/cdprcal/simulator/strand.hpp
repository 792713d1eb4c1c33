// One cable between its pulley and the platform: where it runs and how hard it pulls.
//
// The strand is an elastic line without mass of its own (its waves are far above anything a sensor
// here sees); when it has weight it hangs in the parabola of a uniform load, whose error is of
// second order in sag ÷ span.
#pragma once

#include "cdprcal/kinematics/cable.hpp"

namespace cdprcal {

/// Material of a strand of natural length w [m].
struct StrandLaw {
  double axial_stiffness_N = 0.0;  ///< EA
  double weight_N_m = 0.0;         ///< ρ g

  /// Stiffness [N/m] of natural length w.
  [[nodiscard]] double stiffness_N_m(double natural_m) const {
    return axial_stiffness_N / natural_m;
  }
};

/// Geometry at one moment.
struct StrandState {
  bool valid = false;
  CableState cable;  ///< what the swivel and the pulley see
  Vector3 chord;     ///< unit vector from where the cable leaves the pulley to the platform
  double chord_m = 0.0;
  double length_m = 0.0;  ///< arc on the pulley plus chord
};

/// Geometry for q from pulley entry D to platform anchor A [m]. A strand with weight leaves the
/// pulley towards a point below A by `drop_m` (where its tangent there passes): the pulley turns
/// after it. 0 for a strand without weight.
StrandState strand_state(const Pulley& pulley, const Vector3& q_world_m, double drop_m);

/// The drop for chord tension T: weight · chord ÷ 2T.
double strand_drop_m(const StrandLaw& law, double chord_m, double tension_N);

/// Chord tension of a strand with weight [N] (> 0 always: the catenary's own weight), and its
/// derivative by length [N/m], from natural length, arc + chord length and geometry.
struct ChordTension {
  double tension_N = 0.0;
  double by_length_N_m = 0.0;
};
ChordTension sagging_tension(const StrandLaw& law, double length_m, double natural_m,
                             const StrandState& state);

/// Natural length that gives the chord tension [m].
double natural_length_m(const StrandLaw& law, const StrandState& state, double tension_N);

/// Tension at the pulley ↔ tension of the chord: there the pull also carries half the weight.
double tension_at_pulley_N(const StrandLaw& law, const StrandState& state, double chord_N);
double chord_tension_N(const StrandLaw& law, const StrandState& state, double at_pulley_N);

/// Mean of the elastic pull over a step between two elongations, the discrete gradient of
/// ½ k max(0, e)²: it does exactly the work that the strand's energy loses. No push. Smooth in the
/// elongation at the end, also where the strand goes slack or taut.
ChordTension mean_elastic_tension(double stiffness_N_m, double elongation_0_m,
                                  double elongation_1_m);

}  // namespace cdprcal
