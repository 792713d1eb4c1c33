#include "cdprcal/effects/text_effect.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/effects/expression.hpp"
#include "cdprcal/effects/moved_pulleys.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Where a formula is evaluated, with what several variables need.
struct Place {
  explicit Place(const EffectContext& at, int of) : robot(at.robot), context(&at), cable(of) {}
  /// For formulas of the machine itself, wherever its platform is.
  explicit Place(const Robot& machine, int of) : robot(machine), cable(of) {}

  const Robot& robot;
  const EffectContext* context = nullptr;
  int cable = 0;
  mutable std::optional<Vector3> angles_rad{};
  mutable Matrix3 angle_by_turn{};

  [[nodiscard]] const CableState& state() const { return context->state.cable[cable]; }
  /// A number that follows the pulley-to-anchor vector of this cable.
  [[nodiscard]] Slope by_q(double value, const Vector3& gradient) const {
    Slope out(value);
    out.v.head<3>() = gradient;
    out.v.segment<3>(3) = context->state.anchor_arm_m[cable].cross(gradient);
    return out;
  }
  [[nodiscard]] Slope position(int axis) const {
    return Slope(context->pose.position_m[axis], axis);
  }
  [[nodiscard]] Slope angle(int axis) const {
    if (!angles_rad) {
      const EulerConvention convention = robot.euler_convention;
      angles_rad = euler_from_rotation(context->state.rotation, convention);
      angle_by_turn = euler_rate_matrix(*angles_rad, convention).inverse();
    }
    Slope out((*angles_rad)[axis]);
    out.v.segment<3>(3) = angle_by_turn.row(axis);
    return out;
  }
  [[nodiscard]] Slope cable_direction(int axis) const {
    return by_q(state().direction[axis], direction_by_q(state()).row(axis).transpose());
  }
  [[nodiscard]] Slope groove_normal(int axis) const {
    const CableState& s = state();  // dw = -u dsigma
    return by_q(s.groove_normal[axis], -s.radial[axis] * swivel_by_q(s));
  }
  /// The place of the cable's pulley from the middle of all.
  [[nodiscard]] Slope pulley(int axis) const {
    return Slope(robot.cables[cable].pulley.position_m[axis] - middle_of_pulleys(robot)[axis]);
  }
  [[nodiscard]] Slope reach(int axis) const { return Slope(reach_of_pulleys(robot)[axis]); }
  [[nodiscard]] double entry_of(const CableVector& values) const {
    const double value = value_or_zero(values, cable);
    return std::isfinite(value) ? value : 0.0;
  }
};

/// Of what a variable depends: that decides where it may stand.
enum class Of { machine, pulleys, reading, pose };

struct Variable {
  const char* name;
  const char* meaning;
  bool per_cable;
  Of of;
  double low, high;  ///< where formulas are tried out when they are read
  Slope (*at)(const Place&);
  Shows shows = Shows::at_rest;
};

constexpr bool kEach = true, kOne = false;
constexpr double kAngle = 0.4;

