#include "cdprcal/evidence/steps.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {
namespace {

class StepEffect : public Effect {
 public:
  explicit StepEffect(Step step) : step_(step) {}
  [[nodiscard]] const Step& step() const { return step_; }

 protected:
  [[nodiscard]] bool after(const EffectContext& context) const {
    return context.measurement.run_time_s > step_.time_s;
  }

 private:
  Step step_;
};

/// Of one cable, or of all together.
class CableSlip final : public StepEffect {
 public:
  explicit CableSlip(Step step) : StepEffect(step) {
    info_.name = "cable_slip";
    info_.equation = "dl* = dl + length_m after time_s";
    // As far as a cable slips before anyone hears it.
    info_.parameters = {{.name = "length_m",
                         .unit = "m",
                         .shape = step.cable ? ParameterShape::scalar : ParameterShape::per_cable,
                         .typical = 0.01,
                         .plausible = 0.3,
                         .of = Yardstick::frame}};
    info_.scope = EffectScope::run;
    info_.sentence = step.cable
                         ? "a cable slipped on its drum, unseen by the encoder"
                         : "cables slipped on their drums, or brakes gave, unseen by the encoders";
    info_.remedy = "check the drum's grip; what came before and after are two different references";
    info_.settle = "look at the cable's marks on the drum";
  }
  const EffectInfo& info() const override { return info_; }
  void add_to_readings(const EffectContext& context, const EffectValues& length_m,
                       PoseEvaluation& evaluation) const override {
    if (!after(context)) return;
    if (step().cable) {
      evaluation.length_m[*step().cable] -= length_m[0];
    } else {
      evaluation.length_m -= length_m;
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    if (!after(context)) return;
    const ReadingRows rows{context.state.cable_count};
    if (step().cable) {
      out(rows.length() + *step().cable, 0) = -1.0;
    } else {
      out.middleRows(rows.length(), rows.cables).diagonal().setConstant(-1.0);
    }
  }

 private:
  EffectInfo info_;
};

/// At rest: what changed of the inertia a start-up hardly shows.
class LoadShift final : public StepEffect {
 public:
  using StepEffect::StepEffect;
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "load_shift",
        .equation = "m + dm and s' + ds after time_s",
        .parameters = {{.name = "mass_kg",
                        .unit = "kg",
                        .shape = ParameterShape::scalar,
                        .typical = 0.7,
                        .plausible = 6.0,
                        .of = Yardstick::mass},
                       {.name = "shift_m",
                        .unit = "m",
                        .shape = ParameterShape::vector3,
                        .typical = 0.02,
                        .plausible = 0.15,
                        .of = Yardstick::platform}},
        .scope = EffectScope::run,
        .confused_with = {},
        .sentence = "the platform's load moved, or became another, during the run",
        .remedy = "fix the load; what came before and after are two different platforms",
        .settle = "weigh and level the platform after the run"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& change,
                       PoseEvaluation& evaluation) const override {
    if (!after(context)) return;
    const Vector3 weight_N = context.robot.gravity_force_N();
    const Vector3& arm_m = context.state.centre_of_mass_arm_m;
    const Loaded now(context, change);
    evaluation.wrench.head<3>() -= now.weight_N - weight_N;
    evaluation.wrench.tail<3>() -= now.arm_m.cross(now.weight_N) - arm_m.cross(weight_N);
    evaluation.wrench_by_twist.bottomRightCorner<3, 3>() -=
        skew(now.weight_N) * skew(now.arm_m) - skew(weight_N) * skew(arm_m);
  }
  void columns(const EffectContext& context, const EffectValues& change,
               EffectColumns out) const override {
    if (!after(context)) return;
    const ReadingRows rows{context.state.cable_count};
    const Vector3 up{0.0, 0.0, context.robot.gravity_m_s2};
    const Loaded now(context, change);
    out.col(0).segment<3>(rows.wrench()) = up;
    out.col(0).segment<3>(rows.wrench() + 3) = now.arm_m.cross(up);
    out.block<3, 3>(rows.wrench() + 3, 1) = skew(now.weight_N) * context.state.rotation;
  }

