#include "cdprcal/diagnosis/diagnose.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/diagnosis/events.hpp"
#include "cdprcal/diagnosis/search.hpp"
#include "cdprcal/diagnosis/sensor_errors.hpp"
#include "cdprcal/diagnosis/separation.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/effects/of_each_log.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "cdprcal/evidence/directions.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/motion/calibrate_in_motion.hpp"
#include "cdprcal/readings/lengths.hpp"
#include "cdprcal/readings/run.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// The robot with what was found beside what it listed already. Effects of a run, when there are
/// several, say whose they are.
Robot corrected_robot(const Robot& given, const std::vector<Log>& logs, const Diagnosis& found) {
  Robot robot = given;
  for (const DiscreteFault& fault : found.faults) {
    if (fault.convention) {
      robot.euler_convention = *fault.convention;
    } else {
      robot.effects.push_back(as_listed(fault));
    }
  }
  const int n = robot.cable_count();
  std::vector<std::string> sources;
  for (const Log& log : logs) sources.push_back(log.source);
  const std::vector<std::string> names = run_names(sources);
  for (const NamedEffect& effect : found.effects) {
    if (as_step(*effect.effect)) continue;  // of one moment of one log, not of the robot
    if (effect.described) robot.own_effects.push_back(effect.effect);
    const int size = effect.effect->size(n);
    for (Eigen::Index begin = 0; begin < effect.values.size(); begin += size) {
      AppliedEffect applied = applied_effect(*effect.effect, effect.values.segment(begin, size), n);
      if (logs.size() > 1 && effect.effect->info().scope == EffectScope::run) {
        applied.run = names[static_cast<std::size_t>(begin / size)];
      }
      robot.effects.push_back(std::move(applied));
    }
  }
  return robot;
}

/// How large the effects of this robot are against typical ones, learnt from them: the scale that
/// makes an effect's own values typical draws of its prior, held near 1 by a hyperprior of two
/// pseudo-values. What the data do not show of a large effect is then as uncertain as it should be.
void learn_priors(DiagnosisModel& model) {
  constexpr int kRounds = 3;
  constexpr double kPseudo = 2.0;
  for (int round = 0; round < kRounds && !model.effects.empty(); ++round) {
    const Eigen::VectorXd variance = covariance(model).diagonal().cwiseMax(0.0);
    Eigen::Index begin = variance.size() - model.values().size();
    for (std::size_t k = 0; k < model.effects.size(); ++k) {
      EffectTerm& term = model.effects[k];
      if (term.learnt.size() > 0) {  // with the noise
        begin += term.values.size();
        continue;
      }
      const EffectValues typical = term.effect->typical(model.robot);
      double sum = kPseudo;
      for (Eigen::Index j = 0; j < term.values.size(); ++j) {
        const double spread = variance[begin++];
        sum +=
            (term.values[j] * term.values[j] + spread) / std::pow(typical[j % typical.size()], 2);
      }
      term.prior_scale = std::sqrt(sum / (kPseudo + static_cast<double>(term.values.size())));
    }
    if (!fit_with_noise(model)) return;
  }
}

/// Values and their standard deviations in reported units, by run after run; `uncertain` is the
/// model with_uncertain_noise, `unseen` what effects that were not accepted add to their variances.
void report_values(const DiagnosisModel& model, const DiagnosisModel& uncertain,
                   const UncertainDirections& directions, const Eigen::VectorXd& unseen,
                   Diagnosis& out) {
  Eigen::VectorXd variance = covariance(uncertain).diagonal();
  Eigen::Index first = variance.size() - model.values().size();
  variance.tail(model.values().size()) += directions.variance;
  variance.segment(first, unseen.size()) += unseen;
  for (std::size_t k = 0; k < out.effects.size(); ++k) {
    const EffectTerm& term = model.effects[k];
    const Eigen::VectorXd deviation =
        variance.segment(first, term.values.size()).cwiseMax(0.0).cwiseSqrt();
    first += term.values.size();
    const int size = term.effect->size(model.robot.cable_count());
    NamedEffect& found = out.effects[k];
    found.values.resize(term.values.size());
    found.standard_deviation.resize(term.values.size());
    for (Eigen::Index begin = 0; begin < term.values.size(); begin += size) {
      const EffectValues values = term.values.segment(begin, size);
      found.values.segment(begin, size) = term.effect->to_reported(values);
      found.standard_deviation.segment(begin, size) =
          term.effect->reported_deviation(values, deviation.segment(begin, size));
    }
  }
}