const std::array<Variable, 38> kVariables{{
    {"length_m", "length of the cable from its pulley's entry to the platform", kEach, Of::pose,
     0.5, 5.0, [](const Place& p) { return p.by_q(p.state().length_m, p.state().direction); }},
    {"free_length_m", "the same without the arc on the pulley", kEach, Of::pose, 0.4, 4.9,
     [](const Place& p) {
       const double r = p.robot.cables[p.cable].pulley.radius_m;
       const CableState& s = p.state();
       return p.by_q(s.free_length_m, s.direction + (r / s.free_length_m) * s.contact);
     }},
    {"swivel_rad", "swivel angle of the pulley", kEach, Of::pose, -kAngle, kAngle,
     [](const Place& p) { return p.by_q(p.state().swivel_rad, swivel_by_q(p.state())); }},
    {"wrap_rad", "angle of the cable's arc on the pulley", kEach, Of::pose, 0.5, 2.5,
     [](const Place& p) {
       const CableState& s = p.state();
       return p.by_q(kPi - s.tangency_rad, -s.contact / s.free_length_m);
     }},
    {"direction_x", "direction of the cable from the pulley to the platform, world axes", kEach,
     Of::pose, -0.6, 0.6, [](const Place& p) { return p.cable_direction(0); }},
    {"direction_y", "", kEach, Of::pose, -0.6, 0.6,
     [](const Place& p) { return p.cable_direction(1); }},
    {"direction_z", "", kEach, Of::pose, -0.9, -0.3,
     [](const Place& p) { return p.cable_direction(2); }},
    {"radial_m", "distance of the cable's anchor from the pulley's swivel axis", kEach, Of::pose,
     0.3, 3.0,
     [](const Place& p) { return p.by_q(p.state().radial_distance_m, p.state().radial); }},
    {"groove_normal_x", "normal of the plane that pulley and cable lie in, world axes", kEach,
     Of::pose, -0.9, 0.9, [](const Place& p) { return p.groove_normal(0); }},
    {"groove_normal_y", "", kEach, Of::pose, -0.9, 0.9,
     [](const Place& p) { return p.groove_normal(1); }},
    {"groove_normal_z", "", kEach, Of::pose, -0.5, 0.5,
     [](const Place& p) { return p.groove_normal(2); }},
    {"tension_N", "reading of the cable's load cell; 0 where there is none", kEach, Of::reading,
     10.0, 200.0,
     [](const Place& p) { return Slope(p.entry_of(p.context->measurement.tension_of_laws_N())); }},
    {"all_tensions_N", "sum of all load cells' readings", kOne, Of::reading, 40.0, 800.0,
     [](const Place& p) {
       double sum = 0.0;
       for (const double tension_N : p.context->measurement.tension_of_laws_N()) {
         if (std::isfinite(tension_N)) sum += tension_N;
       }
       return Slope(sum);
     }},
    {"length_direction", "+1 after paying out, -1 after hauling in, between them while turning",
     kEach, Of::reading, -1.0, 1.0,
     [](const Place& p) { return Slope(p.entry_of(p.context->measurement.length_direction)); }},
    {"swivel_direction", "the same of the swivel: +1 after a positive turn", kEach, Of::reading,
     -1.0, 1.0,
     [](const Place& p) { return Slope(p.entry_of(p.context->measurement.swivel_direction)); }},
    {"length_rate_m_s",
     "how fast the cable pays out: shows only where the balance in motion counts", kEach,
     Of::reading, -0.2, 0.2,
     [](const Place& p) { return Slope(p.entry_of(p.context->measurement.length_rate_m_s)); },
     Shows::in_moving_balance},
    {"swivel_rate_rad_s", "how fast its swivel turns: the same", kEach, Of::reading, -0.2, 0.2,
     [](const Place& p) { return Slope(p.entry_of(p.context->measurement.swivel_rate_rad_s)); },
     Shows::in_moving_balance},
    {"cable", "number of the cable, from 1", kEach, Of::machine, 1.0, 4.0,
     [](const Place& p) { return Slope(p.cable + 1.0); }},
    {"pulley_x_m", "place of the cable's pulley from the middle of all pulleys, world axes", kEach,
     Of::pulleys, -1.0, 1.0, [](const Place& p) { return p.pulley(0); }},
    {"pulley_y_m", "", kEach, Of::pulleys, -1.0, 1.0, [](const Place& p) { return p.pulley(1); }},
    {"pulley_z_m", "", kEach, Of::pulleys, -1.0, 1.0, [](const Place& p) { return p.pulley(2); }},
    {"reach_x_m", "how far out pulleys stand from their middle, world axes", kOne, Of::pulleys, 0.5,
     1.0, [](const Place& p) { return p.reach(0); }},
    {"reach_y_m", "", kOne, Of::pulleys, 0.5, 1.0, [](const Place& p) { return p.reach(1); }},
    {"reach_z_m", "", kOne, Of::pulleys, 0.5, 1.0, [](const Place& p) { return p.reach(2); }},
    {"radius_m", "of the pulley", kEach, Of::reading, 0.02, 0.1,
     [](const Place& p) { return Slope(p.robot.cables[p.cable].pulley.radius_m); }},
    {"x_m", "position of the platform, world axes", kOne, Of::pose, -1.0, 1.0,
     [](const Place& p) { return p.position(0); }},
    {"y_m", "", kOne, Of::pose, -1.0, 1.0, [](const Place& p) { return p.position(1); }},
    {"z_m", "", kOne, Of::pose, -1.0, 1.0, [](const Place& p) { return p.position(2); }},
    {"roll_rad", "attitude of the platform, in the robot's order of angles", kOne, Of::pose,
     -kAngle, kAngle, [](const Place& p) { return p.angle(0); }},
    {"pitch_rad", "", kOne, Of::pose, -kAngle, kAngle, [](const Place& p) { return p.angle(1); }},
    {"yaw_rad", "", kOne, Of::pose, -kAngle, kAngle, [](const Place& p) { return p.angle(2); }},
    {"roll_rate_rad_s", "how fast the AHRS reading changes: shows only in motion", kOne,
     Of::reading, -0.2, 0.2,
     [](const Place& p) { return Slope(p.context->measurement.attitude_rate_rad_s[0]); },
     Shows::in_motion},
    {"pitch_rate_rad_s", "", kOne, Of::reading, -0.2, 0.2,
     [](const Place& p) { return Slope(p.context->measurement.attitude_rate_rad_s[1]); },
     Shows::in_motion},
    {"yaw_rate_rad_s", "", kOne, Of::reading, -0.2, 0.2,
     [](const Place& p) { return Slope(p.context->measurement.attitude_rate_rad_s[2]); },
     Shows::in_motion},
    {"time_s", "since the first sample of the run", kOne, Of::reading, 0.0, 300.0,
     [](const Place& p) { return Slope(p.context->measurement.run_time_s); }},
    {"mass_kg", "of the platform", kOne, Of::reading, 2.0, 20.0,
     [](const Place& p) { return Slope(p.robot.platform.mass_kg); }},
    {"gravity_m_s2", "acceleration of gravity", kOne, Of::reading, 9.8, 9.82,
     [](const Place& p) { return Slope(p.robot.gravity_m_s2); }},
    {"cables", "how many there are", kOne, Of::machine, 4.0, 4.0,
     [](const Place& p) { return Slope(p.robot.cable_count()); }},
}};

