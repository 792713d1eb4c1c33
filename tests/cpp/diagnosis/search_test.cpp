// Which effects are added, exchanged, dropped and taken back: each step by itself, on models whose
// readings are known to hold one thing or another.
#include "cdprcal/diagnosis/search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/evidence/steps.hpp"

namespace cdprcal {
namespace {

using test::two_logs;
using test::two_runs_baseline;

/// Two runs with biased load cells and a drifting yaw (dense.hpp), nothing accepted yet.
const DiagnosisModel& plain() {
  static const DiagnosisModel model = two_runs_baseline();
  return model;
}

DiagnosisModel baseline_of(Log log) {
  std::vector<Log> logs{std::move(log)};
  std::vector<std::string> left_out;
  return baseline_model(load_robot("irma4"), logs, left_out);
}

std::vector<std::string> names(const DiagnosisModel& model) {
  std::vector<std::string> out;
  for (const EffectTerm& term : model.effects) out.push_back(term.effect->name());
  return out;
}
std::vector<std::string> names(const Diagnosis& d) {
  std::vector<std::string> out;
  for (const NamedEffect& effect : d.effects) out.push_back(effect.effect->name());
  return out;
}

using Names = std::vector<std::string>;

/// A model and what was said of it, on the way.
struct Progress {
  DiagnosisModel model;
  Diagnosis out;
  DiagnoseOptions options;
  std::vector<Log> logs = {};

