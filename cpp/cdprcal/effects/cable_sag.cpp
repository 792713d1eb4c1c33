// Cables have weight: they hang in a catenary, here a parabola (Irvine, Cable Structures, 1981).
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class CableSag final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "cable_sag",
        .equation =
            "catenary: longer than its chord, tilted exit at the pulley, half the weight "
            "on each end",
        .parameters = {{.name = "linear_density_kg_m",
                        .unit = "kg/m",
                        .shape = ParameterShape::scalar,
                        .typical = 0.03,
                        .plausible = 0.3,
                        .of = Yardstick::cable_mass,
                        .range = ValueRange::not_negative}},
        .scope = EffectScope::robot,
        .confused_with = {"mass", "load_cell_bias"},
        .sentence = "the cables weigh enough to sag",
        .remedy = "enter the linear density of the cables",
        .settle = "weigh a metre of cable",
        .one_sided = true};
    return info;
  }
  // With w = rho g and free length L: the exit direction tilts by w L / (2 tau), the chord carries
  // tau + t_z w L / 2 of the tension tau read at the pulley, and w L / 2 hangs on each anchor. The
  // arc is longer than its chord by (w L)^2 (1 - t_z^2) L / 24 over the square of the tension in
  // the chord: micrometres where cables are short and taut, millimetres where they are not.
  void correct_tension(const EffectContext& context, const EffectValues& density_kg_m,
                       CableVector& tension_N) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      tension_N[i] += density_kg_m[0] * chord_loss(context, i);
    }
  }
  void add_to_readings(const EffectContext& context, const EffectValues& density_kg_m,
                       PoseEvaluation& evaluation) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      const CableState& cable = context.state.cable[i];
      evaluation.swivel_rad[i] += density_kg_m[0] * tilt(context, i);
      const Excess excess = excess_of(context, density_kg_m[0], i);
      evaluation.length_m[i] += excess.length_m;
      // The tilt is L^2 w_z / (u.q): each factor follows q.
      const double r = context.robot.cables[i].pulley.radius_m;
      const Vector3 length_by_q = cable.direction + (r / cable.free_length_m) * cable.contact;
      const Vector3 by_q = tilt(context, i) * (2.0 / cable.free_length_m * length_by_q -
                                               cable.radial / cable.radial_distance_m) -
                           tilt_by_swivel(context, i) * swivel_by_q(cable);
      add_by_q(context, i, density_kg_m[0] * by_q, evaluation.swivel_by_twist);
      const Vector3 z_by_q = direction_by_q(cable).row(2);
      add_by_q(context, i, excess.by_free_length * length_by_q + excess.by_z * z_by_q,
               evaluation.length_by_twist);
      // Balance: the chord's share of the tension varies with the pose, and so does the weight.
      const double half = 0.5 * density_kg_m[0] * context.robot.gravity_m_s2;
      const Vector3 share_by_q =
          half * (cable.direction.z() * length_by_q + cable.free_length_m * z_by_q);
      const Vector3 arm = context.state.anchor_arm_m[i];
      Vector6 column;
      column << cable.direction, arm.cross(cable.direction);
      Eigen::Matrix<double, 1, 6> share_by_twist;
      share_by_twist << share_by_q.transpose(), arm.cross(share_by_q).transpose();
      evaluation.wrench_by_twist += column * share_by_twist;
      const Vector3 weight(0.0, 0.0, half * cable.free_length_m);
      evaluation.wrench.head<3>() += weight;
      evaluation.wrench.tail<3>() += arm.cross(weight);
      const Vector3 weight_by_q = half * length_by_q;  // of its z component
      Eigen::Matrix<double, 1, 6> weight_by_twist;
      weight_by_twist << weight_by_q.transpose(), arm.cross(weight_by_q).transpose();
      Vector6 lever;
      lever << Vector3::UnitZ(), arm.cross(Vector3::UnitZ());
      evaluation.wrench_by_twist += lever * weight_by_twist;
      evaluation.wrench_by_twist.bottomRightCorner<3, 3>() += skew(weight) * skew(arm);
    }
  }
  void columns(const EffectContext& context, const EffectValues& density_kg_m,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    Eigen::VectorXd share(rows.cables);
    for (int i = 0; i < rows.cables; ++i) {
      out(rows.length() + i, 0) = excess_of(context, density_kg_m[0], i).by_density;
      out(rows.swivel() + i, 0) = tilt(context, i);
      share[i] = chord_loss(context, i);
      const Vector3 weight(0.0, 0.0,
                           0.5 * context.robot.gravity_m_s2 * context.state.cable[i].free_length_m);
      out.col(0).segment<3>(rows.wrench()) += weight;
      out.col(0).segment<3>(rows.wrench() + 3) += context.state.anchor_arm_m[i].cross(weight);
    }
    out.col(0).segment<6>(rows.wrench()) += structure_matrix(context.state) * share;
  }

 private:
  /// Chord tension minus the tension at the pulley, for 1 kg/m [N].
  static double chord_loss(const EffectContext& context, int i) {
    const CableState& cable = context.state.cable[i];
    return 0.5 * cable.direction.z() * context.robot.gravity_m_s2 * cable.free_length_m;
  }
  /// How much longer a cable is than its chord [m], and its derivatives. Without a load cell there
  /// is nothing to hang it by.
  struct Excess {
    double length_m = 0.0, by_density = 0.0, by_free_length = 0.0, by_z = 0.0;
  };
  static Excess excess_of(const EffectContext& context, double density_kg_m, int i) {
    const CableState& cable = context.state.cable[i];
    const double length_m = cable.free_length_m, z = cable.direction.z(), across = 1.0 - z * z;
    const double loss_N = chord_loss(context, i);
    const double chord_N = context.measurement.tension_N[i] + density_kg_m * loss_N;
    if (!(chord_N > 0.0)) return {};
    const double half_weight_N = 0.5 * density_kg_m * context.robot.gravity_m_s2;
    const double slope = 2.0 * half_weight_N * length_m / chord_N;
    const double level_m = slope * slope * length_m / 24.0;  // of a cable that is level
    const double by_chord = -2.0 * level_m * across / chord_N;
    return {level_m * across,
            slope * context.robot.gravity_m_s2 * length_m * length_m / (12.0 * chord_N) * across +
                by_chord * loss_N,
            3.0 * level_m * across / length_m + by_chord * half_weight_N * z,
            -2.0 * level_m * z + by_chord * half_weight_N * length_m};
  }
  static double tilt_scale(const EffectContext& context, int i) {
    const CableState& cable = context.state.cable[i];
    const double tension_N = context.measurement.tension_N[i];
    if (!(tension_N > 0.0)) return 0.0;
    return -0.5 * context.robot.gravity_m_s2 * cable.free_length_m * cable.free_length_m /
           (tension_N * cable.radial_distance_m);
  }
  /// Change of the swivel angle for 1 kg/m [rad]: w.q = L w.(chord - exit) sets it.
  static double tilt(const EffectContext& context, int i) {
    return tilt_scale(context, i) * context.state.cable[i].groove_normal.z();
  }
  static double tilt_by_swivel(const EffectContext& context, int i) {
    return tilt_scale(context, i) * context.state.cable[i].radial.z();  // dw = -u dsigma
  }
  static void add_by_q(const EffectContext& context, int i, const Vector3& by_q,
                       CableJacobian& by_twist) {
    by_twist.row(i).head<3>() += by_q;
    by_twist.row(i).tail<3>() += context.state.anchor_arm_m[i].cross(by_q);
  }
};

}  // namespace

std::shared_ptr<const Effect> cable_sag() { return std::make_shared<CableSag>(); }

}  // namespace cdprcal
