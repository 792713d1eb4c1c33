#include "cdprcal/simulator/strand.hpp"

#include <algorithm>

namespace cdprcal {

StrandState strand_state(const Pulley& pulley, const Vector3& q_world_m, double drop_m) {
  StrandState s;
  if (drop_m == 0.0) {
    s.cable = cable_state(pulley, q_world_m);
    s.valid = s.cable.status == CableStatus::ok;
    s.chord = s.cable.direction;
    s.chord_m = s.cable.free_length_m;
    s.length_m = s.cable.length_m;
    return s;
  }
  s.cable = cable_state(pulley, q_world_m - Vector3(0.0, 0.0, drop_m));
  s.valid = s.cable.status == CableStatus::ok;
  if (!s.valid) return s;
  const Vector3 exit = pulley.radius_m * (s.cable.radial + s.cable.contact);  // B − D
  const Vector3 span = q_world_m - exit;
  s.chord_m = span.norm();
  s.chord = span / s.chord_m;
  s.length_m = s.chord_m + (s.cable.length_m - s.cable.free_length_m);
  return s;
}

double strand_drop_m(const StrandLaw& law, double chord_m, double tension_N) {
  if (law.weight_N_m == 0.0) return 0.0;
  // A slack strand hangs straight down from the pulley: no tangent is lower than that.
  return std::min(law.weight_N_m * chord_m * chord_m / (2.0 * tension_N), 2.0 * chord_m);
}

ChordTension sagging_tension(const StrandLaw& law, double length_m, double natural_m,
                             const StrandState& state) {
  // Length of the parabola = natural length stretched: l + L W⊥²/(24 T²) = w (1 + T/EA).
  const double across =
      law.weight_N_m * state.chord_m * std::hypot(state.chord.x(), state.chord.y());
  const double sag = state.chord_m * across * across / 24.0;
  const double compliance = natural_m / law.axial_stiffness_N;
  const double excess = length_m - natural_m;
  // f(T) = T c − excess − sag/T² rises and bends down: Newton from the left of the root converges.
  double tension = excess > 0.0 ? excess / compliance : 0.0;
  if (sag > 0.0) {
    const double by_sag = excess < 0.0 ? std::sqrt(sag / -excess) : std::cbrt(sag / compliance);
    tension = excess < 0.0 ? std::min(by_sag, std::cbrt(sag / compliance))
                           : std::max(tension, std::min(by_sag, 1e12));
    for (int i = 0; i < 50; ++i) {
      const double value = tension * compliance - excess - sag / (tension * tension);
      const double slope = compliance + 2.0 * sag / (tension * tension * tension);
      const double next = std::max(tension - value / slope, 0.1 * tension);
      const bool done = std::abs(next - tension) <= 1e-13 * tension;
      tension = next;
      if (done) break;
    }
    return {tension, 1.0 / (compliance + 2.0 * sag / (tension * tension * tension))};
  }
  return {tension, tension > 0.0 ? 1.0 / compliance : 0.0};
}

double natural_length_m(const StrandLaw& law, const StrandState& state, double tension_N) {
  const double across =
      law.weight_N_m * state.chord_m * std::hypot(state.chord.x(), state.chord.y());
  const double sag =
      across > 0.0 ? state.chord_m * across * across / (24.0 * tension_N * tension_N) : 0.0;
  return (state.length_m + sag) / (1.0 + tension_N / law.axial_stiffness_N);
}

double tension_at_pulley_N(const StrandLaw& law, const StrandState& state, double chord_N) {
  if (law.weight_N_m == 0.0) return chord_N;
  const double half = 0.5 * law.weight_N_m * state.chord_m;
  return (chord_N * state.chord - Vector3(0.0, 0.0, half)).norm();
}

double chord_tension_N(const StrandLaw& law, const StrandState& state, double at_pulley_N) {
  if (law.weight_N_m == 0.0) return at_pulley_N;
  const double half = 0.5 * law.weight_N_m * state.chord_m;
  const double along = half * state.chord.z();
  const double root = along * along - half * half + at_pulley_N * at_pulley_N;
  return along + std::sqrt(std::max(0.0, root));
}

ChordTension mean_elastic_tension(double stiffness_N_m, double e0, double e1) {
  const double half = 0.5 * stiffness_N_m;
  if (e0 >= 0.0 && e1 >= 0.0) return {half * (e0 + e1), half};
  if (e0 <= 0.0 && e1 <= 0.0) return {};
  const double between = e1 - e0;
  const double share = e0 / between;
  if (e1 > 0.0) return {half * e1 * e1 / between, half * (1.0 - share * share)};
  return {-half * e0 * share, half * share * share};
}

}  // namespace cdprcal