  explicit Progress(DiagnosisModel start) : model(std::move(start)) {}
  Search search() { return {logs, model, out, options}; }
  /// Puts an effect into the model as if it had been accepted.
  void take(const std::string& name) {
    const auto effect = find_effect(name);
    const bool by_run = effect->info().scope == EffectScope::run;
    const auto runs = static_cast<Eigen::Index>(by_run ? model.runs.size() : 1);
    const DiagnosisModel before = model;
    model.effects.push_back({effect, EffectValues::Zero(effect->size(4) * runs)});
    ASSERT_TRUE(fit_with_noise(model));
    NamedEffect found;
    found.effect = effect;
    CandidateScore score;
    score.effect = effect;
    score.values = model.effects.back().values;
    found.log_evidence = EvidenceAgainst(before).refit(score).log_evidence;
    out.effects.push_back(found);
  }
};

TEST(Search, ForwardAcceptsWhatIsThereAndNothingElse) {
  Progress p(plain());
  EXPECT_TRUE(p.search().forward());
  Names found = names(p.model);
  EXPECT_EQ(found, names(p.out));
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, (Names{"load_cell_bias", "yaw_drift"}));
  for (const NamedEffect& effect : p.out.effects) {
    EXPECT_GT(effect.log_evidence, p.options.least_evidence);
    EXPECT_LT(effect.p_value, p.options.family_wise_p);
    EXPECT_LT(effect.held_out_after, effect.held_out_before);
    EXPECT_TRUE(effect.where.empty());
  }
  // What was left after each step was written down, in the reading's units.
  for (const NamedEffect& effect : p.out.effects) {
    std::vector<std::string> channels;
    for (const Gap& gap : p.out.gap) {
      if (gap.after_effect == effect.effect->name()) channels.push_back(gap.channel);
    }
    EXPECT_EQ(channels,
              (Names{"length_m", "swivel_rad", "roll_pitch_rad", "yaw_rad", "tension_N"}));
  }
}

TEST(Search, NoChanceOfAFalseAlarmIsNoAccusation) {
  Progress p(plain());
  p.options.family_wise_p = 0.0;
  Search search = p.search();
  EXPECT_TRUE(search.forward());
  EXPECT_TRUE(p.model.effects.empty());
  EXPECT_FALSE(search.left().has_value());
  ASSERT_FALSE(p.out.rejected.empty());
  for (const RejectedEffect& rejected : p.out.rejected) {
    EXPECT_EQ(rejected.reason.find("chance does as well (family-wise p = "), 0U) << rejected.name;
  }
}

TEST(Search, EvidenceBelowWhatIsAskedForIsNotEvenTried) {
  Progress p(plain());
  p.options.least_evidence = 1e6;
  EXPECT_TRUE(p.search().forward());
  EXPECT_TRUE(p.model.effects.empty());
  EXPECT_TRUE(p.out.rejected.empty());
}

TEST(Search, AcceptsSoManyEffectsAndNoMore) {
  Progress p(plain());
  p.options.most_effects = 1;
  Search search = p.search();
  EXPECT_TRUE(search.forward());
  EXPECT_EQ(p.model.effects.size(), 1U);
  ASSERT_EQ(p.out.next.size(), 1U);
  EXPECT_EQ(p.out.next[0], "no more than 1 effects were looked for; there may be others");
}

TEST(Search, AnImplausibleValueIsNoExplanation) {
  // A yaw that drifts faster than that of any AHRS.
  const double rate_rad_s = 1.5 * find_effect("yaw_drift")->plausible(load_robot("irma4"))[0];
  Log log = test::startup_log(load_robot("irma4"), 0.2, 73);
  log.roll_pitch_yaw_rad.col(2) += rate_rad_s * log.time_s;
  Progress p(baseline_of(log));
  Search search = p.search();
  EXPECT_TRUE(search.forward());
  const auto drift = std::find_if(p.out.rejected.begin(), p.out.rejected.end(),
                                  [](const auto& r) { return r.name == "yaw_drift"; });
  ASSERT_NE(drift, p.out.rejected.end());
  EXPECT_EQ(drift->reason, "the value it would need is physically implausible");
  const Names found = names(p.model);
  EXPECT_EQ(std::count(found.begin(), found.end(), "yaw_drift"), 0);
  ASSERT_TRUE(search.left().has_value());
  EXPECT_EQ(generic_name(*search.left()->effect)->channel, "yaw");
}

TEST(Search, StopsWhereItIsToldToAndKeepsWhatWasAccepted) {
  Progress p(plain());
  p.options.progress = [](const std::string& step) { return step.find("accepted") != 0; };
  EXPECT_FALSE(p.search().forward());
  EXPECT_EQ(p.model.effects.size(), 1U);
  EXPECT_EQ(p.out.effects.size(), 1U);
  Progress none(plain());
  none.options.progress = [](const std::string&) { return false; };
  EXPECT_FALSE(none.search().forward());
  EXPECT_TRUE(none.model.effects.empty());
}

/// The best refits of some candidates.
std::vector<Refit> refitted(const DiagnosisModel& model, const Candidates& candidates, int most) {
  return EvidenceAgainst(model).refits(scan(model, candidates, {.draws = 0}), most,
                                       [](const CandidateScore&) { return true; });
}

/// Load cells read too much by a share of what they carry, and a little too little each.
const DiagnosisModel& with_gain() {
  static const DiagnosisModel model = [] {
    Log log = test::startup_log(load_robot("irma4"), 0.2, 74);
    const Eigen::RowVector4d gain(0.09, -0.08, 0.07, -0.1);
    log.tension_N.array().rowwise() *= 1.0 + gain.array();
    return baseline_of(log);
  }();
  return model;
}

TEST(Search, ExchangePutsTheTruthInThePlaceOfWhatImitatesIt) {
  Progress p(with_gain());
  p.take("load_cell_bias");
  p.take("yaw_drift");
  p.options.rival_share = 0.2;  // a gain does some of what a bias does
  const double wrong = p.out.effects[0].log_evidence;
  EXPECT_TRUE(p.search().exchange());
  EXPECT_EQ(names(p.model), (Names{"load_cell_gain", "yaw_drift"}));  // in its place
  EXPECT_EQ(names(p.out), names(p.model));
  EXPECT_GT(p.out.effects[0].log_evidence, wrong);
  EXPECT_LT(p.out.effects[0].held_out_after, p.out.effects[0].held_out_before);
  ASSERT_EQ(p.out.rejected.size(), 1U);
  EXPECT_EQ(p.out.rejected[0].name, "load_cell_bias");
  EXPECT_NE(p.out.rejected[0].reason.find("load_cell_gain explains the readings better"),
            std::string::npos);
  const Eigen::Vector4d gain(0.09, -0.08, 0.07, -0.1);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(p.model.effects[0].values[i], gain[i], 0.02);
  ASSERT_FALSE(p.out.gap.empty());
  EXPECT_EQ(p.out.gap.back().after_effect, "load_cell_gain");
  // The truth is not exchanged for anything.
  const DiagnosisModel settled = p.model;
  EXPECT_FALSE(p.search().exchange());
  EXPECT_EQ(names(p.model), names(settled));
  EXPECT_EQ(p.model.effects[0].values, settled.effects[0].values);
  EXPECT_EQ(p.out.rejected.size(), 1U);
}

TEST(Search, ExchangeKeepsTheOrderOfTheOthers) {
  Progress p(with_gain());
  for (const char* name : {"yaw_drift", "load_cell_bias", "load_cell_drift"}) p.take(name);
  p.options.rival_share = 0.2;
  EXPECT_TRUE(p.search().exchange());
  EXPECT_EQ(names(p.model), (Names{"yaw_drift", "load_cell_gain", "load_cell_drift"}));
  EXPECT_EQ(names(p.out), names(p.model));
}

TEST(Search, TheFirstOfTheCatalogueIsExchangedForAndARivalToo) {
  Log log = test::startup_log(load_robot("irma4"), 0.1, 83);
  const Eigen::RowVector4d ratio(0.02, -0.015, 0.01, -0.02);
  log.length_m.array().rowwise() *= 1.0 + ratio.array();
  Progress p(baseline_of(log));
  p.take("cable_elasticity");
  p.search().find_rivals();
  const Names& rivals = p.out.effects[0].rivals;
  EXPECT_EQ(std::count(rivals.begin(), rivals.end(), "transmission_ratio"), 1);
  p.options.rival_share = 0.05;
  EXPECT_TRUE(p.search().exchange());
  EXPECT_EQ(names(p.model), Names{effect_catalogue().front()->name()});
  EXPECT_EQ(names(p.model), Names{"transmission_ratio"});
}

TEST(Search, ExchangeTakesNoImplausibleValue) {
  const double limit = find_effect("load_cell_gain")->plausible(load_robot("irma4"))[0];
  Log log = test::startup_log(load_robot("irma4"), 0.1, 74);
  const Eigen::RowVector4d gain(0.5, -0.4, 0.3, -1.3);
  log.tension_N.array().rowwise() *= 1.0 + limit * gain.array();
  Progress p(baseline_of(log));
  p.take("load_cell_bias");
  p.options.rival_share = 0.2;
  const std::optional<DiagnosisModel> without = without_effect(p.model, 0);
  const std::vector<Refit> refits =
      refitted(*without, {find_effect("load_cell_gain"), find_effect("load_cell_bias")}, 2);
  ASSERT_EQ(refits[0].score.effect->name(), "load_cell_gain");       // explains more, with a value
  ASSERT_FALSE(plausible(refits[0].model.effects.back(), p.model));  // that no load cell has
  p.search().exchange();
  EXPECT_EQ(names(p.model), Names{"load_cell_bias"});
}

TEST(Search, WhatIsFarAboveChanceNeedsNoDraws) {
  Progress p(with_gain());
  p.options.scan.draws = 499;
  ASSERT_TRUE(p.search().forward());
  ASSERT_EQ(names(p.model), Names{"load_cell_gain"});
  EXPECT_DOUBLE_EQ(p.out.effects[0].p_value, 1.0 / 500.0);
}

TEST(Search, ExchangeAsksOnlyThoseThatImitate) {
  Progress p(with_gain());
  p.take("load_cell_bias");
  p.options.rival_share = 1.0;  // nothing imitates all of it
  EXPECT_FALSE(p.search().exchange());
  EXPECT_EQ(names(p.model), Names{"load_cell_bias"});
  EXPECT_TRUE(p.out.rejected.empty());
}

TEST(Search, DropsWhatTheLaterEffectsMadeNeedless) {
  // The mass stands in for the bias, as far as it can, wherever it came in.
  for (const Names& order :
       {Names{"mass", "load_cell_bias", "yaw_drift"}, {"yaw_drift", "mass", "load_cell_bias"}}) {
    Progress p(plain());
    for (const std::string& name : order) p.take(name);
    p.search().drop();
    Names left = order;
    std::erase(left, "mass");
    EXPECT_EQ(names(p.model), left);
    EXPECT_EQ(names(p.out), left);
    ASSERT_EQ(p.out.rejected.size(), 1U);
    EXPECT_EQ(p.out.rejected[0].name, "mass");
    EXPECT_EQ(p.out.rejected[0].reason, "needless once the later effects are in");
  }
}

TEST(Search, TheLastEffectWasJustAcceptedAndIsNotDropped) {
  Progress p(plain());
  p.take("load_cell_bias");
  p.take("yaw_drift");
  p.take("mass");
  p.search().drop();
  EXPECT_EQ(names(p.model), (Names{"load_cell_bias", "yaw_drift", "mass"}));
  EXPECT_TRUE(p.out.rejected.empty());
}

/// Load cells whose reading bends: in the catalogue only gain and bias come near.
DiagnosisModel with_bent_cells() {
  Log log = test::startup_log(load_robot("irma4"), 0.1, 75);
  log.tension_N.array() += 8e-4 * log.tension_N.array().square();
  return baseline_of(log);
}

TEST(Search, WhatNoNameExplainsIsLeftWithItsChannelAndDependence) {
  Progress p(with_bent_cells());
  Search search = p.search();
  EXPECT_TRUE(search.forward());
  ASSERT_TRUE(search.left().has_value());
  const GenericName what = *generic_name(*search.left()->effect);
  EXPECT_EQ(what.channel, "tension");
  EXPECT_EQ(what.depends_on, "reading");
  EXPECT_GT(search.left()->log_evidence, p.options.least_evidence);
  // Names were weighed against it, alone and together.
  const bool weighed =
      std::any_of(p.out.rejected.begin(), p.out.rejected.end(), [](const RejectedEffect& r) {
        return r.reason.find(
                   "a mere dependence of tension on reading explains the readings "
                   "better") == 0;
      });
  EXPECT_TRUE(weighed);
}

/// A bump of the yaw is no drift, though a drift takes some of it. The load cells read too much by
/// these.
DiagnosisModel with_bump(const Eigen::RowVector4d& bias_N = Eigen::RowVector4d::Zero()) {
  Log log = test::log_with_bump();
  log.tension_N.rowwise() += bias_N;
  return baseline_of(log);
}

TEST(Search, WithdrawsANameThatOnlyStoodInForADependence) {
  const DiagnosisModel plain = with_bump();
  Progress p(plain);
  p.take("yaw_drift");
  p.options.most_effects = 1;  // accept nothing more, but look
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  ASSERT_TRUE(search.left().has_value());
  EXPECT_EQ(generic_name(*search.left()->effect)->channel, "yaw");
  EXPECT_EQ(generic_name(*search.left()->effect)->depends_on, "time");
  search.withdraw();
  EXPECT_TRUE(p.model.effects.empty());
  EXPECT_TRUE(p.out.effects.empty());
  ASSERT_EQ(p.out.rejected.size(), 1U);
  EXPECT_EQ(p.out.rejected[0].name, "yaw_drift");
  EXPECT_EQ(p.out.rejected[0].reason,
            "only stood in for what is unexplained: a dependence of yaw on time");
  // The model is fitted again without it.
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    EXPECT_NEAR(p.model.noise[c], plain.noise[c], 0.02 * plain.noise[c]) << c;
  }
}