enum class Kind { length, swivel, attitude, tension, anchor_force, force, moment, robot };

struct Target {
  const char* name;
  const char* meaning;
  bool per_cable;
  Kind kind;
  int axis = 0;
  const char* as_effect = nullptr;  ///< of the catalogue, which changes the robot by such values
};

constexpr std::array<Target, 29> kTargets{{
    {"length_m", "to the reading of the cable's winch encoder", kEach, Kind::length},
    {"swivel_rad", "to the reading of the pulley's swivel encoder", kEach, Kind::swivel},
    {"roll_rad", "to the reading of the AHRS", kOne, Kind::attitude, 0},
    {"pitch_rad", "", kOne, Kind::attitude, 1},
    {"yaw_rad", "", kOne, Kind::attitude, 2},
    {"tension_N", "to the reading of a load cell, to get the tension of its cable", kEach,
     Kind::tension},
    {"anchor_force_x_N", "to the force on the platform at the cable's anchor, world axes", kEach,
     Kind::anchor_force, 0},
    {"anchor_force_y_N", "", kEach, Kind::anchor_force, 1},
    {"anchor_force_z_N", "", kEach, Kind::anchor_force, 2},
    {"force_x_N", "to the force on the platform, at its centre of mass, world axes", kOne,
     Kind::force, 0},
    {"force_y_N", "", kOne, Kind::force, 1},
    {"force_z_N", "", kOne, Kind::force, 2},
    {"moment_x_Nm", "to the moment on the platform, world axes", kOne, Kind::moment, 0},
    {"moment_y_Nm", "", kOne, Kind::moment, 1},
    {"moment_z_Nm", "", kOne, Kind::moment, 2},
    {"pulley_x_m", "to the place of the pulley, world axes", kEach, Kind::robot, 0,
     "frame_anchors"},
    {"pulley_y_m", "", kEach, Kind::robot, 1, "frame_anchors"},
    {"pulley_z_m", "", kEach, Kind::robot, 2, "frame_anchors"},
    {"pulley_radius_m", "to the radius of the pulley", kEach, Kind::robot, 0, "pulley_radius"},
    {"anchor_x_m", "to the place of the cable's anchor, platform axes", kEach, Kind::robot, 0,
     "platform_anchors"},
    {"anchor_y_m", "", kEach, Kind::robot, 1, "platform_anchors"},
    {"anchor_z_m", "", kEach, Kind::robot, 2, "platform_anchors"},
    {"mass_kg", "to the mass of the platform", kOne, Kind::robot, 0, "mass"},
    {"centre_of_mass_x_m", "to the platform's centre of mass, platform axes", kOne, Kind::robot, 0,
     "centre_of_mass"},
    {"centre_of_mass_y_m", "", kOne, Kind::robot, 1, "centre_of_mass"},
    {"centre_of_mass_z_m", "", kOne, Kind::robot, 2, "centre_of_mass"},
    {"inertia_x_error", "to the logarithm of the inertia about the platform's axis", kOne,
     Kind::robot, 0, "inertia"},
    {"inertia_y_error", "", kOne, Kind::robot, 1, "inertia"},
    {"inertia_z_error", "", kOne, Kind::robot, 2, "inertia"},
}};

