#include "cdprcal/diagnosis/diagnose.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cstdio>
#include <set>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

constexpr const char* kChannelUnits[kChannels] = {"length_m", "swivel_rad", "roll_pitch_rad",
                                                  "yaw_rad", "tension_N"};

std::string text(const char* pattern, auto... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, pattern, values...);
  return buffer;
}

/// Noise of the mean reading at rest, from the ripple of each log: no estimate goes below it.
void add_ripple(const Log& log, const SampleRange& run, double samples, NoiseLevels& sums) {
  const auto group = [&](const LogMatrix& values, int from, int to) {
    double sum = 0.0;
    int count = 0;
    for (int c = from; c < std::min<int>(to, static_cast<int>(values.cols())); ++c) {
      const double noise = channel_noise(values.col(c).segment(run.begin, run.size()));
      sum += noise * noise / samples;
      ++count;
    }
    return count > 0 ? sum / count : 0.0;
  };
  const int n = static_cast<int>(log.length_m.cols());
  sums[0] += group(log.length_m, 0, n);
  sums[1] += group(log.swivel_rad, 0, n);
  sums[2] += group(log.roll_pitch_yaw_rad, 0, 2);
  sums[3] += group(log.roll_pitch_yaw_rad, 2, 3);
  sums[4] += group(log.tension_N, 0, n);
}

/// Static poses of a log as a run with its calibrated start; slack poses lose their balance.
DiagnosisRun run_from(const Robot& robot, const Log& log, Diagnosis& out, NoiseLevels& ripple) {
  CalibrateOptions options;
  options.method = log.tension_N.cols() > 0 ? Method::statics : Method::kinematic;
  options.noise = NoiseSource::specified;  // the diagnosis has its own, with the effects in it
  const Calibration calibration = calibrate(robot, log, options);
  if (calibration.result.poses.empty()) {
    throw InputError(log.source +
                     ": the baseline calibration failed: " + calibration.result.reason);
  }
  DiagnosisRun run;
  run.name = log.source;
  run.measurements = calibration.problem.measurements;
  run.poses = calibration.result.poses;
  run.known = calibration.problem.effects;
  double samples = 0.0;
  for (Measurement& m : run.measurements) {
    samples += m.samples;
    for (int i = 0; i < robot.cable_count(); ++i) {
      // Below a tenth of the least tension allowed a cable carries nothing worth balancing.
      if (m.kind == PoseKind::static_pose && m.tension_N[i] < 0.1 * robot.tension_min_N) {
        out.gated.push_back(text("%s: slack at %.2f s, cable %d (%.1f N): its balance is left out",
                                 log.source.c_str(), m.time_s, i + 1, m.tension_N[i]));
        m.tension_N[i] = kNaN;
      }
    }
  }
  const int n = robot.cable_count();
  run.offsets.setZero(2 * n + 1);
  const PlatformState initial = platform_state(robot, run.poses.front());
  const Measurement& first = run.measurements.front();
  const Vector3 angles = euler_from_rotation(initial.rotation, robot.euler_convention);
  for (int i = 0; i < n; ++i) {
    const double length = first.length_m[i] - initial.cable[i].length_m;
    const double swivel = first.swivel_rad[i] - initial.cable[i].swivel_rad;
    run.offsets[i] = std::isfinite(length) ? length : 0.0;
    run.offsets[n + i] = std::isfinite(swivel) ? swivel : 0.0;
  }
  const double yaw = first.roll_pitch_yaw_rad[2] - angles[2];
  run.offsets[2 * n] = std::isfinite(yaw) ? yaw : 0.0;
  const std::vector<SampleRange> all = segments(log);
  add_ripple(log, all.back(), samples / static_cast<double>(run.measurements.size()), ripple);
  return run;
}