std::string list_of(const CableVector& values) {
  std::string text;
  for (const double v : values) {
    add_item(text, printed("%.3g", v));
  }
  return text;
}

/// Poses that would tell an effect from a rival, for people; empty when none would.
std::string poses_between(const DiagnosisModel& model, std::size_t k,
                          const std::shared_ptr<const Effect>& rival) {
  const Separation found = separating_poses(model, k, rival);
  std::string text;
  for (const SeparatingPose& pose : found.poses) {
    add_item(text,
             printed("(%.2f, %.2f, %.2f) m from %s (tensions %s N)", pose.position_m.x(),
                     pose.position_m.y(), pose.position_m.z(), pose.from_above ? "above" : "below",
                     list_of(pose.tension_N).c_str()),
             ", then ");
  }
  if (text.empty()) return text;
  return text + printed(": the expected evidence goes from %.1f to %.1f nats", found.nats,
                        found.poses.back().nats);
}

/// What would settle the ties.
void advise(const DiagnosisModel& model, Diagnosis& out) {
  for (std::size_t k = 0; k < out.effects.size(); ++k) {
    const NamedEffect& effect = out.effects[k];
    if (is_of_each_log(*effect.effect)) {
      out.next.push_back(effect.effect->name() +
                         " is not the same in all logs, as if the robot had been changed between "
                         "them: cdprcal compare says what moved, and when");
    }
    std::string rivals;
    for (const std::string& rival : effect.rivals) add_item(rivals, rival);
    if (rivals.empty()) continue;
    out.next.push_back(effect.effect->name() + " and " + rivals +
                       " cannot be told apart with these poses: " + effect.effect->info().settle);
    if (as_step(*effect.effect)) continue;  // what happened once no pose shows again
    for (const std::string& rival : effect.rivals) {
      const std::string poses = poses_between(model, k, find_effect(model.robot, rival));
      if (poses.empty()) continue;
      out.next.push_back("to tell " + effect.effect->name() + " from " + rival +
                         ", measure also at " + poses);
    }
  }
}

/// What people call a channel: the balance shows errors of the load cells.
std::string shown_name(NoiseGroup group) {
  return group == at_rest(Channel::balance) ? "tension" : to_string(group);
}

/// The one cable on which a model's last effect, whose values are each cable's, is more than
/// chance; -1: on several or none, or it has no values of each.
int only_cable(const DiagnosisModel& model) {
  constexpr double kThere = 0.999, kNot = 0.95;
  const EffectTerm& term = model.effects.back();
  const int cables = model.robot.cable_count();
  if (term.effect->size(cables) == term.effect->size(1)) return -1;
  const Eigen::Index terms = term.values.size() / cables;
  const Eigen::MatrixXd own =
      covariance(model).bottomRightCorner(term.values.size(), term.values.size());
  int only = -1;
  for (int i = 0; i < cables; ++i) {
    const auto of_cable = Eigen::seqN(i, terms, cables);
    const Eigen::VectorXd value = term.values(of_cable);
    const Eigen::MatrixXd variance = own(of_cable, of_cable);
    const double square = value.dot(solve_symmetric(variance, value));
    const auto freedom = static_cast<int>(terms);
    if (!(square > chi_square_quantile(kNot, freedom))) continue;
    if (only >= 0 || !(square > chi_square_quantile(kThere, freedom))) return -1;
    only = i;
  }
  return only;
}