 private:
  struct Loaded {
    Loaded(const EffectContext& context, const EffectValues& change)
        : weight_N(0.0, 0.0, -context.robot.weight_N() - change[0] * context.robot.gravity_m_s2),
          arm_m(context.state.centre_of_mass_arm_m +
                context.state.rotation * change.segment<3>(1)) {}
    Vector3 weight_N, arm_m;
  };
};

/// Until the first move: all that the forces of that rest do not balance by themselves.
class Contact final : public StepEffect {
 public:
  Contact(Step step, const Robot& robot) : StepEffect(step) {
    constexpr double kTypical = 0.15, kPlausible = 1.5;  // of the weight
    const double weight_N = robot.weight_N(), arm_m = characteristic_length_m(robot);
    const auto parameter = [](const char* name, const char* unit, double of) {
      return EffectParameter{.name = name,
                             .unit = unit,
                             .shape = ParameterShape::vector3,
                             .typical = kTypical * of,
                             .plausible = kPlausible * of};
    };
    info_.name = "contact";
    info_.equation = "f + F and a moment M until time_s";
    info_.parameters = {parameter("force_N", "N", weight_N),
                        parameter("moment_Nm", "Nm", weight_N * arm_m)};
    info_.scope = EffectScope::run;
    info_.sentence =
        "something bore the platform before it first moved: it stood on a floor or a stand, or "
        "was held; load cells that warm up look like it";
    info_.remedy = "let the platform hang free, and load cells warm up, before the run begins";
    info_.settle =
        "look whether the platform touches anything, and repeat the run with load cells that have "
        "been on for long";
  }
  const EffectInfo& info() const override { return info_; }
  void add_to_readings(const EffectContext& context, const EffectValues& wrench,
                       PoseEvaluation& evaluation) const override {
    if (!after(context)) evaluation.wrench -= wrench;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    if (after(context)) return;
    out.middleRows<6>(ReadingRows{context.state.cable_count}.wrench()).diagonal().setConstant(-1.0);
  }

 private:
  EffectInfo info_;
};

/// Of one load cell: from a move on; or until the first one, where the cells warm up, or one is
/// pulled harder than it can tell.
class LoadCellShift final : public StepEffect {
 public:
  explicit LoadCellShift(Step step) : StepEffect(step) {
    const bool first = step.parts_a_rest;
    info_.name = "load_cell_shift";
    info_.equation =
        first ? "tau* = tau + bias_N until time_s" : "tau* = tau + bias_N after time_s";
    // As load_cell_bias.
    info_.parameters = {{.name = "bias_N",
                         .unit = "N",
                         .shape = ParameterShape::scalar,
                         .typical = 8.0,
                         .plausible = 60.0,
                         .of = Yardstick::weight}};
    info_.scope = EffectScope::run;
    info_.sentence = first
                         ? "a load cell read too much or too little before the platform first moved"
                         : "the zero of a load cell jumped";
    info_.remedy = first ? "let load cells warm up, and check their range, before the run begins"
                         : "look at the cell, its screws and its plug, and tare it";
    info_.settle = "return to the first pose at the end of the run, and compare the tensions";
    info_.of_load_cells = true;
  }
  const EffectInfo& info() const override { return info_; }
  void correct_tension(const EffectContext& context, const EffectValues& bias_N,
                       CableVector& tension_N) const override {
    if (acts(context)) tension_N[*step().cable] -= bias_N[0];
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    if (!acts(context)) return;
    const ReadingRows rows{context.state.cable_count};
    out.middleRows<6>(rows.wrench()) = -structure_matrix(context.state).col(*step().cable);
  }