TEST(Search, WithdrawsOnlyWhatStoodIn) {
  Progress p(with_bump({9.0, -7.0, 8.0, -6.0}));
  p.take("load_cell_bias");
  p.take("yaw_drift");
  p.options.most_effects = 2;
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  ASSERT_TRUE(search.left().has_value());
  search.withdraw();
  EXPECT_EQ(names(p.model), Names{"load_cell_bias"});
  EXPECT_EQ(names(p.out), Names{"load_cell_bias"});
  ASSERT_EQ(p.out.rejected.size(), 1U);
  EXPECT_EQ(p.out.rejected[0].name, "yaw_drift");
}

TEST(Search, KeepsANameThatHoldsBesideADependence) {
  Log log = test::startup_log(load_robot("irma4"), 0.1, 75);
  log.tension_N.array() += 8e-4 * log.tension_N.array().square();
  log.roll_pitch_yaw_rad.col(2) += 5e-4 * log.time_s;
  Progress p(baseline_of(log));
  p.take("yaw_drift");
  p.options.most_effects = 1;
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  ASSERT_TRUE(search.left().has_value());
  search.withdraw();
  EXPECT_EQ(names(p.model), Names{"yaw_drift"});
  EXPECT_EQ(names(p.out), Names{"yaw_drift"});
  EXPECT_TRUE(p.out.rejected.empty());
}