void report_left(const DiagnosisModel& model, const CandidateScore& score, Diagnosis& out) {
  const GenericName what = *generic_name(*score.effect);
  Unexplained left;
  left.channel = what.channel;
  left.depends_on = what.depends_on;
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const auto group = static_cast<NoiseGroup>(c);
    if (shown_name(group) != what.channel) continue;
    const double unit = noise_unit(model.robot, group);
    left.rms = unit * model.noise[c];
    left.sigma = unit * model.floor[c];
  }
  left.cable = only_cable(EvidenceAgainst(model).refit(score).model);
  out.unexplained.push_back(left);
  const std::string where =
      left.cable < 0 ? "the robot" : "cable " + std::to_string(left.cable + 1) + ", the only one";
  out.next.push_back("what is left of " + what.channel + " depends on " + what.depends_on +
                     ": look for something on " + where + " that does");
  if (model.runs.size() > 1) {
    out.next.emplace_back("diagnose each log by itself: one of them may be another robot's");
  }
}

/// The channels in which such errors stand out of the noise of single readings.
std::vector<Wandering> errors_beyond_noise(const DiagnosisModel& model, const EffectTerm& errors) {
  const std::array<double, kRestGroups> rms = rms_of_errors(model, errors);
  const NoiseModel specified = specified_noise(model.robot.sigma);
  std::vector<Wandering> out;
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const auto group = static_cast<NoiseGroup>(c);
    if (!(rms[c] > noise_unit(model.robot, group) * model.noise[c])) continue;
    out.push_back({shown_name(group), rms[c], specified.channel[c].pose});
  }
  return out;
}

std::string channels_of(const std::vector<Wandering>& errors) {
  std::string out;
  for (const Wandering& e : errors) add_item(out, e.channel);
  return out;
}

void report_wandering(const DiagnosisModel& model, Diagnosis& out) {
  for (const EffectTerm& term : model.effects) {
    if (is_wandering_errors(*term.effect)) out.wandering = errors_beyond_noise(model, term);
  }
  if (out.wandering.empty()) return;
  out.next.push_back("errors that wander with time count as noise (" + channels_of(out.wandering) +
                     "): smaller effects would show at rests that are visited twice");
}

/// Whether noise of this level, which so many residuals tell, is more than a σ of the robot file
/// allows, as calibrate judges it; all three in one unit.
bool contradicts(double level, double freedom, double sigma) {
  constexpr double kContradiction = 3.0, kSure = 0.95;
  const double share = freedom / chi_square_quantile(kSure, std::max(1.0, freedom));
  return level * std::sqrt(std::min(1.0, share)) > kContradiction * sigma;
}

/// Errors that one sensor has of its own. Beyond what any sensor may have they are a finding.
void report_own_errors(const DiagnosisModel& model, Diagnosis& out) {
  const NoiseModel specified = specified_noise(model.robot.sigma);
  for (const EffectTerm& term : model.effects) {
    const std::optional<OneSensor> of = sensor_of_errors(*term.effect);
    if (!of) continue;
    const NoiseGroup group = at_rest(of->channel);
    const auto c = static_cast<std::size_t>(group);
    const ChannelRow& row = row_of(of->channel);
    OwnErrors own{row.of().column(row.first + of->component), rms_of_errors(model, term)[c],
                  noise_unit(model.robot, group) * model.noise[c], specified.channel[c].pose};
    if (!(own.rms > own.like)) continue;
    own.at_s = only_rest_s(model, term, own.like).value_or(kNaN);
    out.own_errors.push_back(own);
    const std::string times = printed("%.1f times those of its like", own.rms / own.like);
    out.next.push_back(
        std::isnan(own.at_s)
            ? own.column + " has errors of its own, anew at every rest, " + times +
                  ": they count as noise; look at that sensor, its mount and its cable"
            : own.column +
                  printed(" is off at the rest %.1f s after the run began, and at no "
                          "other: it makes its errors ",
                          own.at_s) +
                  times +
                  ", which counts as noise; look what touched the platform or that sensor then, "
                  "and measure there again");
    const double rests = static_cast<double>(term.values.size());
    if (!contradicts(own.rms, rests, own.sigma)) continue;
    const int cable = row.of().width == kOneACable ? of->component : -1;
    out.unexplained.push_back(
        {shown_name(group), own.rms, own.sigma, "nothing that was tried", cable});
  }
}