/// The unit that a name ends with: "rate_rad_s" is in rad/s. "1" where it ends with none.
std::string unit_of(const std::string& name) {
  constexpr std::array<std::string_view, 11> kUnits{"m",  "N",  "rad", "s",  "kg",  "Ns",
                                                    "Nm", "m2", "N2",  "s2", "rad2"};
  std::vector<std::string> units;
  for (std::size_t end = name.size();;) {
    const std::size_t line = name.rfind('_', end - 1);
    if (line == std::string::npos) break;
    const std::string word = name.substr(line + 1, end - line - 1);
    if (std::ranges::find(kUnits, word) == kUnits.end()) break;
    units.insert(units.begin(), word);
    if (line == 0) break;
    end = line;
  }
  std::string text;
  for (const std::string& unit : units) add_item(text, unit, "/");
  return text.empty() ? "1" : text;
}

bool is_name(const std::string& text) {
  const auto fine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !text.empty() && text.size() <= 60 && !(text[0] >= '0' && text[0] <= '9') &&
         std::ranges::all_of(text, fine);
}

constexpr const char* kNameRule = "must be letters, digits and _, and begin with a letter";

class TextEffect final : public Effect {
 public:
  TextEffect(const EffectDefinition& definition, Trust trust) : definition_(definition) {
    take_parameters();
    take_additions();
    describe();
    if (trust == Trust::anybodys) try_out();
  }
  TextEffect(const TextEffect&) = delete;  // info_ points into definition_
  TextEffect& operator=(const TextEffect&) = delete;

  [[nodiscard]] const EffectDefinition& definition() const { return definition_; }
  [[nodiscard]] std::optional<FormulaAt> first_formula(const EffectContext& context,
                                                       const EffectValues& values,
                                                       int cable) const {
    const Term& term = terms_.front();
    if (term.variables.empty() || term.target->kind == Kind::robot) return std::nullopt;
    const std::size_t parameters = definition_.parameters.size();
    const auto first = std::ranges::min_element(
        term.variables, {}, [&](std::size_t v) { return term.formula.place_of(parameters + v); });
    const Variable& variable = kVariables[*first];
    return FormulaAt{term.target->name, variable.name, term.target->per_cable,
                     variable.at(Place(context, cable)).a, at(term, values, context, cable).a};
  }
  const EffectInfo& info() const override { return info_; }
  [[nodiscard]] bool moves_cables() const override {
    return std::ranges::any_of(terms_, [](const Term& term) {
      return term.target->as_effect && find_effect(term.target->as_effect)->moves_cables();
    });
  }
  [[nodiscard]] Shows shows() const override {
    Shows out = Shows::at_rest;
    for (const Term& term : terms_) {
      if (term.target->as_effect) {
        out = std::max(out, find_effect(term.target->as_effect)->shows());
      }
      for (const std::size_t v : term.variables) out = std::max(out, kVariables[v].shows);
    }
    return out;
  }