DiagnosisModel baseline_of(const Robot& robot, const std::vector<Log>& logs, Diagnosis& out) {
  DiagnosisModel model;
  model.robot = robot;
  NoiseLevels ripple{};
  for (const Log& log : logs) model.runs.push_back(run_from(robot, log, out, ripple));
  const SensorSigma& s = robot.sigma;
  const NoiseLevels sigma{s.length_m, s.swivel_rad, s.attitude_rad, s.attitude_rad, s.tension_N};
  for (std::size_t c = 0; c < kChannels; ++c) {
    // A thousandth of σ keeps noise-free data from a division by zero.
    const double level =
        std::max(std::sqrt(ripple[c] / static_cast<double>(logs.size())), 1e-3 * sigma[c]);
    const double unit = c == static_cast<std::size_t>(Channel::balance) ? sigma[c] : 1.0;
    model.floor[c] = level / unit;
    model.noise[c] = sigma[c] / unit;
  }
  if (!fit_with_noise(model)) {
    out.gated.push_back("the baseline fit did not settle: results are to be taken with care");
  }
  return model;
}

/// Peak cost with every channel's degrees of freedom as in `reference`: comparable between models.
double profile_cost(const DiagnosisModel& model, const NoiseLevels& freedom) {
  const DiagnosisSystem system = linearise(model);
  if (!system.valid) return std::numeric_limits<double>::infinity();
  const ChannelSums sums = channel_sums(system);
  double total = 0.5 * system.prior_residual.squaredNorm();
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (freedom[c] < 1.0) continue;
    const double level =
        std::max(model.floor[c], model.noise[c] * std::sqrt(sums.squares[c] / freedom[c]));
    total +=
        freedom[c] * std::log(level) + 0.5 * sums.squares[c] * std::pow(model.noise[c] / level, 2);
  }
  return total;
}

/// ½ log|I/Λ + 1| of the last effect of a fitted model.
double occam_of_last(const DiagnosisModel& model) {
  // Information about the last effect with all else free, at the fitted state of the full model.
  const DiagnosisSystem system = linearise(model);
  const int size = system.layout.nuisance();
  const int begin = system.layout.accepted_begin.back();
  const int width = system.layout.accepted_size.back();
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  for (const PoseSystem& pose : system.poses) {
    const auto columns = pose.reduced_by_common.leftCols(size);
    hessian.noalias() += columns.transpose() * columns;
  }
  hessian.diagonal().head(begin) += system.prior_precision.head(begin);
  Eigen::MatrixXd own = hessian.block(begin, begin, width, width);
  own -= hessian.block(begin, 0, width, begin) * hessian.topLeftCorner(begin, begin)
                                                     .completeOrthogonalDecomposition()
                                                     .solve(hessian.block(0, begin, begin, width));
  const Eigen::VectorXd sigma =
      system.prior_precision.segment(begin, width).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = sigma.asDiagonal() * own * sigma.asDiagonal();
  scaled = 0.5 * (scaled + scaled.transpose()).eval();
  scaled.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  const Eigen::MatrixXd root = llt.matrixL();
  return root.diagonal().array().abs().max(1e-300).log().sum();
}

/// Standard deviations of the values of accepted effect `k`.
Eigen::VectorXd deviation_of(const DiagnosisModel& model, std::size_t k) {
  const DiagnosisSystem system = linearise(model);
  const int size = system.layout.nuisance();
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  for (const PoseSystem& pose : system.poses) {
    const auto columns = pose.reduced_by_common.leftCols(size);
    hessian.noalias() += columns.transpose() * columns;
  }
  hessian.diagonal() += system.prior_precision;
  const Eigen::MatrixXd covariance = hessian.completeOrthogonalDecomposition().pseudoInverse();
  return covariance.diagonal()
      .segment(system.layout.accepted_begin[k], system.layout.accepted_size[k])
      .cwiseMax(0.0)
      .cwiseSqrt();
}

void record_gap(const DiagnosisModel& before, const DiagnosisModel& model,
                const std::string& after_effect, Diagnosis& out) {
  const HeldOut held = held_out(before, model);
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (!std::isfinite(held.held_out_rms[c])) continue;
    out.gap.push_back({after_effect, kChannelUnits[c], held.train_rms[c], held.held_out_rms[c]});
  }
}

/// One candidate refitted in full.
struct Refit {
  CandidateScore score;
  DiagnosisModel model;
  double log_evidence = -1e300;
};

Refit refit(const DiagnosisModel& model, const CandidateScore& score, const NoiseLevels& freedom,
            double cost_before) {
  Refit out{score, model, -1e300};
  out.model.effects.push_back({score.effect, score.values});
  if (!fit_with_noise(out.model)) return out;
  out.log_evidence = cost_before - profile_cost(out.model, freedom) - occam_of_last(out.model);
  return out;
}

