// A physical effect that the ideal model leaves out: what it does to the robot and to its readings.
//
// An effect is one file in this folder: a class, its EffectInfo and a factory; catalogue.cpp has
// one row for it. Everything else (calibration, scan, refit, reports, robot file) follows from
// these.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "cdprcal/effects/parameter.hpp"
#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/model/yardstick.hpp"

namespace cdprcal {

/// One parameter as people and files see it. Its zero means: the effect is absent (for a stiffness,
/// see EffectInfo::inverse).
struct EffectParameter {
  const char* name;  ///< with the unit as suffix: "bias_N"
  const char* unit;  ///< "N", "m", "rad", "1" …
  ParameterShape shape;
  double typical;    ///< size to expect on irma4, internal units: one σ of the prior
  double plausible;  ///< largest |value| that is physically believable there, internal units
  Yardstick of = Yardstick::none;      ///< with which both grow from robot to robot
  ValueRange range = ValueRange::any;  ///< of a machine that has it, as files have it
};

/// What it takes for readings to show an effect: any, those of a moving platform, or the balance in
/// motion too.
enum class Shows { at_rest, in_motion, in_moving_balance };

/// Whether a robot keeps the effect from one run to the next.
enum class EffectScope { robot, run };

struct EffectInfo {
  const char* name;
  const char* equation;
  std::vector<EffectParameter> parameters;
  EffectScope scope;
  std::vector<const char*> confused_with;  ///< effects of the catalogue
  const char* sentence;                    ///< for people: what it is
  const char* remedy;                      ///< for people: what to do about it on the robot
  const char* settle;                      ///< what measurement would tell it from its rivals
  // Properties that others ask for, in place of its name
  bool inverse = false;    ///< files have the values' inverse: no effect is an infinite stiffness
  bool one_sided = false;  ///< nature has it in one sign only
  bool of_load_cells = false;  ///< in the readings of the load cells, not in what cables carry
  /// What smoothing does to accelerations looks alike: fitted where asked for, never searched for.
  bool on_request = false;
  /// There or not (a slip of whoever wrote the robot file, a hose), not a deviation that every
  /// robot has a little of: looked for and counted by its probability, not allowed for where
  /// nothing speaks for it.
  bool all_or_nothing = false;
  bool of_swivel_play = false;  ///< its value is what Measurement::swivel_direction depends on
  bool of_one_make = false;     ///< one cause may give all cables nearly the same value
  bool of_lateness = false;     ///< readings of one moment of a log belong to different ones
};

/// What an effect may look at.
struct EffectContext {
  const Robot& robot;
  const PlatformState& state;
  const Pose& pose;
  const Measurement& measurement;
  /// Tensions at the platform, as all effects of the model make them of the readings: what pulls
  /// where `columns` moves a cable.
  const CableVector& tension_N = measurement.tension_N;
};

/// Rows of derivative columns: lengths (n), swivels (n), roll pitch yaw (3), wrench (6), specific
/// force at rest (3).
struct ReadingRows {
  int cables;
  [[nodiscard]] int length() const { return 0; }
  [[nodiscard]] int swivel() const { return cables; }
  [[nodiscard]] int attitude() const { return 2 * cables; }
  [[nodiscard]] int wrench() const { return 2 * cables + 3; }
  [[nodiscard]] int specific_force() const { return 2 * cables + 9; }
  [[nodiscard]] int size() const { return 2 * cables + 12; }
};

using EffectValues = Eigen::VectorXd;
using EffectColumns = Eigen::Ref<Eigen::MatrixXd>;

class Effect {
 public:
  virtual ~Effect() = default;
  [[nodiscard]] virtual const EffectInfo& info() const = 0;
  [[nodiscard]] std::string name() const { return info().name; }

  /// Number of internal values on a robot with n cables.
  [[nodiscard]] int size(int cables) const;
  /// Prior σ, and plausible bound, of each value on a robot: of robots like it, or as large as the
  /// robot file says.
  [[nodiscard]] EffectValues typical(const Robot& robot) const;
  [[nodiscard]] EffectValues plausible(const Robot& robot) const;
  /// σ of each value by the robot file, which so says that the effect is there; NaN where it says
  /// nothing, empty for effects of which it never does.
  [[nodiscard]] virtual EffectValues stated_sigma(const Robot&) const { return {}; }
  [[nodiscard]] bool is_stated(const Robot& robot) const;

  /// Geometry and inertia: changes the robot itself.
  virtual void apply(const EffectValues&, Robot&) const {}
  /// Whether apply() moves a cable's path: whole lengths then change with the readings of the
  /// drums.
  [[nodiscard]] virtual bool moves_cables() const { return false; }
  /// Adds to `tension_N`, which starts as the load cells' readings and shall become the tensions
  /// at the platform. Effects add up: each looks at the readings, not at one another.
  virtual void correct_tension(const EffectContext&, const EffectValues&, CableVector&) const {}
  /// Adds to the predicted readings (and to their derivatives by twist) what the effect does.
  virtual void add_to_readings(const EffectContext&, const EffectValues&, PoseEvaluation&) const {}
  /// Derivatives of predicted readings and of the wrench balance with respect to the values,
  /// ReadingRows × size. Comes zeroed.
  virtual void columns(const EffectContext&, const EffectValues&, EffectColumns) const = 0;

  /// Internal values ↔ what people and files see (EffectInfo::inverse). `reported_deviation` maps
  /// standard deviations at `values`.
  [[nodiscard]] EffectValues to_reported(const EffectValues& values) const;
  [[nodiscard]] EffectValues from_reported(const EffectValues& reported) const {
    return to_reported(reported);
  }
  [[nodiscard]] EffectValues reported_deviation(const EffectValues& values,
                                                const EffectValues& deviation) const;
  /// Of each value, the group whose prior's width is learnt from the group, as noise is from
  /// residuals; empty: all have typical widths.
  [[nodiscard]] virtual std::vector<int> learnt_widths(int) const { return {}; }
  /// Of each of these groups, how wide it is at the most; empty: any width.
  [[nodiscard]] virtual std::vector<double> widest() const { return {}; }
  /// What shows it: not every effect shows at rest.
  [[nodiscard]] virtual Shows shows() const { return Shows::at_rest; }
  [[nodiscard]] bool needs_motion() const { return shows() != Shows::at_rest; }
};

/// An effect with its internal values, as part of a model.
struct ActiveEffect {
  std::shared_ptr<const Effect> effect;
  EffectValues values;
};
using ActiveEffects = std::vector<ActiveEffect>;

/// Load cells' readings as effects correct them: the tensions at the platform.
CableVector corrected_tension_N(const EffectContext& context, const ActiveEffects& effects,
                                const CableVector& reading_N);

/// Of a platform's mass: no effect leaves less of it.
inline constexpr double kLeastMassShare = 1e-4;

/// The robot with the geometry and inertia changes of all effects.
Robot with_effects(const Robot& robot, const ActiveEffects& effects);

/// Of one cable, 0 where nobody knows (empty).
inline double value_or_zero(const CableVector& values, int cable) {
  return values.size() > cable ? values[cable] : 0.0;
}

/// ∂(Ξᵀτ)/∂θ for tensions that change by `tension_by_value` (n × p); NaN: nobody reads it.
Eigen::MatrixXd wrench_by_tension(const PlatformState& state,
                                  const Eigen::MatrixXd& tension_by_value);

}  // namespace cdprcal