  void apply(const EffectValues& values, Robot& robot) const override {
    const auto changes = [](const Term& term) { return term.target->kind == Kind::robot; };
    if (std::ranges::none_of(terms_, changes)) return;
    const Robot given = robot;  // no formula sees what another one moved
    for (const Term& term : terms_) {
      if (!changes(term)) continue;
      const auto effect = find_effect(term.target->as_effect);
      EffectValues change = EffectValues::Zero(effect->size(robot.cable_count()));
      for (int i = 0; i < cables_of(term, robot.cable_count()); ++i) {
        change[entry(*effect, term, i)] += of_machine(term, values, i, given).a;
      }
      effect->apply(change, robot);
    }
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    for (const Term& term : terms_) {
      if (term.target->kind != Kind::tension) continue;
      for (int i = 0; i < context.state.cable_count; ++i) {
        if (!is_read(context, i)) continue;
        tension_N[i] += at(term, values, context, i).a;
      }
    }
  }
  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    const int n = context.state.cable_count;
    for (const Term& term : terms_) {
      const int axis = term.target->axis;
      if (term.target->kind == Kind::robot) continue;
      const WrenchMatrix structure = structure_of(term, context);
      for (int i = 0; i < cables_of(term, n); ++i) {
        if (term.target->kind == Kind::tension && !is_read(context, i)) continue;
        const Slope added = at(term, values, context, i);
        const auto by_twist = added.v.head<6>().transpose();
        switch (term.target->kind) {
          case Kind::length:
            evaluation.length_m[i] += added.a;
            evaluation.length_by_twist.row(i) += by_twist;
            break;
          case Kind::swivel:
            evaluation.swivel_rad[i] += added.a;
            evaluation.swivel_by_twist.row(i) += by_twist;
            break;
          case Kind::attitude:
            evaluation.roll_pitch_yaw_rad[axis] += added.a;
            evaluation.attitude_by_twist.row(axis) += by_twist;
            break;
          case Kind::tension:  // the tension itself: correct_tension
            evaluation.wrench_by_twist += structure.col(i) * by_twist;
            if (evaluation.tension_by_twist.rows() == n) {
              evaluation.tension_by_twist.row(i) -= by_twist;
            }
            break;
          case Kind::anchor_force:
          case Kind::force: {
            const Vector3& arm = arm_of(term, context, i);
            const Vector3 along = Vector3::Unit(axis);
            evaluation.wrench.head<3>() -= added.a * along;
            evaluation.wrench.tail<3>() -= added.a * arm.cross(along);
            evaluation.wrench_by_twist.topRows<3>() -= along * by_twist;
            evaluation.wrench_by_twist.bottomRows<3>() -= arm.cross(along) * by_twist;
            evaluation.wrench_by_twist.bottomRightCorner<3, 3>() -=
                added.a * skew(along) * skew(arm);
            break;
          }
          case Kind::moment:
            evaluation.wrench[3 + axis] -= added.a;
            evaluation.wrench_by_twist.row(3 + axis) -= by_twist;
            break;
          case Kind::robot:
            break;
        }
      }
    }
  }
  void columns(const EffectContext& context, const EffectValues& values,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const int n = context.state.cable_count;
    for (const Term& term : terms_) {
      if (term.target->kind == Kind::robot) {
        add_robot_columns(term, context, values, out);
        continue;
      }
      const WrenchMatrix structure = structure_of(term, context);
      for (int i = 0; i < cables_of(term, n); ++i) {
        if (term.target->kind == Kind::tension && !is_read(context, i)) continue;
        const Slope added = at(term, values, context, i);
        for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
          const double slope = added.v[6 + static_cast<Eigen::Index>(p)];
          auto column = out.col(value_index(p, i, n));
          switch (term.target->kind) {
            case Kind::length:
              column[rows.length() + i] += slope;
              break;
            case Kind::swivel:
              column[rows.swivel() + i] += slope;
              break;
            case Kind::attitude:
              column[rows.attitude() + term.target->axis] += slope;
              break;
            case Kind::tension:
              column.segment<6>(rows.wrench()) += slope * structure.col(i);
              break;
            case Kind::anchor_force:
            case Kind::force: {
              const Vector3 along = slope * Vector3::Unit(term.target->axis);
              column.segment<3>(rows.wrench()) -= along;
              column.segment<3>(rows.wrench() + 3) -= arm_of(term, context, i).cross(along);
              break;
            }
            case Kind::moment:
              column[rows.wrench() + 3 + term.target->axis] -= slope;
              break;
            case Kind::robot:
              break;
          }
        }
      }
    }
  }

 private:
  struct Term {
    const Target* target;
    Expression formula;
    std::vector<std::size_t> variables;  ///< that it names
  };

  static int cables_of(const Term& term, int cables) { return term.target->per_cable ? cables : 1; }
  static bool is_read(const EffectContext& context, int cable) {
    const CableVector& read = context.measurement.tension_N;
    return read.size() > cable && std::isfinite(read[cable]);
  }
  /// For a formula of tensions; empty for others, which ask nothing of it.
  static WrenchMatrix structure_of(const Term& term, const EffectContext& context) {
    return term.target->kind == Kind::tension ? structure_matrix(context.state) : WrenchMatrix();
  }
  /// From the platform's origin to where a force acts, world axes.
  static const Vector3& arm_of(const Term& term, const EffectContext& context, int cable) {
    return term.target->kind == Kind::force ? context.state.centre_of_mass_arm_m
                                            : context.state.anchor_arm_m[cable];
  }
  /// Where the values of a cable's target stand in those of the effect that changes the robot.
  static int entry(const Effect& effect, const Term& term, int cable) {
    const ParameterShape shape = effect.info().parameters.front().shape;
    return (shape == ParameterShape::per_cable_vector3 ? 3 * cable : cable) + term.target->axis;
  }
  [[nodiscard]] int value_index(std::size_t parameter, int cable, int cables) const {
    int begin = 0;
    for (std::size_t p = 0; p < parameter; ++p) {
      begin += definition_.parameters[p].per_cable ? cables : 1;
    }
    return begin + (definition_.parameters[parameter].per_cable ? cable : 0);
  }

  using Names = std::array<Slope, kMostParameters + kVariables.size()>;
  void fill_parameters(const EffectValues& values, int cable, int cables, Names& names) const {
    for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
      names[p] = Slope(values[value_index(p, cable, cables)], 6 + static_cast<int>(p));
    }
  }
  [[nodiscard]] Slope at(const Term& term, const EffectValues& values, const EffectContext& context,
                         int cable) const {
    return at(term, values, Place(context, cable));
  }
  [[nodiscard]] Slope at(const Term& term, const EffectValues& values, const Place& place) const {
    Names names;
    fill_parameters(values, place.cable, place.robot.cable_count(), names);
    for (const std::size_t v : term.variables) {
      names[definition_.parameters.size() + v] = kVariables[v].at(place);
    }
    return term.formula(std::span<const Slope>(names));
  }
  [[nodiscard]] Slope of_machine(const Term& term, const EffectValues& values, int cable,
                                 const Robot& robot) const {
    return at(term, values, Place(robot, cable));
  }
  /// The robot that apply() made `robot` of, by fixed-point iteration: formulas move pulleys by
  /// small shares of their distances.
  [[nodiscard]] Robot before(const EffectValues& values, const Robot& robot) const {
    constexpr int kSteps = 4;
    Robot out = robot;
    for (int step = 0; step < kSteps; ++step) {
      Robot again = out;
      apply(values, again);
      for (std::size_t i = 0; i < robot.cables.size(); ++i) {
        out.cables[i].pulley.position_m +=
            robot.cables[i].pulley.position_m - again.cables[i].pulley.position_m;
      }
    }
    return out;
  }
  void add_robot_columns(const Term& term, const EffectContext& context, const EffectValues& values,
                         EffectColumns out) const {
    const int n = context.state.cable_count;
    const auto effect = find_effect(term.target->as_effect);
    const int size = effect->size(n);
    Eigen::MatrixXd by_change = Eigen::MatrixXd::Zero(out.rows(), size);
    effect->columns(context, EffectValues::Zero(size), by_change);
    const bool moves_what_it_names = std::ranges::any_of(
        term.variables, [](std::size_t v) { return kVariables[v].of == Of::pulleys; });
    const Robot before_it = moves_what_it_names ? before(values, context.robot) : Robot{};
    const Robot& given = moves_what_it_names ? before_it : context.robot;
    for (int i = 0; i < cables_of(term, n); ++i) {
      const Slope added = of_machine(term, values, i, given);
      for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
        out.col(value_index(p, i, n)) +=
            added.v[6 + static_cast<Eigen::Index>(p)] * by_change.col(entry(*effect, term, i));
      }
    }
  }

  void take_parameters() const {
    if (!is_name(definition_.name)) throw DefinitionError("name", kNameRule);
    const auto taken = [&](const auto& effect) { return effect->name() == definition_.name; };
    if (std::ranges::any_of(effect_catalogue(), taken) || is_reading_fault(definition_.name) ||
        definition_.name.starts_with("unexplained")) {
      throw DefinitionError("name", "is the name of an effect already; take another one");
    }
    if (definition_.parameters.empty()) {
      throw DefinitionError("parameters", "must name at least one; add it");
    }
    if (definition_.parameters.size() > kMostParameters) {
      throw DefinitionError("parameters", "must be at most " + std::to_string(kMostParameters));
    }
    const std::vector<std::string> functions = Expression::function_names();
    for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
      const EffectDefinition::Parameter& parameter = definition_.parameters[p];
      const std::string field = "parameters." + parameter.name;
      if (!is_name(parameter.name)) throw DefinitionError("parameters", kNameRule);
      const bool elsewhere =
          std::ranges::any_of(kVariables, [&](auto& v) { return parameter.name == v.name; }) ||
          std::ranges::find(functions, parameter.name) != functions.end() ||
          parameter.name == "pi" || parameter.name == "name" || parameter.name == "run";
      if (elsewhere) throw DefinitionError(field, "means something else; take another name");
      for (std::size_t other = 0; other < p; ++other) {
        if (definition_.parameters[other].name == parameter.name) {
          throw DefinitionError(field, "given twice; delete one");
        }
      }
      if (!(parameter.typical > 0.0) || !std::isfinite(parameter.typical)) {
        throw DefinitionError(field + ".typical", "must be positive");
      }
      if (!(parameter.plausible >= parameter.typical) || !std::isfinite(parameter.plausible)) {
        throw DefinitionError(field + ".plausible", "must be at least as large as typical");
      }
    }
  }

  void take_additions() {
    if (definition_.adds.empty()) {
      throw DefinitionError("adds", "must have at least one formula; add it");
    }
    std::vector<std::string> names;
    for (const auto& parameter : definition_.parameters) names.push_back(parameter.name);
    for (const Variable& variable : kVariables) names.emplace_back(variable.name);
    std::vector<bool> used(definition_.parameters.size(), false);
    for (const EffectDefinition::Addition& addition : definition_.adds) {
      const std::string field = "adds." + addition.to;
      const auto target =
          std::ranges::find_if(kTargets, [&](auto& t) { return addition.to == t.name; });
      if (target == kTargets.end()) {
        std::string known;
        for (const Target& t : kTargets) add_item(known, t.name);
        throw DefinitionError(
            "adds", "has no place for " + in_quotes(addition.to) + "; give one of " + known);
      }
      for (const Term& term : terms_) {
        if (term.target == &*target) throw DefinitionError(field, "given twice; delete one");
      }
      try {
        terms_.push_back({&*target, Expression(addition.formula, names), {}});
      } catch (const ExpressionError& error) {
        throw DefinitionError(field, error.what(), error.offset);
      }
      check_names(terms_.back(), field, used);
    }
    for (std::size_t p = 0; p < used.size(); ++p) {
      if (!used[p]) {
        throw DefinitionError("parameters." + definition_.parameters[p].name,
                              "stands in no formula; delete it");
      }
    }
  }

  /// What stands in a formula must have a meaning there.
  void check_names(Term& term, const std::string& field, std::vector<bool>& used) const {
    const std::size_t parameters = definition_.parameters.size();
    for (std::size_t p = 0; p < parameters; ++p) {
      const std::size_t place = term.formula.place_of(p);
      if (place == std::string::npos) continue;
      used[p] = true;
      if (definition_.parameters[p].per_cable && !term.target->per_cable) {
        throw DefinitionError(field,
                              definition_.parameters[p].name +
                                  " is one number a cable, and this belongs to none; make it "
                                  "common",
                              place);
      }
    }
    for (std::size_t v = 0; v < kVariables.size(); ++v) {
      const std::size_t place = term.formula.place_of(parameters + v);
      if (place == std::string::npos) continue;
      const Variable& variable = kVariables[v];
      if (variable.per_cable && !term.target->per_cable) {
        throw DefinitionError(
            field,
            std::string(variable.name) + " is a cable's, and this belongs to none; use another",
            place);
      }
      const bool of_robot = variable.of == Of::machine || variable.of == Of::pulleys;
      if (term.target->kind == Kind::robot && !of_robot) {
        throw DefinitionError(
            field,
            "changes the robot itself, which " + std::string(variable.name) +
                " cannot do; use parameters, cable, cables, pulley_x_m …, reach_x_m … alone",
            place);
      }
      term.variables.push_back(v);
    }
  }

  void describe() {
    for (const auto& parameter : definition_.parameters) units_.push_back(unit_of(parameter.name));
    for (const auto& [to, formula] : definition_.adds) {
      add_item(equation_, to + " += " + one_line(formula), "; ");
    }
    if (definition_.sentence.empty()) definition_.sentence = equation_;
    info_.name = definition_.name.c_str();
    info_.equation = equation_.c_str();
    for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
      const EffectDefinition::Parameter& parameter = definition_.parameters[p];
      info_.parameters.push_back(
          {parameter.name.c_str(), units_[p].c_str(),
           parameter.per_cable ? ParameterShape::per_cable : ParameterShape::scalar,
           parameter.typical, parameter.plausible});
    }
    info_.scope = definition_.scope;
    info_.sentence = definition_.sentence.c_str();
    info_.remedy = definition_.remedy.c_str();
    info_.settle = definition_.settle.c_str();
    info_.one_sided = definition_.one_sided;
    info_.of_load_cells = in_load_cells();
    info_.of_lateness = shows() == Shows::in_motion;
  }

  /// Whether all it does is a straight line in the load cells' readings, wherever the platform is.
  [[nodiscard]] bool in_load_cells() const {
    return std::ranges::all_of(terms_, [&](const Term& term) {
      if (term.target->kind != Kind::tension) return false;
      Names names = random_names(term, 1.0, 0);
      std::array<double, 3> values{};
      for (std::size_t k = 0; k < values.size(); ++k) {
        for (const std::size_t v : term.variables) {
          const std::string_view name = kVariables[v].name;
          if (name != "tension_N" && name != "time_s" && name != "cable") return false;
          if (name != "tension_N") continue;
          names[definition_.parameters.size() + v].a = 50.0 * (1.0 + static_cast<double>(k));
        }
        values[k] = term.formula(std::span<const Slope>(names)).a;
      }
      const double bend = values[0] - 2.0 * values[1] + values[2];
      return std::abs(bend) < 1e-9 * (std::abs(values[0]) + std::abs(values[2]) + 1e-12);
    });
  }

  /// Parameters of so many typical sizes and variables anywhere they may be, all moving along a
  /// random line of each twist component.
  [[nodiscard]] Names random_names(const Term& term, double sizes, unsigned seed) const {
    std::minstd_rand random(seed + 1);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Names names;
    for (std::size_t p = 0; p < definition_.parameters.size(); ++p) {
      const double size = definition_.one_sided ? std::abs(unit(random)) : unit(random);
      names[p] = Slope(sizes * size * definition_.parameters[p].typical, 6 + static_cast<int>(p));
    }
    for (const std::size_t v : term.variables) {
      const Variable& variable = kVariables[v];
      Slope& name = names[definition_.parameters.size() + v];
      name = Slope(variable.low + 0.5 * (unit(random) + 1.0) * (variable.high - variable.low));
      if (std::string_view(variable.name) == "cable") name.a = std::round(name.a);
      if (variable.of != Of::pose) continue;
      for (Eigen::Index k = 0; k < 6; ++k) name.v[k] = unit(random);
    }
    return names;
  }

  /// Zero is absent, values are numbers, derivatives those of differences.
  void try_out() const {
    constexpr unsigned kPlaces = 60;
    for (std::size_t t = 0; t < terms_.size(); ++t) {
      const Term& term = terms_[t];
      const std::string field = "adds." + std::string(term.target->name);
      int off = 0;
      for (unsigned seed = 0; seed < kPlaces; ++seed) {
        const double nothing =
            term.formula(std::span<const Slope>(random_names(term, 0.0, seed))).a;
        if (std::abs(nothing) > 1e-9) {
          throw DefinitionError(field,
                                "must be 0 where all parameters are 0, so that 0 means absent; "
                                "take off what it then is");
        }
        const Names names = random_names(term, 1.0, seed);
        const Slope value = term.formula(std::span<const Slope>(names));
        if (!std::isfinite(value.a) || !value.v.allFinite()) {
          throw DefinitionError(field, "is no finite number" + where(term, names) +
                                           "; guard it, with max or abs for example");
        }
        if (!matches_differences(term, names, value)) ++off;
      }
      // A jump may lie between two points of a difference now and then.
      if (off > static_cast<int>(kPlaces) / 4) {
        throw DefinitionError(field,
                              "jumps or bends almost everywhere, so that its derivatives say "
                              "nothing; write a smoother formula");
      }
    }
  }

  [[nodiscard]] bool matches_differences(const Term& term, const Names& names,
                                         const Slope& value) const {
    for (Eigen::Index k = 0; k < kSlopes; ++k) {
      double scale = 1.0;
      if (k >= 6) {
        const auto p = static_cast<std::size_t>(k - 6);
        if (p >= definition_.parameters.size()) break;
        scale = definition_.parameters[p].typical;
      }
      const auto moved = [&](double step) {
        std::array<double, std::tuple_size_v<Names>> there;
        std::ranges::transform(names, there.begin(),
                               [&](const Slope& name) { return name.a + step * name.v[k]; });
        return term.formula(std::span<const double>(there));
      };
      const double h = 1e-4 * scale;
      const double slope =
          (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
      const double size = std::abs(value.a) + scale * (std::abs(value.v[k]) + std::abs(slope));
      if (!(std::abs(slope - value.v[k]) * scale <= 1e-5 * size + 1e-12)) return false;
    }
    return true;
  }

  [[nodiscard]] std::string where(const Term& term, const Names& names) const {
    std::string text;
    for (const std::size_t v : term.variables) {
      text += (text.empty() ? " at" : ",") +
              printed(" %s = %.3g", kVariables[v].name, names[definition_.parameters.size() + v].a);
    }
    return text;
  }

  EffectDefinition definition_;
  std::string equation_;
  std::vector<std::string> units_;
  EffectInfo info_;
  std::vector<Term> terms_;
};

template <class Table>
std::vector<NamedMeaning> meanings(const Table& table) {
  std::vector<NamedMeaning> out;
  for (const auto& row : table) {
    const std::string meaning = row.meaning;
    out.push_back({row.name, meaning.empty() && !out.empty() ? out.back().meaning : meaning});
  }
  return out;
}

}  // namespace

std::shared_ptr<const Effect> text_effect(const EffectDefinition& definition, Trust trust) {
  return std::make_shared<TextEffect>(definition, trust);
}

const EffectDefinition* definition_of(const Effect& effect) {
  const auto* text = dynamic_cast<const TextEffect*>(&effect);
  return text ? &text->definition() : nullptr;
}

std::optional<FormulaAt> formula_at(const Effect& effect, const EffectContext& context,
                                    const EffectValues& values, int cable) {
  const auto* text = dynamic_cast<const TextEffect*>(&effect);
  return text ? text->first_formula(context, values, cable) : std::nullopt;
}

std::vector<NamedMeaning> formula_variables() { return meanings(kVariables); }
std::vector<NamedMeaning> formula_targets() { return meanings(kTargets); }
std::vector<std::string> formula_functions() { return Expression::function_names(); }

}  // namespace cdprcal