bool plausible(const EffectTerm& term, int cables) {
  const EffectValues limit = term.effect->plausible(cables);
  for (Eigen::Index j = 0; j < term.values.size(); ++j) {
    if (std::abs(term.values[j]) > limit[j % limit.size()]) return false;
  }
  return true;
}

/// The robot with what was found beside what it listed already. Effects of a run, when there are
/// several, say whose they are.
Robot corrected_robot(const Robot& given, const std::vector<Log>& logs, const Diagnosis& found) {
  Robot robot = given;
  for (const DiscreteFault& fault : found.faults) {
    if (fault.name == "euler_convention") {
      robot.euler_convention = static_cast<EulerConvention>(static_cast<int>(fault.values[0]));
    } else {
      robot.effects.push_back({fault.name, "", {{fault.parameter, fault.values}}});
    }
  }
  const int n = robot.cable_count();
  for (const NamedEffect& effect : found.effects) {
    const int size = effect.effect->size(n);
    for (Eigen::Index begin = 0; begin < effect.values.size(); begin += size) {
      AppliedEffect applied = applied_effect(*effect.effect, effect.values.segment(begin, size), n);
      if (logs.size() > 1 && effect.effect->info().scope == EffectScope::run) {
        applied.run = run_name(logs[static_cast<std::size_t>(begin / size)].source);
      }
      robot.effects.push_back(std::move(applied));
    }
  }
  return robot;
}

Candidates remaining(const DiagnosisModel& model) {
  Candidates out;
  for (const auto& effect : effect_catalogue()) {
    const bool taken = std::any_of(model.effects.begin(), model.effects.end(),
                                   [&](const EffectTerm& t) { return t.effect == effect; });
    if (!taken && !effect->needs_motion()) out.push_back(effect);
  }
  return out;
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
  }
  return "unknown";
}

Matrix6 initial_pose_covariance(const DiagnosisModel& model, std::size_t run) {
  const DiagnosisSystem system = linearise(model);
  const int size = system.layout.nuisance();
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  for (const PoseSystem& pose : system.poses) {
    const auto columns = pose.reduced_by_common.leftCols(size);
    hessian.noalias() += columns.transpose() * columns;
  }
  hessian.diagonal() += system.prior_precision;
  const Eigen::MatrixXd covariance = hessian.completeOrthogonalDecomposition().pseudoInverse();
  for (const PoseSystem& pose : system.poses) {
    if (pose.run != run || pose.pose != 0) continue;
    // δζ = −A⁺(r + C δx): its own readings' noise, and what the common unknowns pass on.
    const Eigen::MatrixXd inverse = pose.by_pose.completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::MatrixXd passed = inverse * pose.by_common.leftCols(size);
    return inverse * inverse.transpose() + passed * covariance * passed.transpose();
  }
  return Matrix6::Constant(kNaN);
}