TEST(Search, WithdrawsNothingWhereNothingIsLeft) {
  Progress p(plain());
  p.take("load_cell_bias");
  p.take("yaw_drift");
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  EXPECT_FALSE(search.left().has_value());
  const DiagnosisModel before = p.model;
  search.withdraw();
  EXPECT_EQ(names(p.model), names(before));
  EXPECT_EQ(p.model.effects[0].values, before.effects[0].values);
}

TEST(Search, RivalsAreThoseThatDoTheSame) {
  // A common shift of the platform's anchors is a shift of its centre of mass.
  Robot moved = load_robot("irma4");
  for (Cable& cable : moved.cables) cable.platform_anchor_m.x() += 0.003;
  Progress p(baseline_of(test::startup_log(moved, 0.1, 76, 3)));
  ASSERT_TRUE(p.search().forward());
  ASSERT_EQ(p.out.effects.size(), 1U);
  p.search().find_rivals();
  Names both = p.out.effects[0].rivals;
  EXPECT_EQ(std::count(both.begin(), both.end(), names(p.out)[0]), 0);  // not its own
  both.push_back(names(p.out)[0]);
  for (const char* one : {"centre_of_mass", "platform_anchors"}) {
    EXPECT_EQ(std::count(both.begin(), both.end(), one), 1) << one;
  }
  for (const char* other : {"yaw_drift", "cable_sag", "load_cell_drift"}) {
    EXPECT_EQ(std::count(both.begin(), both.end(), other), 0) << other;
  }
}