 private:
  [[nodiscard]] bool acts(const EffectContext& context) const {
    return after(context) != step().parts_a_rest;
  }
  EffectInfo info_;
};

/// Of one swivel encoder, whose coupling gave.
class SwivelShift final : public StepEffect {
 public:
  explicit SwivelShift(Step step) : StepEffect(step) {
    info_.name = "swivel_shift";
    info_.equation = "sigma* = sigma + angle_rad after time_s";
    info_.parameters = {{.name = "angle_rad",
                         .unit = "rad",
                         .shape = ParameterShape::scalar,
                         .typical = 0.02,
                         .plausible = 0.5}};
    info_.scope = EffectScope::run;
    info_.sentence = "a swivel encoder slipped on its axis";
    info_.remedy = "tighten its coupling; what came before and after are two different references";
    info_.settle = "look at the encoder's marks on its axis";
  }
  const EffectInfo& info() const override { return info_; }
  void add_to_readings(const EffectContext& context, const EffectValues& angle_rad,
                       PoseEvaluation& evaluation) const override {
    if (after(context)) evaluation.swivel_rad[*step().cable] += angle_rad[0];
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    if (after(context))
      out(ReadingRows{context.state.cable_count}.swivel() + *step().cable, 0) = 1.0;
  }

 private:
  EffectInfo info_;
};

/// Of the AHRS: mounted askew from a move on.
class AhrsShift final : public StepEffect {
 public:
  explicit AhrsShift(Step step) : StepEffect(step), info_(askew_->info()) {
    info_.name = "ahrs_shift";
    info_.equation = "R* = R exp(rho) after time_s";
    info_.parameters.front().plausible = 0.5;  // nobody screwed it on so
    info_.scope = EffectScope::run;
    info_.confused_with.clear();
    info_.sentence = "something knocked the attitude sensor askew";
    info_.remedy = "fasten it; what came before and after are two different mountings";
  }
  const EffectInfo& info() const override { return info_; }
  void add_to_readings(const EffectContext& context, const EffectValues& rotation_rad,
                       PoseEvaluation& evaluation) const override {
    if (after(context)) askew_->add_to_readings(context, rotation_rad, evaluation);
  }
  void columns(const EffectContext& context, const EffectValues& rotation_rad,
               EffectColumns out) const override {
    if (after(context)) askew_->columns(context, rotation_rad, out);
  }

 private:
  std::shared_ptr<const Effect> askew_ = find_effect("ahrs_misalignment");
  EffectInfo info_;
};

/// The middle of each move of a run.
std::vector<double> moves_s(const DiagnosisRun& run) {
  std::vector<double> rests_s, out;
  for (const Measurement& m : run.measurements) {
    if (m.kind == PoseKind::static_pose) rests_s.push_back(m.run_time_s);
  }
  std::ranges::sort(rests_s);
  for (std::size_t i = 0; i + 1 < rests_s.size(); ++i) {
    out.push_back(0.5 * (rests_s[i] + rests_s[i + 1]));
  }
  return out;
}

/// The robot whose steps they are.
struct Stepping {
  explicit Stepping(const DiagnosisModel& model)
      : robot(model.robot),
        has_load_cells(reads_tensions(model)),
        swivels_jump(jumps(model, Channel::swivel)),
        attitude_jumps(jumps(model, Channel::roll_pitch)) {}
  explicit Stepping(const Robot& with_all_sensors) : robot(with_all_sensors) {}
  const Robot& robot;
  bool has_load_cells = true, swivels_jump = true, attitude_jumps = true;

