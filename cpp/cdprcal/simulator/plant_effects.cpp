// What each injected effect does in the machine: one row an effect. The physics is the plant's own,
// by the effect's equation and without the estimator's code.
#include <algorithm>
#include <array>
#include <cmath>

#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/simulator/dynamics.hpp"

namespace cdprcal {
namespace {

using V = PlantValues;
using P = PlantParameters;

constexpr auto kScalar = ParameterShape::scalar, kPerCable = ParameterShape::per_cable;

/// What happens once, to one cable: of a size in m, or N s.
struct Moment {
  explicit Moment(V& v) : time_s(v.scalar()), cable(v.cable()), size(v.scalar()) {}
  double time_s;
  int cable;
  double size;
};

template <class Happen>
void once(V& v, P& p, Happen happen) {
  const Moment at(v);
  p.events.push_back({at.time_s, [=](PlantDynamics& plant) { happen(plant, at.cable, at.size); }});
}

std::vector<ParameterLayout> moment(const char* size) {
  return {{"time_s", kScalar}, {"cable", kScalar, ValueRange::cable}, {size, kScalar}};
}

/// Of one sensor's readings, on top of what they are late by already.
void add_delay(V& v, double& delay_s, const char* effect) {
  delay_s += v.scalar();
  if (!(delay_s > 2.0)) return;
  throw InputError("effect " + std::string(effect) + ": must be at most 2 s");
}

/// How far a step of temperature has come through at `time_s`.
double warmed(double step_s, double time_s) {
  constexpr double kWarming_s = 20.0;
  return time_s > step_s ? -std::expm1(-(time_s - step_s) / kWarming_s) : 0.0;
}

/// The pulleys of a frame that is larger along its axes, slanted (angles between x y, x z and y z,
/// half on either axis), and twisted by so much at its corners.
void deform(Robot& robot, const Vector3& size, const Vector3& slant_rad, double corner_m) {
  const auto [low, high] = pulley_box(robot);
  const Vector3 middle = middle_of_pulleys(robot);
  const Vector3 reach_m = (high - middle).cwiseMax(middle - low);
  // A frame without width along x or y has no corners to twist.
  const double corners_m2 = reach_m.x() * reach_m.y();
  const auto [xy, xz, yz] = std::array{slant_rad.x() / 2, slant_rad.y() / 2, slant_rad.z() / 2};
  for (Cable& cable : robot.cables) {
    const Vector3 at = cable.pulley.position_m - middle;
    const double corner = corners_m2 > 0.0 ? at.x() * at.y() / corners_m2 : 0.0;
    cable.pulley.position_m +=
        Vector3((size.x() - 1.0) * at.x() + xy * at.y() + xz * at.z(),
                (size.y() - 1.0) * at.y() + xy * at.x() + yz * at.z(),
                (size.z() - 1.0) * at.z() + xz * at.x() + yz * at.y() + corner_m * corner);
  }
}

void enlarge(const char* effect, double error_m, Pulley& pulley) {
  pulley.radius_m += error_m;
  if (pulley.radius_m < 0.0) {
    throw InputError(std::string("effect ") + effect +
                     ": leaves a radius below 0; give a smaller one");
  }
}

/// Units: a file has the factors that set readings right.
std::vector<double> inverse_factors(const AppliedEffect& known) {
  std::vector<double> factors = known.parameters.front().values;
  for (double& factor : factors) factor = 1.0 / factor;
  return factors;
}

std::vector<double> inverse_order(const AppliedEffect& known) {
  const std::vector<double>& order = known.parameters.front().values;
  std::vector<double> inverse(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    inverse[static_cast<std::size_t>(order[i]) - 1] = static_cast<double>(i + 1);
  }
  return inverse;
}

std::vector<InjectableEffect> rows() {
  return {
      {"transmission_ratio", "the drum pays out less than the encoder says",
       [](V& v, P& p) { p.ratio_error += v.per_cable(); }},
      {"cable_elasticity", "the cable stretches",
       [](V& v, P& p) { p.axial_stiffness_N = v.scalar(); }},
      {"cable_creep", "the cable grows longer with log time",
       [](V& v, P& p) {
         p.natural_m.push_back([amplitude_m = v.scalar()](double natural_m, int, double time_s) {
           return natural_m + amplitude_m * std::log10(1.0 + time_s / 30.0);
         });
       }},
      {"cable_sag", "the cable has weight",
       [](V& v, P& p) { p.linear_density_kg_m += v.scalar(); }},
      {"pulley_friction", "the pulley rubs",
       [](V& v, P& p) {
         p.to_load_cell_N.push_back(
             [coefficient = v.scalar()](double tension_N, double, const CableRun& run) {
               return tension_N * std::exp(-run.direction * coefficient);
             });
       }},
      {"bending_hysteresis", "bending the cable over the pulley takes force",
       [](V& v, P& p) {
         const double force_N = v.scalar(), coefficient = v.scalar();
         p.to_load_cell_N.push_back([=](double tension_N, double strand_N, const CableRun& run) {
           return tension_N - run.direction * (force_N + coefficient * strand_N);
         });
       }},
      {"viscous_friction", "what holds the cable back grows with its speed",
       [](V& v, P& p) {
         p.to_load_cell_N.push_back(
             [coefficient_Ns_m = v.scalar()](double tension_N, double, const CableRun& run) {
               return tension_N - coefficient_Ns_m * run.speed_m_s;
             });
       }},
      {"inertia", "the platform's moments of inertia are others",
       [](V& v, P& p) {
         const Vector3 error = v.vector3();
         for (Eigen::Index i = 0; i < 3; ++i) {
           for (Eigen::Index j = 0; j < 3; ++j) {
             p.robot.platform.inertia_kg_m2(i, j) *= std::exp(0.5 * (error[i] + error[j]));
           }
         }
       }},
      {"swivel_hysteresis", "the swivel lags",
       [](V& v, P& p) { p.swivel_half_width_rad += v.scalar(); }},
      {"swivel_scale", "the swivel encoder's scale is off",
       [](V& v, P& p) {
         p.swivel_rad.push_back([error = v.per_cable()](double swivel_rad, int cable, double) {
           return (1.0 + error[cable]) * swivel_rad;
         });
       }},
      {"pulley_radius", "the pulley is larger",
       [](V& v, P& p) {
         for (Cable& cable : p.robot.cables) enlarge("pulley_radius", v.scalar(), cable.pulley);
       }},
      {"pulley_diameter", "all pulleys are larger",
       [](V& v, P& p) {
         const double error_m = v.scalar();
         for (Cable& cable : p.robot.cables) enlarge("pulley_diameter", error_m, cable.pulley);
       }},
      {"frame_anchors", "the pulley is elsewhere",
       [](V& v, P& p) {
         for (Cable& cable : p.robot.cables) cable.pulley.position_m += v.vector3();
       }},
      {"frame_scale", "the pulleys stand further apart",
       [](V& v, P& p) { deform(p.robot, Vector3::Ones() + v.vector3(), Vector3::Zero(), 0.0); }},
      {"frame_shear", "the frame is out of square",
       [](V& v, P& p) {
         const double xy_rad = v.scalar(), xz_rad = v.scalar(), yz_rad = v.scalar();
         deform(p.robot, Vector3::Ones(), {xy_rad, xz_rad, yz_rad}, 0.0);
       }},
      {"frame_warp", "two opposite corners of the frame stand high",
       [](V& v, P& p) { deform(p.robot, Vector3::Ones(), Vector3::Zero(), v.scalar()); }},
      {"platform_anchors", "the cable is attached elsewhere",
       [](V& v, P& p) {
         for (Cable& cable : p.robot.cables) cable.platform_anchor_m += v.vector3();
       }},
      {"load_cell_bias", "the load cell's zero is off",
       [](V& v, P& p) {
         p.load_cell_N.push_back([bias_N = v.per_cable()](double tension_N, int cable, double) {
           return tension_N + bias_N[cable];
         });
       }},
      {"load_cell_gain", "the load cell's gain is off",
       [](V& v, P& p) { p.load_cell_gain += v.per_cable(); }},
      {"load_cell_drift", "the load cells' zero moves",
       [](V& v, P& p) {
         p.load_cell_N.push_back([rate_N_s = v.scalar()](double tension_N, int, double time_s) {
           return tension_N + rate_N_s * time_s;
         });
       }},
      {"mass", "the platform is heavier",
       [](V& v, P& p) {
         p.robot.platform.mass_kg += v.scalar();
         if (!(p.robot.platform.mass_kg > 0.0))
           throw InputError("effect mass: leaves no mass; give a smaller one");
       }},
      {"centre_of_mass", "the centre of mass is elsewhere",
       [](V& v, P& p) { p.robot.platform.centre_of_mass_m += v.vector3(); }},
      {"external_force", "something pulls at the platform",
       [](V& v, P& p) { p.springs.push_back({.force_N = v.vector3()}); }},
      {"umbilical", "a hose pulls at the platform, not everywhere alike",
       [](V& v, P& p) {
         PlantSpring spring{.force_N = v.vector3(), .point_m = v.vector3()};
         spring.origin_m = middle_of_pulleys(p.robot);
         spring.stiffness_N_m = v.vector3().asDiagonal();
         const double xy = v.scalar(), xz = v.scalar(), yz = v.scalar();
         spring.stiffness_N_m(0, 1) = spring.stiffness_N_m(1, 0) = xy;
         spring.stiffness_N_m(0, 2) = spring.stiffness_N_m(2, 0) = xz;
         spring.stiffness_N_m(1, 2) = spring.stiffness_N_m(2, 1) = yz;
         p.springs.push_back(spring);
       }},
      {"base_tilt", "the frame stands askew",
       [](V& v, P& p) {
         const double about_x_rad = v.scalar(), about_y_rad = v.scalar();
         p.level = exp_so3(Vector3(about_x_rad, about_y_rad, 0.0));
         const Vector3 weight_N = p.robot.gravity_force_N();
         p.springs.push_back({.force_N = p.level.inverse() * weight_N - weight_N});
       }},
      {"ahrs_misalignment", "the AHRS is mounted askew",
       [](V& v, P& p) { p.ahrs_rotation = p.ahrs_rotation * exp_so3(v.vector3()); }},
      {"attitude_scale", "roll and pitch count more than the platform leans",
       [](V& v, P& p) {
         const double roll_error = v.scalar(), pitch_error = v.scalar();
         p.attitude_rad.push_back([=](const Pose&, double, Vector3& roll_pitch_yaw_rad) {
           roll_pitch_yaw_rad[0] *= 1.0 + roll_error;
           roll_pitch_yaw_rad[1] *= 1.0 + pitch_error;
         });
       }},
      {"yaw_drift", "yaw drifts",
       [](V& v, P& p) {
         p.attitude_rad.push_back(
             [rate_rad_s = v.scalar()](const Pose&, double time_s, Vector3& roll_pitch_yaw_rad) {
               roll_pitch_yaw_rad[2] += rate_rad_s * time_s;
             });
       }},
      {"magnetic_disturbance", "yaw depends on the place",
       [](V& v, P& p) {
         p.attitude_rad.push_back(
             [gradient_rad_m = v.vector3()](const Pose& pose, double, Vector3& roll_pitch_yaw_rad) {
               roll_pitch_yaw_rad[2] += gradient_rad_m.dot(pose.position_m);
             });
       }},
      {"sensor_delay", "the attitude arrives late",
       [](V& v, P& p) { add_delay(v, p.attitude_delay_s, "sensor_delay"); }},
      {"length_delay", "the lengths arrive late",
       [](V& v, P& p) { add_delay(v, p.length_delay_s, "length_delay"); }},
      {"swivel_delay", "the swivel angles arrive late",
       [](V& v, P& p) { add_delay(v, p.swivel_delay_s, "swivel_delay"); }},
      {"tension_delay", "the tensions arrive late",
       [](V& v, P& p) { add_delay(v, p.tension_delay_s, "tension_delay"); }},
      {"length_sign", "the encoder counts backwards",
       [](V& v, P& p) { p.length_sign.array() *= v.per_cable().array(); }},
      {"swivel_sign", "the swivel encoder counts backwards",
       [](V& v, P& p) { p.swivel_sign.array() *= v.per_cable().array(); }},
      {"cable_order", "the length and swivel columns 1 … n are those of other cables",
       [](V& v, P& p) {
         for (int& cable : p.cable_order) cable = v.cable();
       },
       &inverse_order},
      {"angle_unit", "angles are in another unit (57.29577951308232: degrees)",
       [](V& v, P& p) { p.swivel_factor *= v.scalar(), p.attitude_factor *= v.scalar(); },
       &inverse_factors},
      {"length_unit", "lengths are in another unit (1000: mm)",
       [](V& v, P& p) { p.length_factor *= v.scalar(); }, &inverse_factors},
      {"length_factor", "the length encoder of one cable is in another unit (1000: mm)",
       [](V& v, P& p) { p.length_factor.array() *= v.per_cable().array(); }, &inverse_factors},
      {"swivel_factor",
       "the swivel encoder of one cable is in another unit (57.29577951308232: degrees)",
       [](V& v, P& p) { p.swivel_factor.array() *= v.per_cable().array(); }, &inverse_factors},
      {"tension_factor", "the load cell of one cable is in another unit (0.10197162129779283: kgf)",
       [](V& v, P& p) { p.tension_factor.array() *= v.per_cable().array(); }, &inverse_factors},
      {"attitude_sign", "the AHRS counts roll, pitch or yaw backwards",
       [](V& v, P& p) { p.attitude_sign.array() *= v.vector3().array(); }},
      {"tension_sign", "the load cell counts pulls as negative",
       [](V& v, P& p) {
         p.load_cell_N.push_back([sign = v.per_cable()](double tension_N, int cable, double) {
           return sign[cable] * tension_N;
         });
       }},
      {"attitude_mounting", "the AHRS is mounted in another orientation",
       [](V& v, P& p) { p.ahrs_rotation = p.ahrs_rotation * exp_so3(v.vector3()); }},
      {"attitude_offset", "roll, pitch and yaw were zeroed at these angles",
       [](V& v, P& p) {
         p.attitude_rad.push_back(
             [zero_rad = v.vector3()](const Pose&, double, Vector3& roll_pitch_yaw_rad) {
               roll_pitch_yaw_rad -= zero_rad;
             });
       }},
      {"tension_offset", "the load cells were zeroed under these loads",
       [](V& v, P& p) {
         p.load_cell_N.push_back([zero_N = v.per_cable()](double tension_N, int cable, double) {
           return tension_N - zero_N[cable];
         });
       }},
      {"tension_unit", "tensions are in another unit (0.10197162129779283: kgf)",
       [](V& v, P& p) { p.tension_factor *= v.scalar(); }, &inverse_factors},
      {"euler_convention",
       "the AHRS speaks another order: XYZ, XZY, YXZ, YZX, ZXY, ZYX (0 … 5)",
       [](V& v, P& p) {
         p.euler_convention = static_cast<EulerConvention>(static_cast<int>(v.scalar()));
       },
       nullptr,
       {{"order", kScalar, ValueRange::euler_convention}}},
      {"slack", "the winch loses its grip: so much cable runs off, and the encoder sees it",
       [](V& v, P& p) {
         once(v, p,
              [](PlantDynamics& plant, int cable, double m) { plant.run_off(cable, m, true); });
       },
       nullptr, moment("length_m")},
      {"outlier", "the encoder is off by so much for 0.1 s",
       [](V& v, P& p) {
         p.encoder_m.push_back([at = Moment(v)](double length_m, int cable, double time_s) {
           const bool now =
               cable == at.cable && time_s >= at.time_s - 1e-9 && time_s < at.time_s + 0.1 - 1e-9;
           return now ? length_m + at.size : length_m;
         });
       },
       nullptr, moment("length_m")},
      {"oscillation", "a knock at the cable's anchor, across the cable",
       [](V& v, P& p) {
         once(v, p, [](PlantDynamics& plant, int cable, double N_s) {
           plant.knock(cable, N_s * plant.strand(cable).cable.groove_normal);
         });
       },
       nullptr, moment("impulse_N_s")},
      {"cable_slip", "the cable slips on its drum: longer by so much, unseen by the encoder",
       [](V& v, P& p) {
         once(v, p,
              [](PlantDynamics& plant, int cable, double m) { plant.run_off(cable, m, false); });
       },
       nullptr, moment("length_m")},
      {"load_cell_shift", "the load cell's zero jumps by so much",
       [](V& v, P& p) {
         p.load_cell_N.push_back([at = Moment(v)](double tension_N, int cable, double time_s) {
           return cable == at.cable && time_s >= at.time_s ? tension_N + at.size : tension_N;
         });
       },
       nullptr, moment("bias_N")},
      {"swivel_shift", "the swivel encoder slips on its axis by so much",
       [](V& v, P& p) {
         p.swivel_rad.push_back([at = Moment(v)](double swivel_rad, int cable, double time_s) {
           return cable == at.cable && time_s >= at.time_s ? swivel_rad + at.size : swivel_rad;
         });
       },
       nullptr, moment("angle_rad")},
      {"ahrs_shift",
       "something knocks the AHRS askew",
       [](V& v, P& p) {
         const double at_s = v.scalar();
         p.attitude_rad.push_back([at_s, askew = exp_so3(v.vector3()).toRotationMatrix(),
                                   convention = p.robot.euler_convention](
                                      const Pose&, double time_s, Vector3& roll_pitch_yaw_rad) {
           if (time_s < at_s) return;
           roll_pitch_yaw_rad = euler_from_rotation(
               rotation_from_euler(roll_pitch_yaw_rad, convention) * askew, convention);
         });
       },
       nullptr,
       {{"time_s", kScalar}, {"rotation_rad", ParameterShape::vector3}}},
      {"load_shift",
       "the load becomes heavier by so much, and moves on the platform",
       [](V& v, P& p) {
         const double time_s = v.scalar(), more_N = v.scalar() * p.robot.gravity_m_s2;
         const Vector3 weight_N = p.robot.gravity_force_N(), shift_m = v.vector3();
         p.events.push_back({time_s, [=](PlantDynamics& plant) {
                               plant.pull_from_now({.force_N = -weight_N});
                               plant.pull_from_now({.force_N = weight_N - Vector3(0.0, 0.0, more_N),
                                                    .point_m = shift_m});
                             }});
       },
       nullptr,
       {{"time_s", kScalar}, {"mass_kg", kScalar}, {"shift_m", ParameterShape::vector3}}},
      {"bent_frame_under_load",
       "each pulley gives way along its cable's pull",
       [](V& v, P& p) { p.frame_compliance_m_N += v.scalar(); },
       nullptr,
       {{"compliance_m_N", kScalar, ValueRange::not_negative}},
       true},
      {"pulley_creep_under_load",
       "each pulley gives way along its cable's pull, and more so with log time",
       [](V& v, P& p) { p.frame_creep_m_N += v.scalar(); },
       nullptr,
       {{"creep_m_N", kScalar, ValueRange::not_negative}},
       true},
      {"load_cell_drift_each",
       "the zero of each load cell moves by itself",
       [](V& v, P& p) {
         p.load_cell_N.push_back(
             [rate_N_s = v.per_cable()](double tension_N, int cable, double time_s) {
               return tension_N + rate_N_s[cable] * time_s;
             });
       },
       nullptr,
       {{"rate_N_s", kPerCable}},
       true},
      {"load_cell_curvature",
       "the load cells read the square of the tension too",
       [](V& v, P& p) {
         p.load_cell_N.push_back([curve_N_N2 = v.per_cable()](double tension_N, int cable, double) {
           return tension_N * (1.0 + curve_N_N2[cable] * tension_N);
         });
       },
       nullptr,
       {{"curve_N_N2", kPerCable}},
       true},
      {"load_cell_side_load",
       "the load cells feel the pull to the side, which grows with the swivel",
       [](V& v, P& p) {
         p.to_load_cell_N.push_back(
             [cross_talk = v.scalar()](double load_N, double strand_N, const CableRun& run) {
               return load_N + cross_talk * strand_N * (1.0 - std::cos(2.0 * run.swivel_rad)) / 2.0;
             });
       },
       nullptr,
       {{"cross_talk", kScalar}},
       true},
      {"load_cell_cross_talk",
       "each load cell reads a share of what the others carry",
       [](V& v, P& p) { p.load_cell_cross_talk += v.scalar(); },
       nullptr,
       {{"cross_talk", kScalar}},
       true},
      {"drum_layers",
       "cable lies in layers: the ratio grows with what is wound",
       [](V& v, P& p) {
         p.encoder_m.push_back([growth_m_m2 = v.scalar()](double length_m, int, double) {
           return length_m * (1.0 + growth_m_m2 * length_m);
         });
       },
       nullptr,
       {{"growth_m_m2", kScalar}},
       true},
      {"encoder_backlash",
       "there is play between encoder and drum: the encoder lags",
       [](V& v, P& p) { p.encoder_half_play_m += v.scalar(); },
       nullptr,
       {{"half_play_m", kScalar, ValueRange::not_negative}},
       true},
      {"swivel_eccentricity",
       "the swivel encoders' disks sit off their axes",
       [](V& v, P& p) {
         const CableVector sine_rad = v.per_cable(), cosine_rad = v.per_cable();
         p.swivel_rad.push_back([=](double swivel_rad, int cable, double) {
           const double phase_rad = std::atan2(cosine_rad[cable], sine_rad[cable]);
           return swivel_rad + std::hypot(sine_rad[cable], cosine_rad[cable]) *
                                   (std::sin(swivel_rad + phase_rad) - std::sin(phase_rad));
         });
       },
       nullptr,
       {{"sine_rad", kPerCable}, {"cosine_rad", kPerCable}},
       true},
      {"iron_on_the_platform",
       "iron on the platform turns the compass with its heading",
       [](V& v, P& p) {
         const double sine_rad = v.scalar(), cosine_rad = v.scalar();
         p.attitude_rad.push_back([=](const Pose&, double, Vector3& roll_pitch_yaw_rad) {
           const double heading_rad = roll_pitch_yaw_rad[2];
           roll_pitch_yaw_rad[2] +=
               sine_rad * std::sin(heading_rad) + cosine_rad * std::cos(heading_rad);
         });
       },
       nullptr,
       {{"sine_rad", kScalar}, {"cosine_rad", kScalar}},
       true},
      {"temperature_step",
       "it gets warmer: cables lengthen, load cells shift",
       [](V& v, P& p) {
         constexpr double kExpansion_1_K = 1.2e-5;  // steel
         constexpr double kZero_N_K = 0.2;          // 0.02 % of 1 kN a kelvin
         const double step_s = v.scalar(), rise_K = v.scalar();
         p.natural_m.push_back([=](double natural_m, int, double time_s) {
           return natural_m + natural_m * kExpansion_1_K * rise_K * warmed(step_s, time_s);
         });
         p.load_cell_N.push_back([=](double tension_N, int, double time_s) {
           return tension_N + kZero_N_K * rise_K * warmed(step_s, time_s);
         });
       },
       nullptr,
       {{"time_s", kScalar}, {"rise_K", kScalar}},
       true},
      {"drum_runout",
       "an eccentric drum: a sine of the pay-out",
       [](V& v, P& p) {
         const double amplitude_m = v.scalar(), around_m = v.scalar();
         p.encoder_m.push_back([=](double length_m, int, double) {
           return length_m + amplitude_m * std::sin(2.0 * kPi * length_m / around_m);
         });
       },
       nullptr,
       {{"amplitude_m", kScalar}, {"circumference_m", kScalar, ValueRange::positive}},
       true}};
}

}  // namespace

const std::vector<InjectableEffect>& injectable_effects() {
  static const std::vector<InjectableEffect> table = [] {
    std::vector<InjectableEffect> all = rows();
    for (InjectableEffect& row : all) {
      if (!row.parameters.empty()) continue;
      row.parameters = effect_layout(Robot{}, row.name)->parameters;
      std::erase_if(row.parameters, [](const ParameterLayout& p) { return p.optional; });
    }
    return all;
  }();
  return table;
}

}  // namespace cdprcal