TEST(Search, WhatImitatesButIsFarLessProbableIsNoRival) {
  Progress p(with_gain());
  p.take("load_cell_gain");
  p.options.rival_share = 0.2;  // a bias does some of what a gain does
  const auto bias_is_rival = [&](double nats) {
    p.options.rival_nats = nats;
    p.out.effects[0].rivals.clear();
    p.search().find_rivals();
    const Names& rivals = p.out.effects[0].rivals;
    return std::count(rivals.begin(), rivals.end(), "load_cell_bias") == 1;
  };
  const DiagnosisModel baseline = *without_effect(p.model, 0);
  const std::vector<Refit> refits =
      refitted(baseline, {find_effect("load_cell_gain"), find_effect("load_cell_bias")}, 2);
  ASSERT_EQ(refits[1].score.effect->name(), "load_cell_bias");
  const double nats = refits[0].log_evidence - refits[1].log_evidence;
  ASSERT_GT(nats, 5.0);
  EXPECT_TRUE(bias_is_rival(1.2 * nats));   // as probable as that
  EXPECT_TRUE(bias_is_rival(nats / 2.0));   // less, but it imitates
  EXPECT_FALSE(bias_is_rival(nats / 4.0));  // told apart all the same
  p.options.rival_share = 0.97;
  EXPECT_FALSE(bias_is_rival(nats / 2.0));  // less, and it does not imitate so much
}

TEST(Search, RivalsAreNoneForWhatNothingImitates) {
  Progress p(plain());
  p.take("load_cell_bias");
  p.take("yaw_drift");
  p.search().find_rivals();
  EXPECT_TRUE(p.out.effects[1].rivals.empty()) << p.out.effects[1].rivals.front();
  // Whoever asks for no difference at all is given every effect that was refitted.
  p.options.rival_nats = 1e9;
  for (NamedEffect& effect : p.out.effects) effect.rivals.clear();
  p.search().find_rivals();
  for (const NamedEffect& effect : p.out.effects) {
    EXPECT_GE(static_cast<int>(effect.rivals.size()), p.options.refits - 1);
  }
}

/// The log as it is when a cable, the third unless told, slips by 3 cm.
Log with_slip(Log log, double at_s, int cable = 2) {
  for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
    if (log.time_s[i] > at_s) log.length_m(i, cable) -= 0.03;
  }
  return log;
}

TEST(Search, ASlipBearsTheNumberOfMovesAndCablesThatItIsTheLikeliestOf) {
  const Robot robot = load_robot("irma4");
  const Log clean = test::startup_log(robot, 0.2, 79, 0);
  int refused = 0, checked = 0;
  for (double size_m = 0.0005; size_m < 0.02; size_m *= 1.12) {
    Log log = clean;
    log.length_m.col(1).tail(log.sample_count() - 8 * 40 + 20).array() -= size_m;
    Progress p(baseline_of(log));
    const Candidates steps = step_candidates(p.model);
    const CandidateScore likeliest = scan(p.model, steps, {.draws = 0}).front();
    const double choice = std::log(static_cast<double>(steps.size()));
    const double score = likeliest.log_evidence - choice;
    const double after_refit = EvidenceAgainst(p.model).refit(likeliest).log_evidence - choice;
    const double by_chance = std::exp(-after_refit);
    ASSERT_TRUE(p.search().forward());
    if (p.out.effects.empty()) {
      refused += score > 0.0 ? 1 : 0;
      continue;
    }
    ASSERT_EQ(names(p.model), Names{"cable_slip"}) << size_m;
    EXPECT_LT(by_chance, 0.8 * p.options.family_wise_p);
    EXPECT_NEAR(p.out.effects[0].log_evidence, after_refit, 1e-6 * after_refit);
    EXPECT_NEAR(p.out.effects[0].p_value, by_chance, 1e-6 * by_chance);
    ++checked;
  }
  EXPECT_GT(refused, 0);  // more likely than nothing, but one of so many
  EXPECT_GT(checked, 0);
}

