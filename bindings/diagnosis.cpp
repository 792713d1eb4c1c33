// diagnosis/ and effects/: the catalogue as data, and what the model lacks.
#include "cdprcal/diagnosis/compare.hpp"
#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/diagnosis/foresight.hpp"
#include "cdprcal/diagnosis/separation.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/robot_file/effect_definitions.hpp"

#include <pybind11/typing.h>

#include <optional>

#include "bindings.hpp"
#include "cdprcal/diagnosis/model_residuals.hpp"
#include "cdprcal/readings/run.hpp"
#include "people.hpp"

namespace cdprcal::python {
namespace {

/// An effect, and one of its parameters: what they say lives as long as the effect does.
struct EffectRow {
  std::shared_ptr<const Effect> effect;
  [[nodiscard]] const EffectInfo& info() const { return effect->info(); }
};
struct ParameterRow : EffectParameter {
  std::shared_ptr<const Effect> effect;
};

std::vector<EffectRow> rows_of(const Candidates& effects) {
  std::vector<EffectRow> rows;
  for (const auto& effect : effects) rows.push_back({effect});
  return rows;
}

/// A property of EffectInfo's text.
auto text(const char* EffectInfo::* member) {
  return [member](const EffectRow& row) { return std::string(row.info().*member); };
}

void register_catalogue(py::module_& module) {
  WordEnum<ParameterShape>(module, "ParameterShape",
                           "How many numbers a parameter has: 1, n, 3 or n × 3.")
      .value("scalar", ParameterShape::scalar)
      .value("per_cable", ParameterShape::per_cable)
      .value("vector3", ParameterShape::vector3)
      .value("per_cable_vector3", ParameterShape::per_cable_vector3)
      .finalize();
  WordEnum<EffectScope>(module, "EffectScope",
                        "robot: the same in every run; run: differs from run to run.")
      .value("robot", EffectScope::robot)
      .value("run", EffectScope::run)
      .finalize();
  WordEnum<Shows>(module, "Shows",
                  "What it takes for readings to show an effect: at_rest: any readings; in_motion: "
                  "those of a platform that moves; in_moving_balance: the balance of forces and "
                  "inertia there (diagnose with motion).")
      .value("at_rest", Shows::at_rest)
      .value("in_motion", Shows::in_motion)
      .value("in_moving_balance", Shows::in_moving_balance)
      .finalize();
  py::class_<ParameterRow>(module, "EffectParameter", "One parameter of an effect.")
      .def_property_readonly(
          "name", [](const ParameterRow& p) { return std::string(p.name); },
          "Key in the robot file, with the unit as suffix.")
      .def_property_readonly("unit", [](const ParameterRow& p) { return std::string(p.unit); })
      .def_readonly("shape", &ParameterRow::shape)
      .def_readonly("typical", &ParameterRow::typical,
                    "Size to expect on the reference robot, irma4: one sigma of the prior. Of the "
                    "internal value: for a stiffness, of its inverse.")
      .def_readonly("plausible", &ParameterRow::plausible,
                    "Largest size that is believable there; internal value as `typical`.")
      .def_property_readonly(
          "of", [](const ParameterRow& p) { return std::string(in_words(p.of)); },
          "What a size, as files have it, grows with from robot to robot; empty: it is the same on "
          "every robot.")
      .def(
          "times_reference",
          [](const ParameterRow& p, const Robot& robot) { return times_reference(p.of, robot); },
          py::arg("robot"), "How many times as large both are on this robot.");
  py::class_<EffectRow>(module, "EffectInfo", "One effect: of the catalogue, or a robot's own.")
      .def_property_readonly("name", text(&EffectInfo::name))
      .def_property_readonly("equation", text(&EffectInfo::equation), "measured = …")
      .def_property_readonly("parameters",
                             [](const EffectRow& row) {
                               std::vector<ParameterRow> parameters;
                               for (const EffectParameter& p : row.info().parameters) {
                                 parameters.push_back({p, row.effect});
                               }
                               return parameters;
                             })
      .def_property_readonly("scope", [](const EffectRow& row) { return row.info().scope; })
      .def_property_readonly(
          "confused_with",
          [](const EffectRow& row) {
            return std::vector<std::string>(row.info().confused_with.begin(),
                                            row.info().confused_with.end());
          },
          "Names of effects that look alike.")
      .def_property_readonly("sentence", text(&EffectInfo::sentence), "For people: what it is.")
      .def_property_readonly("remedy", text(&EffectInfo::remedy),
                             "For people: what to do about it on the robot.")
      .def_property_readonly("settle", text(&EffectInfo::settle),
                             "What measurement would tell it from its rivals.")
      .def_property_readonly(
          "inverse", [](const EffectRow& row) { return row.info().inverse; },
          "The robot file has the inverse of the internal values: a stiffness.")
      .def_property_readonly(
          "one_sided", [](const EffectRow& row) { return row.info().one_sided; },
          "Nature has it in one sign only.")
      .def_property_readonly(
          "on_request", [](const EffectRow& row) { return row.info().on_request; },
          "Fitted where DiagnoseOptions.effects name it, never searched for: other things look "
          "alike.")
      .def_property_readonly(
          "all_or_nothing", [](const EffectRow& row) { return row.info().all_or_nothing; },
          "There or not (a slip of whoever wrote the robot file, a hose), not a deviation that "
          "every robot has a little of.")
      .def_property_readonly("shows", [](const EffectRow& row) { return row.effect->shows(); })
      .def_property_readonly(
          "formulas",
          [](const EffectRow& row) {
            std::map<std::string, std::string> formulas;
            if (const EffectDefinition* text = definition_of(*row.effect)) {
              for (const auto& [to, formula] : text->adds) formulas[to] = formula;
            }
            return formulas;
          },
          "What it adds, by what it adds to, of an effect written as text; else empty.")
      .def("__repr__", [](const EffectRow& row) {
        return "EffectInfo(name='" + std::string(row.info().name) + "')";
      });
  module.def(
      "effect_catalogue", [] { return rows_of(effect_catalogue()); },
      "All effects the project knows, as a list of EffectInfo.");
  module.def(
      "effects_of", [](const Robot& robot) { return rows_of(effects_of(robot)); }, py::arg("robot"),
      "The catalogue, then the robot's own effects: those of its file's text.");
  module.def(
      "steps_of", [](const Robot& robot) { return rows_of(kinds_of_steps(robot)); },
      py::arg("robot"),
      "What happens once, as diagnose names it: a list of EffectInfo, several of one name.");
  module.def(
      "with_effect_definitions",
      [](const Robot& robot, const std::string& yaml_text, const std::string& source) {
        return with_own_effects(robot, parse_effects(yaml_text, source));
      },
      py::arg("robot"), py::arg("yaml_text"), py::arg("source"),
      "The robot with the effects that a text defines, beside its own; `source` is what messages "
      "call it. Raises InputError 'source:line:column: field: …'.");
  module.def(
      "formula_words",
      [] {
        std::map<std::string, std::map<std::string, std::string>> words;
        for (const NamedMeaning& row : formula_variables())
          words["variables"][row.name] = row.meaning;
        for (const NamedMeaning& row : formula_targets()) words["targets"][row.name] = row.meaning;
        for (const std::string& name : formula_functions()) words["functions"][name];
        return words;
      },
      "What formulas of effects may name ('variables') and add to ('targets'): word and meaning; and "
      "'functions'.");
  module.def(
      "with_known_effects",
      [](const Robot& robot, const Log& log) {
        check_belongs(robot, log);
        KnownState known = with_known_effects(robot, log);
        return std::pair(std::move(known.robot), std::move(known.log));
      },
      py::arg("robot"), py::arg("log"),
      "Robot and log with all that the robot lists for that log taken into account: faults of the "
      "readings set right, geometry and inertia changed, tensions without what the load cells add. "
      "For whoever looks at readings without a model. Raises InputError when the log is another "
      "robot's.");
}

void register_findings(py::module_& module) {
  WordEnum<Verdict>(module, "Verdict",
                    "consistent: nothing is missing; explained: the named effects explain "
                    "it; described: a formula does, no name; unexplained: something is left that "
                    "no effect explains; "
                    "undetermined: too little was measured to say, or progress stopped it.")
      .value("consistent", Verdict::consistent)
      .value("explained", Verdict::explained)
      .value("unexplained", Verdict::unexplained)
      .value("undetermined", Verdict::undetermined)
      .value("described", Verdict::described)
      .finalize();
  py::class_<DiscreteFault>(module, "DiscreteFault",
                            "A sign, an order, a unit or a convention that was wrong.")
      .def_readonly("name", &DiscreteFault::name)
      .def_readonly("parameter", &DiscreteFault::parameter)
      .def_readonly("values", &DiscreteFault::values)
      .def_readonly("rivals", &DiscreteFault::rivals,
                    "Other faults with which the readings agree as well, and the initial pose is "
                    "another.")
      .def_readonly("swivel_order", &DiscreteFault::swivel_order,
                    "Of a cable_order: the same for the swivel encoders; empty where it is "
                    "`values`.")
      .def_readonly("tension_order", &DiscreteFault::tension_order,
                    "Of a cable_order: the load cells' where it differs from the encoders'; else "
                    "empty.")
      .def_readonly("log_evidence", &DiscreteFault::log_evidence,
                    "Nats, of one found beside effects; NaN of one found before any.")
      .def_readonly("convention", &DiscreteFault::convention,
                    "Of an euler_convention: the right one; else None.")
      .def_readonly("text", &DiscreteFault::text, "One phrase for people.");
  module.def(
      "find_discrete_faults",
      [](Robot robot, Log log) {
        return find_discrete_faults(robot, log, false, [](const std::string&) {
          const py::gil_scoped_acquire lock;
          if (PyErr_CheckSignals() != 0) throw py::error_already_set();
          return true;
        });
      },
      py::call_guard<py::gil_scoped_release>(), py::arg("robot"), py::arg("log"),
      "The signs, orders, units and conventions that are wrong in a log, in the order found; none "
      "of a log that agrees with the robot. Raises InputError for a log that does not fit it.");
  py::class_<NamedEffect>(module, "NamedEffect", "An effect that was accepted.")
      .def_property_readonly("info", [](const NamedEffect& e) { return EffectRow{e.effect}; })
      .def_property_readonly(
          "values", [](const NamedEffect& e) { return e.values; },
          "In reported units, parameter after parameter; of an effect of the run, for each log in "
          "turn.")
      .def_property_readonly(
          "standard_deviation", [](const NamedEffect& e) { return e.standard_deviation; },
          "Of each value.")
      .def_readonly("described", &NamedEffect::described,
                    "A formula that the search wrote, not a name.")
      .def_readonly("log_evidence", &NamedEffect::log_evidence, "Against its absence [nat].")
      .def_readonly("p_value", &NamedEffect::p_value, "Family-wise.")
      .def_readonly("rivals", &NamedEffect::rivals, "What these poses cannot tell it from.")
      .def_property_readonly(
          "where",
          [](const NamedEffect& e) {
            py::typing::Dict<py::str, py::float_> where;
            for (const auto& [name, value] : e.where) where[py::str(name)] = value;
            return where;
          },
          "Of a step (cable_slip, load_cell_shift, swivel_shift …): time_s since the run's first "
          "sample, and of a cable's the cable from 1.")
      .def_readonly("held_out_before", &NamedEffect::held_out_before,
                    "½ Σ (residual/σ)² a held-out pose without the effect.")
      .def_readonly("held_out_after", &NamedEffect::held_out_after, "The same with it.");
  py::class_<RejectedEffect>(module, "RejectedEffect", "An effect that was not accepted, and why.")
      .def_readonly("name", &RejectedEffect::name)
      .def_readonly("reason", &RejectedEffect::reason);
  py::class_<Unexplained>(module, "Unexplained", "What no effect of the catalogue explains.")
      .def_readonly("channel", &Unexplained::channel)
      .def_readonly("rms", &Unexplained::rms, "Of what is left, in the channel's unit.")
      .def_readonly("sigma", &Unexplained::sigma, "Of the readings' own ripple.")
      .def_readonly("depends_on", &Unexplained::depends_on)
      .def_readonly("cable", &Unexplained::cable,
                    "The only one that depends so, from 0; -1: several, or of no cable.");
  py::class_<Wandering>(module, "Wandering",
                        "Errors of a channel that wander with time: counted as noise.")
      .def_readonly("channel", &Wandering::channel)
      .def_readonly("rms", &Wandering::rms, "Over the rests; m, rad or N.")
      .def_readonly("sigma", &Wandering::sigma, "The robot file's, in the same unit.");
  py::class_<OwnErrors>(module, "OwnErrors",
                        "Errors of one sensor, anew at every rest, beyond those of its like: "
                        "counted as noise.")
      .def_readonly("column", &OwnErrors::column, "As a log calls it: ``length_3_m``.")
      .def_readonly("rms", &OwnErrors::rms, "Over the rests, in the column's unit.")
      .def_readonly("like", &OwnErrors::like, "The noise of its like, in the same unit.")
      .def_readonly("sigma", &OwnErrors::sigma, "The robot file's, in the same unit.")
      .def_readonly("at_s", &OwnErrors::at_s,
                    "Since the run's first sample: the one rest at which it is off. NaN: several.");
  py::class_<Discrepancy>(
      module, "Discrepancy",
      "What the model lacks and nobody could name or describe, as a smooth "
      "function of the place (Kennedy and O'Hagan, 2001) that takes part in the "
      "covariance of the pose and in the effects' standard deviations.")
      .def_readonly("reach_m", &Discrepancy::reach_m,
                    "As far apart as two places are whose errors differ; NaN where it is empty.")
      .def_readonly("channels", &Discrepancy::channels,
                    "Wandering, by channel: what stands out of the noise.");
  py::class_<Gap>(module, "Gap", "Residuals of one channel after one step.")
      .def_readonly("after_effect", &Gap::after_effect, "Empty before any.")
      .def_readonly("channel", &Gap::channel)
      .def_readonly("train_rms", &Gap::train_rms, "On the poses that the model was fitted on.")
      .def_readonly("held_out_rms", &Gap::held_out_rms, "On the poses left out of the fit.");
  py::class_<Identifiability>(module, "Identifiability", "What a log could see of an effect.")
      .def_readonly("name", &Identifiability::name)
      .def_readonly("visible", &Identifiability::visible)
      .def_readonly("detectable_after", &Identifiability::detectable_after,
                    "The same with the accepted effects in the model.")
      .def_readonly("detectable", &Identifiability::detectable,
                    "Smallest size that would show, in typical sizes.");
}

void register_diagnosis_path(py::module_& module) {
  py::class_<PathState>(module, "PathState",
                        "From which side each cable and swivel came to where it is, row by row.")
      .def_readonly("length_direction", &PathState::length_direction,
                    "[N, n] s in [-1, 1]: +1 after paying out.")
      .def_readonly("swivel_direction", &PathState::swivel_direction,
                    "[N, n] the same for the swivels; +1 after a positive turn.")
      .def_readonly("length_rate_m_s", &PathState::length_rate_m_s, "[N, n] slopes over 0.6 s.")
      .def_readonly("swivel_rate_rad_s", &PathState::swivel_rate_rad_s, "[N, n] the same.")
      .def_readonly("attitude_rate_rad_s", &PathState::attitude_rate_rad_s,
                    "[N, 3] of roll, pitch, yaw.");
  module.def("path_state", &path_state, py::arg("robot"), py::arg("log"),
             py::arg("smoothing_s") = 1.0, py::call_guard<py::gil_scoped_release>(),
             "Directions of motion of a log of a robot: what hysteresis and delays depend on.");
}

void register_models(py::module_& module) {
  py::class_<DiagnosisModel>(module, "DiagnosisModel", "A fitted model of a robot's runs.")
      .def_property_readonly("pose_count", &DiagnosisModel::pose_count)
      .def_property_readonly("run_names",
                             [](const DiagnosisModel& model) {
                               std::vector<std::string> names;
                               for (const DiagnosisRun& run : model.runs) names.push_back(run.name);
                               return names;
                             })
      .def_readonly("noise", &DiagnosisModel::noise,
                    "Estimated noise of length [m], swivel, roll and pitch, yaw [rad], and of the "
                    "balance [in sigma of the load cells].")
      .def_readonly("floor", &DiagnosisModel::floor, "The readings' own ripple, as `noise`.");
  py::class_<ModelResidual>(module, "ModelResidual", "What a model leaves at one pose.")
      .def_readonly("run", &ModelResidual::run, "From 0.")
      .def_readonly("run_time_s", &ModelResidual::run_time_s, "Since the run's first sample.")
      .def_readonly("residual", &ModelResidual::residual,
                    "tension_N: the smallest change of tensions that would balance the platform.");
  module.def("model_residuals", &model_residuals, py::arg("model"),
             py::call_guard<py::gil_scoped_release>(),
             "A ModelResidual for each pose of each run.");
  py::class_<CoursePoint>(module, "CoursePoint", "A formula at one pose, and what was read there.")
      .def_readonly("run", &CoursePoint::run, "From 0.")
      .def_readonly("cable", &CoursePoint::cable, "From 0; -1: of all cables.")
      .def_readonly("x", &CoursePoint::x, "The variable.")
      .def_readonly("added", &CoursePoint::added, "By the formula.")
      .def_readonly("read", &CoursePoint::read, "Reading - model without the formula.");
  py::class_<Course>(module, "Course", "A formula against the first of its variables.")
      .def_readonly("to", &Course::to, "What it adds to.")
      .def_readonly("variable", &Course::variable)
      .def_readonly("points", &Course::points);
  module.def(
      "formula_course", &formula_course, py::arg("model"), py::arg("effect"),
      py::call_guard<py::gil_scoped_release>(),
      "Of one of a model's effects, counted from 0; None unless it is a formula for readings. "
      "Raises InputError for one that the model does not have.");
  py::class_<CandidateScore>(module, "CandidateScore", "How well one effect would explain a gap.")
      .def_property_readonly("name", [](const CandidateScore& s) { return s.effect->name(); })
      .def_readonly("log_evidence", &CandidateScore::log_evidence, "Against its absence [nat].")
      .def_readonly("p_value", &CandidateScore::p_value, "Family-wise.")
      .def_readonly("visible", &CandidateScore::visible)
      .def_readonly("detectable", &CandidateScore::detectable, "In typical sizes.");
  module.def(
      "scan",
      [](const DiagnosisModel& model) {
        Candidates candidates = effects_of(model.robot);
        std::erase_if(candidates, [](const auto& effect) { return effect->needs_motion(); });
        return scan(model, candidates);
      },
      py::arg("model"), py::call_guard<py::gil_scoped_release>(),
      "Scores of all effects that rest can show on what a model leaves, best first; nothing is "
      "refitted.");
}

using Progress = std::optional<py::function>;

/// Asks Python between two steps: Ctrl-C ends the diagnosis, and so does a callback's False.
bool go_on(const Progress& progress, const std::string& step) {
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  return !progress || !(*progress)(step).is(py::bool_(false));
}

/// diagnose or compare, with options and progress as Python gives them.
template <class Result>
auto of_logs(Result (*work)(const Robot&, const std::vector<Log>&, const DiagnoseOptions&)) {
  return [work](const Robot& robot, const std::vector<Log>& logs,
                const std::optional<DiagnoseOptions>& options, const Progress& progress) {
    DiagnoseOptions used = options.value_or(DiagnoseOptions{});
    used.progress = [&progress](const std::string& step) { return go_on(progress, step); };
    const py::gil_scoped_release release;
    return work(robot, logs, used);
  };
}

void register_diagnose(py::module_& module) {
  const DiagnoseOptions usual;
  py::class_<DiagnoseOptions>(module, "DiagnoseOptions", "When an effect is accepted.")
      .def(py::init([](double family_wise_p, double least_evidence, double rival_nats,
                       double rival_share, int most_effects, int refits, int draws,
                       std::uint64_t seed, std::optional<std::vector<std::string>> effects,
                       std::optional<std::vector<DiscreteFault>> faults, bool motion) {
             DiagnoseOptions o;
             o.family_wise_p = family_wise_p;
             o.least_evidence = least_evidence;
             o.rival_nats = rival_nats;
             o.rival_share = rival_share;
             o.most_effects = most_effects;
             o.refits = refits;
             o.scan.draws = draws;
             o.scan.seed = seed;
             o.effects = std::move(effects);
             o.faults = std::move(faults);
             o.motion = motion;
             return o;
           }),
           py::kw_only(), py::arg("family_wise_p") = usual.family_wise_p,
           py::arg("least_evidence") = usual.least_evidence,
           py::arg("rival_nats") = usual.rival_nats, py::arg("rival_share") = usual.rival_share,
           py::arg("most_effects") = usual.most_effects, py::arg("refits") = usual.refits,
           py::arg("draws") = usual.scan.draws, py::arg("seed") = usual.scan.seed,
           py::arg("effects") = py::none(), py::arg("faults") = py::none(),
           py::arg("motion") = usual.motion,
           "family_wise_p: chance that a clean log is accused of anything. least_evidence, "
           "rival_nats [nat]. rival_share: of a signature that a rival imitates. refits: "
           "candidates refitted a round. draws, seed: of the chance residuals behind p-values. "
           "effects: names to fit in this order with no search, None to search; the verdict is "
           "then no better than undetermined. faults: those of an earlier diagnosis of these logs, "
           "set right with no search; None to look for them. motion: moments at which the platform "
           "moves count as rests do, all along a log that never rests.")
      .def_readwrite("family_wise_p", &DiagnoseOptions::family_wise_p)
      .def_readwrite("least_evidence", &DiagnoseOptions::least_evidence)
      .def_readwrite("rival_nats", &DiagnoseOptions::rival_nats)
      .def_readwrite("rival_share", &DiagnoseOptions::rival_share)
      .def_readwrite("most_effects", &DiagnoseOptions::most_effects)
      .def_readwrite("refits", &DiagnoseOptions::refits)
      .def_property(
          "draws", [](const DiagnoseOptions& o) { return o.scan.draws; },
          [](DiagnoseOptions& o, int draws) { o.scan.draws = draws; })
      .def_property(
          "seed", [](const DiagnoseOptions& o) { return o.scan.seed; },
          [](DiagnoseOptions& o, std::uint64_t seed) { o.scan.seed = seed; })
      .def_readwrite("motion", &DiagnoseOptions::motion,
                     "Whether moments of motion count as rests do.")
      .def_readwrite("effects", &DiagnoseOptions::effects,
                     "Names to fit with no search; None: search.")
      .def_readwrite("faults", &DiagnoseOptions::faults,
                     "Set right with no search; None: looked for.");
  py::class_<Diagnosis> cls(module, "Diagnosis", "What the model lacks. Look at verdict first.",
                            py::dynamic_attr());
  cls.def_readonly("verdict", &Diagnosis::verdict)
      .def_readonly("reason", &Diagnosis::reason, "One sentence for people.")
      .def_readonly("faults", &Diagnosis::faults, "DiscreteFault, in the order found.")
      .def_readonly("effects", &Diagnosis::effects, "NamedEffect, in the order accepted.")
      .def_readonly("rejected", &Diagnosis::rejected)
      .def_readonly("unexplained", &Diagnosis::unexplained)
      .def_readonly("misfit", &Diagnosis::misfit,
                    "By what the readings misfit although nothing was found, where that may well "
                    "be an effect; else empty.")
      .def_readonly("wandering", &Diagnosis::wandering,
                    "Wandering, by channel. Empty: errors come anew at every rest.")
      .def_readonly("own_errors", &Diagnosis::own_errors,
                    "OwnErrors of single sensors. Empty: all of a channel are alike.")
      .def_readonly(
          "discrepancy", &Diagnosis::discrepancy,
          "Its channels are empty where nothing is left, or nothing that changes with the "
          "place.")
      .def_readonly("gap", &Diagnosis::gap, "Before any effect and after each.")
      .def_readonly("identifiability", &Diagnosis::identifiability)
      .def_readonly("ranking", &Diagnosis::ranking,
                    "CandidateScore of all effects on the baseline, best first; their p_value is "
                    "not drawn.")
      .def_readonly("next", &Diagnosis::next, "What would settle a tie, for people.")
      .def_readonly("gated", &Diagnosis::gated, "Readings left out, for people.")
      .def_readonly("initial_pose_before", &Diagnosis::initial_pose_before,
                    "Of the first log; calibrate's where one log is consistent.")
      .def_readonly("initial_pose_after", &Diagnosis::initial_pose_after,
                    "Of the first log; calibrate's where one log is consistent.")
      .def_readonly("covariance_before", &Diagnosis::covariance_before,
                    "[6, 6] position [m], world-frame rotation vector [rad].")
      .def_readonly("covariance_after", &Diagnosis::covariance_after, "As covariance_before.")
      .def_readonly("baseline", &Diagnosis::baseline, "Fitted before any effect.")
      .def_readonly("model", &Diagnosis::model, "Fitted with the effects.")
      .def_readonly("corrected", &Diagnosis::corrected,
                    "The robot with what was found; to_yaml writes it as a robot file.");
  def_repr(cls);
  def_people(cls, "A pandas.DataFrame: a row a number that was found, with its deviation and unit.",
             true);
  module.def("diagnose", of_logs(&diagnose), py::arg("robot"), py::arg("logs"),
             py::arg("options") = py::none(), py::arg("progress") = py::none(),
             "Names what the model lacks, from one or more logs of one robot. `progress` is called "
             "with each step's name; False ends the search and keeps what was found. Ctrl-C is "
             "noticed between steps. Raises InputError for a log that does not fit the robot.");
}

void register_separation(py::module_& module) {
  py::class_<StopSeparation>(module, "StopSeparation",
                             "Expected evidence between an effect and its rival [nat].")
      .def_readonly("nats", &StopSeparation::nats, "By the log so far.")
      .def_readonly("nats_with", &StopSeparation::nats_with, "With each of the stops.")
      .def_readonly("nats_with_all", &StopSeparation::nats_with_all)
      .def_readonly("apart_with_all", &StopSeparation::apart_with_all,
                    "Whether a diagnosis with all of them would not call it a rival any more.");
  module.def(
      "separation_by_stops",
      [](const Diagnosis& diagnosis, std::size_t effect, const std::string& rival,
         const std::vector<Pose>& poses, const std::vector<Eigen::VectorXd>& tensions_N) {
        if (effect >= diagnosis.effects.size()) {
          throw InputError("separation_by_stops: effect " + std::to_string(effect) + " of " +
                           std::to_string(diagnosis.effects.size()) +
                           "; give the place of one in effects, from 0");
        }
        const std::vector<CableVector> told =
            to_cable_vectors(tensions_N, "tensions_N", diagnosis.model.robot.cable_count());
        if (told.size() != poses.size()) {
          throw InputError("separation_by_stops: " + std::to_string(poses.size()) + " poses and " +
                           std::to_string(told.size()) + " tensions; give one for each");
        }
        std::vector<OfferedRest> stops;
        for (std::size_t i = 0; i < poses.size(); ++i) stops.push_back({poses[i], told[i]});
        const py::gil_scoped_release release;
        return separation_by_stops(diagnosis.model, effect,
                                   find_effect(diagnosis.model.robot, rival), stops);
      },
      py::arg("diagnosis"), py::arg("effect"), py::arg("rival"), py::arg("poses"),
      py::arg("tensions_N"),
      "What stops that a run may still go to would tell between an effect of a diagnosis (its place "
      "in effects, from 0) and a rival of it. poses: where they are; tensions_N [n] hold it there. "
      "Raises InputError for a rival that is none, and lists of different lengths.");
}

void register_foresight(py::module_& module) {
  py::class_<ForeseenEffect>(module, "ForeseenEffect", "What a planned run would say of an effect.")
      .def_property_readonly("info", [](const ForeseenEffect& e) { return EffectRow{e.effect}; })
      .def_readonly("detectable", &ForeseenEffect::detectable,
                    "Smallest size that would show, in typical sizes; NaN: none.")
      .def_readonly("imitated", &ForeseenEffect::imitated,
                    "Share of its signature that each of Foresight.names would imitate.");
  py::class_<Foresight>(module, "Foresight",
                        "Which effects a planned run would see and tell apart.")
      .def_readonly("effects", &Foresight::effects, "Those asked for.")
      .def_readonly("names", &Foresight::names, "Of all effects that rest can show.")
      .def_readonly("poses", &Foresight::poses, "Rests that count.");
  const ForesightOptions usual;
  module.def(
      "foresee",
      [](const Robot& robot, const std::vector<Eigen::VectorXd>& setpoints_N,
         const std::vector<Pose>& poses, double noise, double dwell_s, double move_s,
         const std::vector<std::string>& of) {
        const std::vector<CableVector> told =
            to_cable_vectors(setpoints_N, "setpoints_N", robot.cable_count());
        const py::gil_scoped_release release;
        return foresee(robot, told, poses, {noise, dwell_s, move_s, of});
      },
      py::arg("robot"), py::arg("setpoints_N"), py::arg_v("poses", std::vector<Pose>{}, "[]"),
      py::kw_only(), py::arg("noise") = usual.noise, py::arg("dwell_s") = usual.dwell_s,
      py::arg("move_s") = usual.move_s, py::arg_v("of", std::vector<std::string>{}, "[]"),
      "What a run through these set-points [n] would show. noise: of a rest's readings, in the "
      "robot file's sigma. of: names of effects (default: all that rest can show). Raises "
      "InputError for a run that is none, and a name that rest cannot show.");
}

void register_compare(py::module_& module) {
  py::class_<ComparedNumber>(module, "ComparedNumber", "One number of an effect, log by log.")
      .def_property_readonly("info", [](const ComparedNumber& n) { return EffectRow{n.effect}; })
      .def_readonly("parameter", &ComparedNumber::parameter, "Of info.parameters, from 0.")
      .def_readonly("entry", &ComparedNumber::entry, "Of the parameter's numbers, from 0.")
      .def_readonly("values", &ComparedNumber::values, "[logs], in reported units; NaN: no fit.")
      .def_readonly("standard_deviation", &ComparedNumber::standard_deviation, "[logs].")
      .def_readonly("chi_square", &ComparedNumber::chi_square, "Against their weighted mean.")
      .def_readonly("p_value", &ComparedNumber::p_value, "Family-wise.")
      .def_readonly("moved", &ComparedNumber::moved)
      .def_readonly("from_log", &ComparedNumber::from_log,
                    "Where one step explains most: the first log after it, from 1.")
      .def_readonly("step", &ComparedNumber::step, "From the logs before to those after.")
      .def_readonly("step_deviation", &ComparedNumber::step_deviation);
  py::class_<Comparison> cls(module, "Comparison", "One robot over time, log by log.");
  cls.def_readonly("logs", &Comparison::logs, "Their names.")
      .def_readonly("faults", &Comparison::faults, "DiscreteFault of any log, set right in all.")
      .def_readonly("numbers", &Comparison::numbers, "ComparedNumber, effect after effect.")
      .def_readonly("initial_pose", &Comparison::initial_pose, "One a log.")
      .def_readonly("covariance", &Comparison::covariance, "[6, 6] of it, one a log.")
      .def_readonly("not_settled", &Comparison::not_settled,
                    "Logs that not all effects could be fitted to.")
      .def_readonly("complete", &Comparison::complete, "False: progress stopped it.");
  def_repr(cls);
  module.def(
      "compare", of_logs(&compare), py::arg("robot"), py::arg("logs"),
      py::arg("options") = py::none(), py::arg("progress") = py::none(),
      "Which numbers of the effects that the logs show moved from log to log, by how much and when. "
      "Logs in the order of time. Raises InputError for fewer than two.");
}

}  // namespace

void register_diagnosis(py::module_& module) {
  register_catalogue(module);
  register_findings(module);
  register_diagnosis_path(module);
  register_models(module);
  register_diagnose(module);
  register_compare(module);
  register_separation(module);
  register_foresight(module);
}

}  // namespace cdprcal::python