/// Smooth errors of a model that ends with them; whether any stand out of the noise.
bool report_smooth_errors(const DiagnosisModel& model, Diagnosis& out) {
  const EffectTerm& term = model.effects.back();
  std::vector<Wandering> errors = errors_beyond_noise(model, term);
  if (errors.empty()) return false;
  if (const std::optional<double> reach_m = reach_of_errors_m(*term.effect)) {
    out.discrepancy = {*reach_m, std::move(errors)};
  } else {
    out.wandering = std::move(errors);
  }
  return true;
}

/// In which channels they do, for people.
std::string channels_of_smooth(const DiagnosisModel& model, const Diagnosis& out) {
  const bool of_place = reach_of_errors_m(*model.effects.back().effect).has_value();
  return " (" + channels_of(of_place ? out.discrepancy.channels : out.wandering) + ")";
}

/// What contradicts the sensors' specification although nothing that was tried says why: a model
/// that fits so badly is not consistent with its readings, whatever its residuals look like.
void report_contradictions(const DiagnosisModel& model, const std::vector<Log>& logs,
                           Diagnosis& out) {
  const NoiseModel specified = specified_noise(model.robot.sigma);
  const NoiseLevels freedom = channel_sums(model).freedom;
  const std::size_t before = out.unexplained.size();
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double sigma = specified.channel[c].pose;
    const auto group = static_cast<NoiseGroup>(c);
    const std::string channel = shown_name(group);
    double level = noise_unit(model.robot, group) * model.noise[c];
    for (const Wandering& errors : out.wandering) {
      if (errors.channel == channel) level = std::hypot(level, errors.rms);
    }
    if (!contradicts(level, freedom[c], sigma)) continue;
    out.unexplained.push_back({channel, level, sigma, "nothing that was tried"});
  }
  if (out.unexplained.size() == before) return;
  const bool several = model.runs.size() > 1;
  if (logs.front().length_m.cols() == 0 && read_lengths(logs.front()) != nullptr) {
    out.next.push_back(
        "what all whole lengths read too much in common, and where the pulleys are, "
        "cdprcal geometry finds from many poses");
  }
  out.next.push_back(
      "the readings contradict the sigma of the robot file: check signs, scales and order of the "
      "sensors, and whether the log is this robot's" +
      std::string(several ? "; diagnose each log by itself to see which does" : ""));
}

/// The model with what nobody could name or describe in it, as a smooth function of the place or of
/// time, where the readings bear one out: without it, effects and poses would claim the precision
/// of a model that lacks nothing.
DiagnosisModel with_discrepancy(const DiagnosisModel& model, Diagnosis& out) {
  std::optional<Refit> errors = likeliest_smooth_errors(model, ErrorSize::any);
  if (!errors || !report_smooth_errors(errors->model, out)) return model;
  out.next.push_back("sigma of the pose and of the effects allows for " +
                     words_of_smooth(*errors->model.effects.back().effect) +
                     channels_of_smooth(errors->model, out));
  return std::move(errors->model);
}

/// The model with the errors that count as noise, where they stand out; else nothing.
const DiagnosisModel* with_noise(const DiagnosisModel* smooth_noise, Diagnosis& out) {
  if (!smooth_noise || !out.unexplained.empty() || !report_smooth_errors(*smooth_noise, out)) {
    return nullptr;
  }
  out.next.push_back(words_of_smooth(*smooth_noise->effects.back().effect) + " count as noise" +
                     channels_of_smooth(*smooth_noise, out) +
                     ": no name explains them better, and the sensors may have them");
  return smooth_noise;
}

