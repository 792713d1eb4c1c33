#include "cdprcal/diagnosis/foresight.hpp"

#include <algorithm>

#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

/// Draws of values, whose signatures' imitations are averaged: no cable is like the others.
constexpr int kDraws = 4;

/// A run that obeys the model, judged with the noise that its readings would have.
DiagnosisModel planned_model(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                             const std::vector<Pose>& poses, const ForesightOptions& options) {
  SyntheticLogOptions run;
  run.dwell_s = options.dwell_s;
  run.move_s = options.move_s;
  std::vector<Log> logs{synthetic_log(robot, setpoints_N, run, poses).log};
  std::vector<std::string> left_out;
  DiagnosisModel model = baseline_model(robot, logs, left_out);
  const NoiseModel specified = specified_noise(robot.sigma);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double level =
        options.noise * specified.channel[c].pose / noise_unit(robot, static_cast<NoiseGroup>(c));
    model.noise[c] = model.floor[c] = level;
  }
  return model;
}

}  // namespace

Foresight foresee(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                  const std::vector<Pose>& poses, const ForesightOptions& options) {
  const DiagnosisModel model = planned_model(robot, setpoints_N, poses, options);
  const Candidates candidates = untried(model);
  Foresight out;
  out.poses = model.pose_count();
  for (const auto& effect : candidates) out.names.push_back(effect->name());
  Candidates asked;
  for (const std::string& name : options.of) {
    const auto known = std::ranges::find(out.names, name);
    if (known == out.names.end()) {
      (void)find_effect(robot, name);  // throws for a name that is none
      throw InputError("effect: " + name + " shows only in motion; name one that rest can show");
    }
    asked.push_back(candidates[static_cast<std::size_t>(known - out.names.begin())]);
  }
  if (asked.empty()) asked = candidates;
  const std::vector<CandidateScore> scores = scan(model, candidates, {.draws = 0, .limits = true});
  RandomNormal random(1);
  for (const auto& effect : asked) {
    ForeseenEffect row{effect, kNaN, std::vector<double>(candidates.size(), 0.0)};
    for (const CandidateScore& score : scores) {
      if (score.effect == effect) row.detectable = score.detectable;
    }
    for (int draw = 0; draw < kDraws; ++draw) {
      CandidateScore typical;
      typical.effect = effect;
      typical.values = effect->typical(robot);
      for (double& v : typical.values) v *= random();
      const std::vector<double> shares = imitation(model, typical, candidates);
      for (std::size_t j = 0; j < shares.size(); ++j) row.imitated[j] += shares[j] / kDraws;
    }
    const auto itself = std::ranges::find(candidates, effect) - candidates.begin();
    row.imitated[static_cast<std::size_t>(itself)] = 1.0;
    out.effects.push_back(std::move(row));
  }
  return out;
}

}  // namespace cdprcal