TEST(Search, ASlipIsFoundAmongManyMoves) {
  // More than are looked at together: the first of all, at the third move, and the last.
  const Log clean = test::startup_log(load_robot("irma4"), 0.1, 80);
  for (const auto& [move, cable] : {std::pair{1, 0}, std::pair{3, 2}, std::pair{17, 3}}) {
    SCOPED_TRACE(move);
    const double at_s = 8.0 * move - 2.0;
    Progress p(baseline_of(with_slip(clean, at_s, cable)));
    ASSERT_GT(step_candidates(p.model).size(), 64U);
    ASSERT_TRUE(p.search().forward());
    ASSERT_EQ(names(p.model), Names{"cable_slip"});
    EXPECT_NEAR(p.out.effects[0].where[0].second, at_s, 1.0);
    EXPECT_EQ(p.out.effects[0].where[1].second, cable + 1.0);
  }
}

TEST(Search, WhatPartsTheFirstRestIsNamed) {
  constexpr double kFirstMove_s = 6.0;
  const Log clean = test::startup_log(load_robot("irma4"), 0.1, 83);
  Log brakes = clean, floor = clean;
  for (Eigen::Index i = 0; i < clean.sample_count(); ++i) {
    if (clean.time_s[i] > kFirstMove_s) {
      brakes.length_m.row(i) -= Eigen::RowVector4d(0.004, 0.006, 0.005, 0.003);
    } else {
      floor.tension_N.row(i) *= 0.8;
    }
  }
  for (const auto& [log, name] : {std::pair(brakes, "cable_slip"), std::pair(floor, "contact")}) {
    Progress p(baseline_of(log));
    Search search = p.search();
    ASSERT_TRUE(search.forward());
    search.drop();
    ASSERT_EQ(names(p.model), Names{name});
    ASSERT_EQ(p.out.effects[0].where.size(), 1U);  // of no cable
    EXPECT_NEAR(p.out.effects[0].where[0].second, kFirstMove_s, 1.0);
  }
}

TEST(Search, OneLoadCellThatWasOffIsNoFloor) {
  constexpr double kFirstMove_s = 6.0, kThird_s = 8.0 * 3.0 - 2.0;
  const Log clean = test::startup_log(load_robot("irma4"), 0.1, 86);
  Log until = clean, after = clean;
  for (Eigen::Index i = 0; i < clean.sample_count(); ++i) {
    if (clean.time_s[i] < kFirstMove_s) until.tension_N(i, 2) -= 8.0;
    if (clean.time_s[i] > kThird_s) after.tension_N(i, 1) += 8.0;
  }
  struct Case {
    const Log& log;
    double time_s, cable, bias_N;
  };
  for (const Case& c : {Case{until, kFirstMove_s, 3.0, -8.0}, Case{after, kThird_s, 2.0, 8.0}}) {
    Progress p(baseline_of(c.log));
    Search search = p.search();
    ASSERT_TRUE(search.forward());
    search.drop();
    ASSERT_EQ(names(p.model), Names{"load_cell_shift"});
    ASSERT_EQ(p.out.effects[0].where.size(), 2U);
    EXPECT_NEAR(p.out.effects[0].where[0].second, c.time_s, 1.0);
    EXPECT_EQ(p.out.effects[0].where[1].second, c.cable);
    EXPECT_NEAR(p.model.effects[0].values[0], c.bias_N, 1.5);
  }
}