 private:
  /// Whether a sensor of the channel may have: a jump that is no noise makes it scatter.
  static bool jumps(const DiagnosisModel& model, Channel channel) {
    return is_read(model, channel) && scatters(model, at_rest(channel));
  }
};

void add_steps(double time_s, const Stepping& of, Candidates& out) {
  const int cables = of.robot.cable_count();
  for (int cable = 0; cable < cables; ++cable) {
    out.push_back(std::make_shared<CableSlip>(Step{.time_s = time_s, .cable = cable}));
  }
  out.push_back(std::make_shared<LoadShift>(Step{.time_s = time_s}));
  if (!of.has_load_cells) return;
  for (int cable = 0; cable < cables; ++cable) {
    out.push_back(std::make_shared<LoadCellShift>(Step{.time_s = time_s, .cable = cable}));
  }
}

/// Of sensors that the others check. calibrate leaves them out of what it allows for at the first
/// move: they hide nothing.
void add_shifts_of_angles(double time_s, const Stepping& of, Candidates& out) {
  for (int cable = 0; of.swivels_jump && cable < of.robot.cable_count(); ++cable) {
    out.push_back(std::make_shared<SwivelShift>(Step{.time_s = time_s, .cable = cable}));
  }
  if (of.attitude_jumps) out.push_back(std::make_shared<AhrsShift>(Step{.time_s = time_s}));
}

/// What only the first move of a run is likely to do.
void add_first(double time_s, const Stepping& of, Candidates& out) {
  const Step of_all{.time_s = time_s, .parts_a_rest = true};
  out.push_back(std::make_shared<CableSlip>(of_all));
  out.push_back(std::make_shared<Contact>(of_all, of.robot));
  if (!of.has_load_cells) return;
  for (int cable = 0; cable < of.robot.cable_count(); ++cable) {
    out.push_back(std::make_shared<LoadCellShift>(
        Step{.time_s = time_s, .cable = cable, .parts_a_rest = true}));
  }
}

}  // namespace

Candidates step_candidates(const DiagnosisModel& model) {
  std::set<double> all_s, first_s;  // once where runs share one
  for (const DiagnosisRun& run : model.runs) {
    const std::vector<double> own_s = moves_s(run);
    all_s.insert(own_s.begin(), own_s.end());
    if (!own_s.empty()) first_s.insert(own_s.front());
  }
  const Stepping of(model);
  Candidates out;
  for (const double time_s : all_s) {
    add_steps(time_s, of, out);
    add_shifts_of_angles(time_s, of, out);
  }
  for (const double time_s : first_s) add_first(time_s, of, out);
  return out;
}

Candidates kinds_of_steps(const Robot& robot) {
  Candidates out;
  add_steps(0.0, Stepping(robot), out);
  add_shifts_of_angles(0.0, Stepping(robot), out);
  add_first(0.0, Stepping(robot), out);
  std::erase_if(out, [](const auto& step) { return as_step(*step)->cable.value_or(0) > 0; });
  return out;
}

Candidates steps_beside(const DiagnosisModel& model, const Effect& step) {
  const Step at = *as_step(step);
  Candidates out = step_candidates(model);
  std::erase_if(out, [&](const auto& other) {
    const Step its = *as_step(*other);
    return its.time_s != at.time_s || (other->name() == step.name() && its.cable == at.cable &&
                                       its.parts_a_rest == at.parts_a_rest);
  });
  return out;
}

std::vector<CandidateScore> first_step_scores(const DiagnosisModel& model) {
  const std::vector<double> all_s = moves_s(model.runs.front());
  if (all_s.empty()) return {};
  const Stepping of(model);
  Candidates first;
  add_steps(all_s.front(), of, first);
  add_first(all_s.front(), of, first);
  std::vector<CandidateScore> out = scan(model, first, {.draws = 0});
  const auto kinds = static_cast<double>(first.size()), moves = static_cast<double>(all_s.size());
  for (CandidateScore& score : out) {
    // What parts the first rest happens at no other move.
    score.log_evidence -= std::log(kinds * (as_step(*score.effect)->parts_a_rest ? 1.0 : moves));
  }
  return out;
}

std::optional<Step> as_step(const Effect& effect) {
  const auto* step = dynamic_cast<const StepEffect*>(&effect);
  return step ? std::optional(step->step()) : std::nullopt;
}

}  // namespace cdprcal