/// Where the initial pose is without the formulas that were found. A formula is the plainest of a
/// thousand laws that predicts what was left; that what the robot does has its form is as likely as
/// not, and then the pose is no better known than without it: a law of lengths may stand for
/// something in the balance, which still moves the pose.
std::vector<Possibility> without_formulas(const DiagnosisModel& model, const InitialPose& initial,
                                          const Diagnosis& found) {
  constexpr double kAnotherLaw = 0.5;
  if (std::ranges::none_of(found.effects, &NamedEffect::described)) return {};
  DiagnosisModel plain = model;
  plain.noise = found.baseline.noise;  // that with formulas is of what they leave
  for (std::size_t k = found.effects.size(); k-- > 0;) {
    if (!found.effects[k].described) continue;
    plain.effects.erase(plain.effects.begin() + static_cast<std::ptrdiff_t>(k));
  }
  if (!fit_with_noise(plain)) return {};
  Diagnosis unsaid;
  InitialPose without = initial_pose_of(with_discrepancy(plain, unsaid));
  const std::vector<CandidateScore> scores = scan(plain, untried(plain), {.draws = 0});
  without.covariance = averaged_covariance(without.covariance, unseen_effects(plain, scores), true);
  return {in_place_of(initial, without, kAnotherLaw)};
}

/// The effects of these names, each once. Throws InputError for a name that cannot be fitted.
Candidates chosen_effects(const Robot& robot, const std::vector<std::string>& names, bool motion) {
  Candidates out;
  for (const std::string& name : names) {
    const std::shared_ptr<const Effect> effect = find_effect(robot, name);
    if (effect->needs_motion() && !motion) {
      throw InputError("effects: " + name +
                       " shows only in motion; give --motion, or leave effects away, for a search");
    }
    if (std::ranges::find(out, effect) != out.end()) {
      throw InputError("effects: " + name + " stands there twice; name it once");
    }
    out.push_back(effect);
  }
  return out;
}

std::string reason_for(Verdict verdict, const Checks& checks) {
  switch (verdict) {
    case Verdict::consistent:
      return "nothing in the catalogue, and no plain dependence, improves on the model";
    case Verdict::explained:
      return "the named effects explain what the model could not";
    case Verdict::unexplained:
      return "something is left that no effect of the catalogue explains";
    case Verdict::undetermined:
      return too_little(checks);
    case Verdict::described:
      return "a formula describes what the named effects do not explain: look for its cause";
  }
  return "";
}

/// Where no effect was found the pose is the one that calibrate has, faults of the readings set
/// right, and so is its σ; but for one `of_noise` that was found to count, of which calibrate knows
/// nothing. False where it has none.
bool take_calibrated(const Robot& robot, const Log& log, bool of_noise, Diagnosis& out) {
  const Calibration calibration = calibrate(robot, log);
  const CalibrationResult& result = calibration.result;
  if (result.status != CalibrationStatus::converged || !result.covariance) return false;
  out.initial_pose_before = result.poses.front();
  out.covariance_before = *result.covariance;
  if (!of_noise) {
    out.initial_pose_after = out.initial_pose_before;
    out.covariance_after = out.covariance_before;
  }
  const std::string stays = misfit(calibration);
  if (result.lacks_something) out.misfit = stays;
  if (stays.empty() || !out.wandering.empty()) return true;
  out.next.push_back("errors that stay over a rest count as noise (the model misfits " + stays +
                     "): more rests make less of them, longer ones do not");
  return true;
}

/// Faults in whose place others may be are not known, and where the platform began is not either.
void doubt_faults(Diagnosis& out) {
  for (const DiscreteFault& fault : out.faults) {
    if (fault.rivals.empty()) continue;
    std::string others;
    for (const std::string& other : fault.rivals) add_item(others, other, ", or ");
    out.verdict = Verdict::undetermined;
    out.reason = "the readings agree as well if " + others + ", and the initial pose is another";
    out.next.push_back(
        "move one winch at a time and look which column answers: the readings do "
        "not tell whether " +
        fault.text + ", or " + others);
  }
}

/// Why a log gives no initial pose that can be trusted.
struct WithoutPose {
  std::string why;         ///< empty where it gives one
  bool too_little = true;  ///< nothing contradicts the model; else the readings do
};
WithoutPose without_pose(const Robot& robot, const Log& log, const ActiveEffects& happened,
                         bool motion) {
  try {
    InMotion tried;
    if (motion) {
      InMotionOptions options;
      options.calibrate.happened = happened;
      tried = calibrate_in_motion(robot, log, options);
    } else {
      CalibrateOptions options;
      options.allow_for_effects = options.solve.explain = false;
      options.happened = happened;
      tried.calibration = calibrate(robot, log, options);
    }
    const CalibrationResult& found = tried.calibration.result;
    if (found.status == CalibrationStatus::converged) {
      // Geometry alone agrees with whatever load cells read.
      return {tried.calibration.static_poses > 0 ? "" : tried.without, false};
    }
    return {std::string(to_string(found.status)) + ", " + found.reason,
            found.status == CalibrationStatus::unobservable};
  } catch (const InputError& error) {  // effects that no robot has
    return {error.what(), false};
  }
}

