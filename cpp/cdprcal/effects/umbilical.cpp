// A hose, a wire or a cable chain hangs on the platform: it pulls beside the centre of mass, and
// not alike everywhere.
//
// Whatever hangs there (a spring to a post, a catenary, a guided chain), about the middle of the
// places that a robot visits it is a force and its derivative by the place. What stores energy has
// a symmetric one.
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/moved_pulleys.hpp"

namespace cdprcal {
namespace {

class Umbilical final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "umbilical",
        .equation = "f + F - K x at the point c, x = where c is from the middle of the pulleys",
        .parameters = {{.name = "force_N",
                        .unit = "N",
                        .shape = ParameterShape::vector3,
                        .typical = 4.0,
                        .plausible = 30.0,
                        .of = Yardstick::weight},
                       {.name = "from_centre_of_mass_m",  // c, platform axes
                        .unit = "m",
                        .shape = ParameterShape::vector3,
                        .typical = 0.1,
                        .plausible = 1.0,
                        .of = Yardstick::platform},
                       stiffness("stiffness_N_m"),  // of K: xx, yy, zz
                       stiffness("coupling_N_m")},  // xy, xz, yz
        .scope = EffectScope::run,
        .confused_with = {"external_force", "load_cell_bias", "centre_of_mass"},
        .sentence =
            "a hose, a wire or a cable chain pulls at a point of the platform, and not "
            "everywhere alike",
        .remedy = "hang it so that it does not pull, or enter what it does",
        .settle = "take it off and repeat the run",
        .all_or_nothing = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    const Pull pull(context, values);
    evaluation.wrench.head<3>() -= pull.force_N;
    evaluation.wrench.tail<3>() -= pull.arm_m.cross(pull.force_N);
    const Matrix3 arm = skew(pull.arm_m), by_turn = pull.stiffness_N_m * arm;
    evaluation.wrench_by_twist.topLeftCorner<3, 3>() += pull.stiffness_N_m;
    evaluation.wrench_by_twist.topRightCorner<3, 3>() -= by_turn;
    evaluation.wrench_by_twist.bottomLeftCorner<3, 3>() += arm * pull.stiffness_N_m;
    evaluation.wrench_by_twist.bottomRightCorner<3, 3>() -=
        arm * by_turn + skew(pull.force_N) * arm;
  }
  void columns(const EffectContext& context, const EffectValues& values,
               EffectColumns out) const override {
    const Pull pull(context, values);
    const ReadingRows rows{context.state.cable_count};
    const Matrix3& rotation = context.state.rotation;
    const Vector3& x = pull.place_m;
    auto force = out.middleRows<3>(rows.wrench());
    force.leftCols<3>() = -Matrix3::Identity();
    force.middleCols<3>(3) = pull.stiffness_N_m * rotation;
    force.middleCols<3>(6) = x.asDiagonal();
    force.rightCols<3>() << x[1], x[2], 0.0,  //
        x[0], 0.0, x[2],                      //
        0.0, x[0], x[1];
    auto moment = out.middleRows<3>(rows.wrench() + 3);
    moment = skew(pull.arm_m) * force;
    moment.middleCols<3>(3) += skew(pull.force_N) * rotation;
  }

 private:
  static EffectParameter stiffness(const char* name) {
    return {.name = name,
            .unit = "N/m",
            .shape = ParameterShape::vector3,
            .typical = 4.0,
            .plausible = 60.0,
            .of = Yardstick::stiffness};
  }

  /// World axes.
  struct Pull {
    Pull(const EffectContext& context, const EffectValues& values)
        : arm_m(context.state.centre_of_mass_arm_m + context.state.rotation * values.segment<3>(3)),
          place_m(context.pose.position_m + arm_m - middle_of_pulleys(context.robot)) {
      const auto k = values.segment<3>(6), c = values.tail<3>();
      stiffness_N_m << k[0], c[0], c[1],  //
          c[0], k[1], c[2],               //
          c[1], c[2], k[2];
      force_N = values.head<3>() - stiffness_N_m * place_m;
    }
    Vector3 arm_m;    ///< from P to the point
    Vector3 place_m;  ///< x
    Matrix3 stiffness_N_m;
    Vector3 force_N;
  };
};

}  // namespace

std::shared_ptr<const Effect> umbilical() { return std::make_shared<Umbilical>(); }

}  // namespace cdprcal