TEST(Search, WhatFadesWhileThePlatformRestsIsNoFloor) {
  constexpr double kFirstMove_s = 6.0, kFaded_s = 1.8;
  const Log clean = test::startup_log(load_robot("irma4"), 0.1, 85);
  Log stays = clean, fades = clean;
  for (Eigen::Index i = 0; i < clean.sample_count() && clean.time_s[i] < kFirstMove_s; ++i) {
    stays.tension_N.row(i) *= 0.9;
    if (clean.time_s[i] < kFaded_s) fades.tension_N.row(i) *= 0.8;
  }
  for (const auto& [log, found] : {std::pair(stays, Names{"contact"}), std::pair(fades, Names{})}) {
    // Both read the same in the mean.
    Progress p(baseline_of(stays));
    p.logs = {log};
    ASSERT_TRUE(p.search().forward());
    EXPECT_EQ(names(p.model), found);
    const bool said = std::ranges::any_of(p.out.rejected, [](const RejectedEffect& r) {
      return r.name == "contact" && r.reason.find("fades") != std::string::npos;
    });
    EXPECT_EQ(said, found.empty());
  }
}

TEST(Search, WhatFrictionLeavesOpenOfTheFirstRestIsNoFloor) {
  constexpr double kShare = 0.08;
  const Log clean = test::startup_log(load_robot("irma4"), 0.1, 84);
  DiagnosisModel model = baseline_of(clean);
  for (DiagnosisRun& run : model.runs) {
    for (Measurement& m : run.measurements) {
      m.tension_N.array() *= 1.0 + kShare * m.length_direction.array();
    }
  }
  // Two cables came from the other side before power-on.
  Measurement& first = model.runs[0].measurements.front();
  for (const int cable : {0, 2}) {
    first.tension_N[cable] *= 1.0 + kShare * first.length_direction_open[cable];
  }
  ASSERT_TRUE(fit_with_noise(model));
  Progress p(model);
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  search.drop();
  EXPECT_EQ(names(p.model), Names{"pulley_friction"});
  EXPECT_TRUE(std::ranges::any_of(p.out.rejected, [](const RejectedEffect& r) {
    return r.name == "contact" && r.reason.find("known to be there") != std::string::npos;
  }));
}

TEST(Search, TwoNamesThatTogetherDoWhatADependenceDoesStand) {
  // Bias and gain of each cell: a dependence of tension on its reading is both at once, and
  // explains the readings better than either does.
  Log log = test::startup_log(load_robot("irma4"), 0.1, 82);
  const Eigen::RowVector4d gain(0.025, -0.022, 0.02, -0.03), bias(3.5, -3.0, 3.8, -2.8);
  log.tension_N.array().rowwise() *= 1.0 + gain.array();
  log.tension_N.rowwise() += bias;
  Progress p(baseline_of(log));
  Candidates cells{find_effect("load_cell_gain")};
  for (const auto& effect : generic_candidates(p.model)) cells.push_back(effect);
  const std::vector<Refit> refits = refitted(p.model, cells, 3);
  ASSERT_EQ(generic_name(*refits[0].score.effect)->depends_on, "reading");
  ASSERT_EQ(refits[1].score.effect->name(), "load_cell_gain");
  ASSERT_GT(refits[0].log_evidence, refits[1].log_evidence + p.options.rival_nats);
  Search search = p.search();
  ASSERT_TRUE(search.forward());
  Names found = names(p.model);
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, (Names{"load_cell_bias", "load_cell_gain"}));
  EXPECT_FALSE(search.left().has_value());
}

TEST(Search, ASlipIsNamedWithItsCableAndTime) {
  const Robot robot = load_robot("irma4");
  const double at_s = 8.0 * 3.0 - 2.0;  // in the middle of the third move
  const Diagnosis d = diagnose(robot, {with_slip(test::startup_log(robot, 0.1, 77, 0), at_s)});
  ASSERT_EQ(names(d), Names{"cable_slip"}) << test::summary(d);
  EXPECT_EQ(d.verdict, Verdict::explained);
  const NamedEffect& slip = d.effects[0];
  EXPECT_NEAR(slip.values[0], 0.03, 3.0 * slip.standard_deviation[0]);
  EXPECT_LT(slip.standard_deviation[0], 0.005);
  ASSERT_EQ(slip.where.size(), 2U);
  EXPECT_EQ(slip.where[0].first, "time_s");
  EXPECT_NEAR(slip.where[0].second, at_s, 1.0);
  EXPECT_EQ(slip.where[1], (std::pair<std::string, double>{"cable", 3.0}));
  EXPECT_LT(slip.p_value, 0.01);
  EXPECT_TRUE(d.corrected.effects.empty());  // of one moment of one log, not of the robot
}

}  // namespace
}  // namespace cdprcal