/// The steps that were found in a run.
ActiveEffects steps_of(const DiagnosisModel& model, std::size_t run) {
  ActiveEffects steps = model.active(run);
  std::erase_if(steps, [](const ActiveEffect& active) { return !as_step(*active.effect); });
  return steps;
}

/// Where nothing speaks against the model, something must speak for the pose: a log that it cannot
/// calibrate is not explained, and one that says too little of the pose says too little.
void doubt_poses(const std::vector<Log>& logs, bool motion, Diagnosis& out) {
  if (!out.unexplained.empty()) return;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const Log& log = logs[i];
    const auto [why, too_little] = without_pose(out.corrected, log, steps_of(out.model, i), motion);
    if (why.empty()) continue;
    if (too_little && out.verdict == Verdict::consistent) {
      out.verdict = Verdict::undetermined;
      out.reason = "nothing speaks against the model, but a log leaves its initial pose open";
    } else if (out.verdict != Verdict::undetermined) {
      out.verdict = Verdict::unexplained;
      out.reason = "a log gives no initial pose that can be trusted, whatever was found";
    }
    out.next.push_back(log.source +
                       " gives no initial pose that can be trusted, with this model "
                       "either: " +
                       why + "; cdprcal check says more");
  }
}

/// False when somebody stopped it.
bool search_all(Search& search) {
  // What was exchanged may uncover something else; twice bounds the time.
  bool going = search.forward();
  if (going && search.exchange()) going = search.forward();
  if (going && search.exchange_fault()) going = search.forward();
  return going;
}

/// Evidence for all that was found.
double nats_of(const Diagnosis& diagnosis) {
  double sum = 0.0;
  for (const NamedEffect& found : diagnosis.effects) sum += found.log_evidence;
  return sum;
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::consistent:
      return "consistent";
    case Verdict::explained:
      return "explained";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::undetermined:
      return "undetermined";
    case Verdict::described:
      return "described";
  }
  return "unknown";
}