Diagnosis diagnose(const Robot& given, const std::vector<Log>& given_logs,
                   const DiagnoseOptions& options) {
  if (given_logs.empty()) throw InputError("diagnose: no log");
  Diagnosis out;
  const auto report = [&](const std::string& what) {
    return !options.progress || options.progress(what);
  };
  Robot robot = given;
  std::vector<Log> logs = given_logs;
  for (Log& log : logs) {
    if (auto corrected = correct_readings(given, log)) log = *std::move(corrected);
  }
  std::erase_if(robot.effects, [](const AppliedEffect& e) { return is_reading_fault(e.name); });
  report("discrete faults: signs, order, units, conventions");
  {
    const DiscreteSearch search = find_discrete_faults(robot, logs.front());
    out.faults = search.faults;
    for (std::size_t i = 1; i < logs.size(); ++i) {
      Robot scratch = robot;
      for (const DiscreteFault& fault : search.faults) set_right(fault, scratch, logs[i]);
    }
  }
  report("baseline");
  DiagnosisModel model = baseline_of(robot, logs, out);
  out.baseline = model;
  const int n = robot.cable_count();
  out.initial_pose_before = model.runs.front().poses.front();
  out.covariance_before = initial_pose_covariance(model, 0);
  record_gap(model, model, "", out);

  std::set<std::string> refused;
  std::optional<CandidateScore> best_generic;
  for (bool first = true;; first = false) {
    const Candidates named = remaining(model);
    Candidates all = named;
    all.insert(all.end(), generic_candidates().begin(), generic_candidates().end());
    const std::vector<CandidateScore> scores = scan(model, all, options.scan);
    if (first) {
      for (const CandidateScore& s : scores) {
        if (!generic_name(*s.effect)) {
          out.identifiability.push_back({s.effect->name(), s.visible, s.detectable});
        }
      }
    }
    best_generic.reset();
    for (const CandidateScore& s : scores) {
      if (generic_name(*s.effect)) {
        best_generic = s;
        break;
      }
    }
    if (static_cast<int>(model.effects.size()) >= options.most_effects) break;
    if (!report(text("scan after %d effects", static_cast<int>(model.effects.size())))) break;

    // Refit the best few named ones in full.
    const DiagnosisSystem system = linearise(model);
    const NoiseLevels freedom = channel_sums(system).freedom;
    const double cost_before = profile_cost(model, freedom);
    std::vector<Refit> refits;
    for (const CandidateScore& s : scores) {
      if (generic_name(*s.effect) || refused.count(s.effect->name())) continue;
      if (s.p_value >= options.family_wise_p && s.log_evidence < options.least_evidence) continue;
      if (static_cast<int>(refits.size()) >= options.refits) break;
      refits.push_back(refit(model, s, freedom, cost_before));
    }
    std::stable_sort(refits.begin(), refits.end(), [](const Refit& a, const Refit& b) {
      return a.log_evidence > b.log_evidence;
    });
    // What no name explains as well as a mere dependence does stays unexplained.
    double generic_evidence = -1e300;
    if (best_generic && best_generic->p_value < options.family_wise_p) {
      generic_evidence = refit(model, *best_generic, freedom, cost_before).log_evidence;
    }
    bool accepted = false;
    for (std::size_t i = 0; i < refits.size() && !accepted; ++i) {
      Refit& best = refits[i];
      const std::string name = best.score.effect->name();
      const EffectTerm& term = best.model.effects.back();
      std::string reason;
      HeldOut held;
      if (best.score.p_value >= options.family_wise_p) {
        reason = text("chance does as well (family-wise p = %.3f)", best.score.p_value);
      } else if (best.log_evidence <= options.least_evidence) {
        reason = text("evidence %.1f nats after the refit, %.1f needed", best.log_evidence,
                      options.least_evidence);
      } else if (!plausible(term, n)) {
        reason = "the value it would need is physically implausible";
      } else if (best.log_evidence + options.rival_nats < generic_evidence) {
        const GenericName what = *generic_name(*best_generic->effect);
        reason = text(
            "a mere dependence of %s on %s explains the readings better (%.1f nats "
            "against %.1f)",
            what.channel.c_str(), what.depends_on.c_str(), generic_evidence, best.log_evidence);
      } else {
        held = held_out(model, best.model);
        if (!(held.gain > held.gain_error)) {
          reason = text("does not predict poses it was not fitted on (gain %.1f +- %.1f nats)",
                        held.gain, held.gain_error);
        }
      }
      if (!reason.empty()) {
        refused.insert(name);
        out.rejected.push_back({name, reason});
        continue;
      }
      NamedEffect found;
      found.effect = best.score.effect;
      found.log_evidence = best.log_evidence;
      found.p_value = best.score.p_value;
      found.held_out_before = held.before;
      found.held_out_after = held.after;
      CandidateScore winner = best.score;
      winner.values = term.values;
      const std::vector<double> shares = imitation(model, winner, named);
      for (std::size_t k = 0; k < named.size(); ++k) {
        if (named[k] == best.score.effect) continue;
        const bool close = std::any_of(refits.begin(), refits.end(), [&](const Refit& r) {
          return r.score.effect == named[k] &&
                 r.log_evidence > best.log_evidence - options.rival_nats;
        });
        if (close || shares[k] > options.rival_share) {
          // A rival that imitates but is far less probable was told apart all the same.
          const bool far = std::any_of(refits.begin(), refits.end(), [&](const Refit& r) {
            return r.score.effect == named[k] &&
                   r.log_evidence < best.log_evidence - 3.0 * options.rival_nats;
          });
          if (close || !far) found.rivals.push_back(named[k]->name());
        }
      }
      report("accepted " + name);
      const DiagnosisModel before = model;
      model = best.model;
      record_gap(before, model, name, out);
      out.effects.push_back(std::move(found));
      refused.clear();  // what was hidden behind this effect may show now
      accepted = true;
    }
    if (!accepted) break;
  }

  // Drop what a later effect made needless.
  for (std::size_t k = 0; k + 1 < model.effects.size();) {
    DiagnosisModel without = model;
    const EffectTerm dropped = without.effects[k];
    without.effects.erase(without.effects.begin() + static_cast<std::ptrdiff_t>(k));
    bool needless = false;
    if (fit_with_noise(without)) {
      const NoiseLevels freedom = channel_sums(linearise(without)).freedom;
      DiagnosisModel last = without;
      last.effects.push_back(dropped);
      if (fit_with_noise(last)) {
        const double evidence =
            profile_cost(without, freedom) - profile_cost(last, freedom) - occam_of_last(last);
        needless = evidence < options.least_evidence;
      }
    }
    if (needless) {
      out.rejected.push_back({dropped.effect->name(), "needless once the later effects are in"});
      out.effects.erase(out.effects.begin() + static_cast<std::ptrdiff_t>(k));
      model = without;
    } else {
      ++k;
    }
  }

  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    const EffectTerm& term = model.effects[k];
    const Eigen::VectorXd deviation = deviation_of(model, k);
    const int size = term.effect->size(n);
    out.effects[k].values.resize(term.values.size());
    out.effects[k].standard_deviation.resize(term.values.size());
    for (Eigen::Index begin = 0; begin < term.values.size(); begin += size) {
      const EffectValues values = term.values.segment(begin, size);
      out.effects[k].values.segment(begin, size) = term.effect->to_reported(values);
      out.effects[k].standard_deviation.segment(begin, size) =
          term.effect->reported_deviation(values, deviation.segment(begin, size));
    }
    std::string rivals;
    for (const std::string& rival : out.effects[k].rivals) {
      rivals += (rivals.empty() ? "" : ", ") + rival;
    }
    if (!rivals.empty()) {
      out.next.push_back(std::string(term.effect->info().name) + " and " + rivals +
                         " cannot be told apart with these poses: " + term.effect->info().settle);
    }
  }
  if (best_generic && best_generic->p_value < options.family_wise_p &&
      best_generic->log_evidence > options.least_evidence) {
    const GenericName what = *generic_name(*best_generic->effect);
    Unexplained left;
    left.channel = what.channel;
    left.depends_on = what.depends_on;
    for (std::size_t c = 0; c < kChannels; ++c) {
      const std::string channel = to_string(static_cast<Channel>(c));
      const bool same =
          channel == what.channel || (channel == "balance" && what.channel == "tension");
      if (!same) continue;
      const double unit = channel == "balance" ? robot.sigma.tension_N : 1.0;
      left.rms = unit * model.noise[c];
      left.sigma = unit * model.floor[c];
    }
    out.unexplained.push_back(left);
    out.next.push_back("what is left of " + what.channel + " depends on " + what.depends_on +
                       ": look for something on the robot that does");
  }
  out.model = model;
  out.initial_pose_after = model.runs.front().poses.front();
  out.covariance_after = initial_pose_covariance(model, 0);
  out.corrected = corrected_robot(given, logs, out);
  out.verdict = !out.unexplained.empty()                      ? Verdict::unexplained
                : !out.effects.empty() || !out.faults.empty() ? Verdict::explained
                                                              : Verdict::consistent;
  switch (out.verdict) {
    case Verdict::consistent:
      out.reason = "nothing in the catalogue, and no plain dependence, improves on the model";
      break;
    case Verdict::explained:
      out.reason = "the named effects explain what the model could not";
      break;
    case Verdict::unexplained:
      out.reason = "something is left that no effect of the catalogue explains";
      break;
  }
  return out;
}

}  // namespace cdprcal