Diagnosis diagnose(const Robot& given, const std::vector<Log>& given_logs,
                   const DiagnoseOptions& asked) {
  if (given_logs.empty()) throw InputError("diagnose: no log; give at least one");
  DiagnoseOptions options = asked;
  bool stopped = false;  // for good
  const GoOn report = options.progress = [&](const std::string& what) {
    stopped = stopped || (asked.progress && !asked.progress(what));
    return !stopped;
  };
  const Candidates chosen =
      chosen_effects(given, options.effects.value_or(std::vector<std::string>{}), options.motion);
  const bool searches = !options.effects.has_value();
  Diagnosis out;
  Robot robot = without_reading_faults(given);
  std::vector<Log> logs = given_logs;
  for (Log& log : logs) {
    check_belongs(given, log);
    if (auto corrected = correct_readings(given, log)) log = *std::move(corrected);
  }
  if (options.faults) {
    out.faults = *options.faults;
    for (const DiscreteFault& fault : out.faults) set_right(fault, robot, logs.front());
  } else {
    out.faults = find_discrete_faults(robot, logs.front(), options.motion, report);
  }
  for (std::size_t i = 1; i < logs.size(); ++i) {
    Robot scratch = robot;
    for (const DiscreteFault& fault : out.faults) set_right(fault, scratch, logs[i]);
  }
  report("baseline");
  DiagnosisModel model = baseline_model(robot, logs, out.gated, options.motion);
  out.baseline = model;
  out.initial_pose_before = model.runs.front().poses.front();
  record_gap(model, model, "", out);
  for (CandidateScore& s : scan(model, untried(model), {.draws = 0, .limits = true})) {
    out.identifiability.push_back({s.effect->name(), s.visible, s.detectable});
    out.ranking.push_back(std::move(s));
  }
  out.covariance_before =
      averaged_covariance(initial_pose_covariance(with_uncertain_noise(model), 0),
                          unseen_effects(model, out.ranking).each);

  const Checks checks = checks_of(model);
  const auto as_begun = std::pair(logs, out);  // out has the model, as its baseline
  std::optional<Search> begun(std::in_place, logs, model, out, options);
  if (!searches) begun->take(chosen);
  bool going = searches && checks.enough() && search_all(*begun);
  // One name that does all that others do is taken before them: these may explain more together.
  if (going && begun->found_what_does_all()) {
    const auto found = std::tuple(logs, model, out);
    const Search with_it = *begun;
    std::tie(logs, out) = as_begun;
    model = out.baseline;
    begun.emplace(logs, model, out, options);
    begun->leave_out_what_does_all();
    going = search_all(*begun);
    // It must do so beyond doubt.
    if (nats_of(std::get<2>(found)) - nats_of(out) > 3.0 * options.rival_nats) {
      std::tie(logs, model, out) = found;
      begun.emplace(with_it);
    }
  }
  Search& search = *begun;
  if (going) {
    search.drop();
    search.leave_to_smooth_errors();
    search.withdraw();
    search.describe();
  }
  search.find_rivals();
  if (going) search.in_motion();
  learn_priors(model);
  const std::vector<CandidateScore> unseen =
      scan(model, untried(model), {.draws = 0, .limits = true});
  for (const CandidateScore& s : unseen) {
    for (Identifiability& i : out.identifiability) {
      if (i.name == s.effect->name()) i.detectable_after = s.detectable;
    }
  }
  advise(model, out);
  report_wandering(model, out);
  report_own_errors(model, out);
  if (search.left()) {
    report_left(model, *search.left(), out);
  } else {
    report_contradictions(search.smooth_noise() ? *search.smooth_noise() : model, logs, out);
  }
  const DiagnosisModel* const noise = with_noise(search.smooth_noise(), out);
  const DiagnosisModel honest = !out.unexplained.empty() ? with_discrepancy(model, out)
                                : noise                  ? *noise
                                                         : model;
  const DiagnosisModel uncertain = with_uncertain_noise(honest);
  const UncertainDirections directions = uncertain_directions(honest);
  const Unseen missed = unseen_effects(model, unseen);
  report_values(honest, uncertain, directions, missed.of_values, out);
  out.model = model;
  const InitialPose initial{honest.runs.front().poses.front(),
                            initial_pose_covariance(uncertain, 0) + directions.covariance};
  out.initial_pose_after = initial.pose;
  std::vector<Possibility> others = without_formulas(honest, initial, out);
  others.insert(others.end(), search.rivals().begin(), search.rivals().end());
  out.covariance_after =
      averaged_covariance(initial.covariance, missed, checks.enough(), std::move(others));
  out.corrected = corrected_robot(given, logs, out);
  out.verdict = stopped                                                     ? Verdict::undetermined
                : !out.unexplained.empty()                                  ? Verdict::unexplained
                : !searches || !checks.enough()                             ? Verdict::undetermined
                : std::ranges::any_of(out.effects, &NamedEffect::described) ? Verdict::described
                : !out.effects.empty() || !out.faults.empty()               ? Verdict::explained
                                                                            : Verdict::consistent;
  out.reason = stopped    ? "stopped before the search was over: what was found so far stands"
               : searches ? reason_for(out.verdict, checks)
                          : "these effects were chosen, not found: nothing was searched for";
  const bool as_calibrated = out.verdict == Verdict::consistent ||
                             (out.verdict == Verdict::explained && out.effects.empty());
  const bool has_pose = as_calibrated && given_logs.size() == 1 && !options.motion &&
                        take_calibrated(out.corrected, given_logs.front(), noise != nullptr, out);
  doubt_faults(out);
  if (!has_pose) doubt_poses(given_logs, options.motion, out);
  return out;
}

}  // namespace cdprcal
