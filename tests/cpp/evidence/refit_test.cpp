// What the diagnosis decides by: scores of the scan, evidence of the refit and prediction of poses
// left out, against the same quantities from one dense least-squares problem.
#include "cdprcal/evidence/refit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/held_out.hpp"

namespace cdprcal {
namespace {

using test::Dense;
using test::dense;
using test::two_runs;

/// The two runs with nothing but their noise in the model, once.
const DiagnosisModel& plain() {
  static const DiagnosisModel model = test::two_runs_baseline();
  return model;
}

/// The model with one more effect at zero: its last columns of the dense problem.
DiagnosisModel with_effect(const DiagnosisModel& model, const std::string& name) {
  DiagnosisModel out = model;
  const auto effect = find_effect(name);
  const bool by_run = effect->info().scope == EffectScope::run;
  out.effects.push_back(
      {effect, EffectValues::Zero(effect->size(4) * (by_run ? model.runs.size() : 1))});
  return out;
}

double log_determinant(const Eigen::MatrixXd& positive) {
  const Eigen::VectorXd unit = positive.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled =
      unit.cwiseInverse().asDiagonal() * positive * unit.cwiseInverse().asDiagonal();
  return Cholesky<Eigen::MatrixXd>(scaled).log_determinant() + 2.0 * unit.array().log().sum();
}

/// Occam's factor of a model's last effect: half the log of what the readings add to its prior's
/// precision once everything else is free.
double occam(const DiagnosisModel& model) {
  const Dense all = dense(linearise(model));
  const Eigen::Index own = model.effects.back().values.size();
  const Eigen::MatrixXd hessian = all.hessian();
  const Eigen::Index others = hessian.rows() - own;
  const double prior = all.precision.tail(own).array().log().sum();
  return 0.5 * (log_determinant(hessian) - log_determinant(hessian.topLeftCorner(others, others)) -
                prior);
}

/// log of the readings' probability at the model's noise, from the whole matrix: Gaussian rows,
/// poses and offsets integrated out under flat priors, values under theirs.
double log_probability(const DiagnosisModel& model) {
  const DiagnosisSystem system = linearise(model);
  const Dense all = dense(system);
  double total = -penalised_cost(model) - 0.5 * log_determinant(all.hessian());
  total += 0.5 * all.precision.tail(system.layout.accepted).array().log().sum();
  for (const SystemRow& row : system.rows) total -= std::log(row.scale);
  return total;
}

CandidateScore score_of(const std::vector<CandidateScore>& scores, const std::string& name) {
  const auto found = std::find_if(scores.begin(), scores.end(), [&](const CandidateScore& s) {
    return s.effect->name() == name;
  });
  EXPECT_NE(found, scores.end());
  return *found;
}

const std::vector<std::string> kNames{"load_cell_bias", "yaw_drift", "mass", "centre_of_mass",
                                      "transmission_ratio"};

Candidates candidates() {
  Candidates out;
  for (const std::string& name : kNames) out.push_back(find_effect(name));
  return out;
}

/// How the evidence changes where the balance is known half as well.
double evidence_of_the_level(DiagnosisModel model) {
  const double before = log_evidence(model);
  model.noise[static_cast<std::size_t>(at_rest(Channel::balance))] *= 2.0;
  return log_evidence(model) - before;
}

TEST(Refit, ABalanceWhoseMotionNobodyKnowsSaysNothingOfTheLevelOfTheOthers) {
  DiagnosisModel moving = plain(), without = plain();
  for (const std::size_t pose : {2U, 5U}) {
    moving.runs[1].measurements[pose].inertial_sigma = Vector6::Constant(1e6);
    without.runs[1].measurements[pose].balance_counts = false;
  }
  EXPECT_NEAR(evidence_of_the_level(moving), evidence_of_the_level(without), 1e-4);
  EXPECT_GT(std::abs(evidence_of_the_level(plain()) - evidence_of_the_level(without)), 1.0);
}

TEST(Refit, WhatIsNotKnownOfAMotionDoesNotShrinkWithTheNoise) {
  constexpr std::size_t kPose = 2;
  DiagnosisModel model = plain();
  Measurement& m = model.runs[1].measurements[kPose];
  m.inertial_sigma = Vector6::Constant(50.0);  // far beyond the model's own error
  const auto weight = [&] {
    const DiagnosisSystem system = linearise(model);
    double squares = 0.0;
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      if (pose.run != 1 || pose.pose != kPose) continue;
      for (Eigen::Index row = pose.begin; row < pose.begin + pose.size; ++row) {
        if (system.rows[static_cast<std::size_t>(row)].channel == at_rest(Channel::balance)) {
          squares += system.by_pose.row(row).squaredNorm();
        }
      }
    }
    return squares;
  };
  const double before = weight();
  model.noise[static_cast<std::size_t>(at_rest(Channel::balance))] *= 0.25;
  EXPECT_NEAR(weight() / before, 1.0, 0.05);
}

TEST(Scan, ValuesAndDeviationsAreThoseOfOneGaussNewtonStepWithTheEffectInTheModel) {
  const std::vector<CandidateScore> scores = scan(plain(), candidates(), {.draws = 0});
  for (const std::string& name : kNames) {
    SCOPED_TRACE(name);
    const CandidateScore score = score_of(scores, name);
    const Dense all = dense(linearise(with_effect(plain(), name)));
    const Eigen::MatrixXd spread = all.covariance();
    const Eigen::VectorXd step = -spread * all.gradient();
    const Eigen::Index own = score.values.size();
    const Eigen::VectorXd deviation = spread.diagonal().tail(own).cwiseSqrt();
    EXPECT_LE((score.values - step.tail(own)).norm(), 1e-5 * deviation.norm());
    EXPECT_LE((score.deviation - deviation).norm(), 1e-5 * deviation.norm());
  }
}

class ScanEvidence : public testing::TestWithParam<const DiagnosisModel& (*)()> {};

TEST_P(ScanEvidence, IsThatOfTheLinearModelWithItsNoiseUnknown) {
  const DiagnosisModel& model = GetParam()();
  const std::vector<CandidateScore> scores = scan(model, candidates(), {.draws = 0});
  const NoiseLevels freedom = dense(linearise(model)).freedom();
  for (const std::string& name : kNames) {
    SCOPED_TRACE(name);
    const DiagnosisModel extended = with_effect(model, name);
    const Dense all = dense(linearise(extended));
    const Eigen::VectorXd step = -all.covariance() * all.gradient();
    const Eigen::Index own = extended.effects.back().values.size();
    // Sums of squares before and after, with poses and offsets at their best each time.
    const auto profile = [&](const Eigen::VectorXd& values) {
      const Eigen::Index others = all.jacobian.cols() - own;
      const Eigen::MatrixXd rest = all.jacobian.leftCols(others);
      const Eigen::VectorXd unit = rest.colwise().norm().cwiseInverse();
      const Eigen::MatrixXd scaled = rest * unit.asDiagonal();
      const Eigen::VectorXd start = all.residual + all.jacobian.rightCols(own) * values;
      const Eigen::VectorXd left = start - scaled * least_squares(scaled, start).x;
      NoiseLevels squares{};
      for (std::size_t row = 0; row < all.channel.size(); ++row) {
        squares[all.channel[row]] += std::pow(left[static_cast<Eigen::Index>(row)], 2);
      }
      double total = 0.0;
      for (std::size_t c = 0; c < kRestGroups; ++c) {
        if (freedom[c] < 1.0) continue;
        const double level =
            std::max(std::sqrt(squares[c] / freedom[c]), model.floor[c] / model.noise[c]);
        total += freedom[c] * std::log(level) + 0.5 * squares[c] / (level * level);
      }
      return total;
    };
    const Eigen::VectorXd values = step.tail(own);
    const double prior =
        0.5 * values.cwiseProduct(all.precision.tail(own).cwiseSqrt()).squaredNorm();
    const double expected =
        profile(Eigen::VectorXd::Zero(own)) - profile(values) - prior - occam(extended);
    EXPECT_NEAR(score_of(scores, name).log_evidence, expected, 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(Readings, ScanEvidence, testing::Values(&plain, &test::few_readings));

TEST(Scan, FourOfFiveEffectsOfTheStatedSizeAreFound) {
  const Robot robot = load_robot("irma4");
  constexpr int kLogs = 80;
  const Diagnosis clean = diagnose(robot, {test::startup_log(robot, 0.2, 459, 0)});
  const auto stated = [&](const char* name) {
    for (const Identifiability& seen : clean.identifiability) {
      if (seen.name == name) return seen.detectable * find_effect(name)->typical(robot)[0];
    }
    return kNaN;
  };
  const double bias_N = stated("load_cell_bias"), rate_rad_s = stated("yaw_drift");
  RandomNormal random(7);
  int found_bias = 0, found_drift = 0;
  for (std::uint64_t seed = 0; seed < kLogs; ++seed) {
    Log log = test::startup_log(robot, 0.2, 460 + seed, 0);
    Eigen::RowVector4d direction(random(), random(), random(), random());
    Log off = log;
    off.tension_N.rowwise() += 1.3 * bias_N * 2.0 / direction.norm() * direction;
    Log drifting = log;
    drifting.roll_pitch_yaw_rad.col(2) += 1.3 * rate_rad_s * log.time_s;
    found_bias += diagnose(robot, {off}).effects.empty() ? 0 : 1;
    found_drift += diagnose(robot, {drifting}).effects.empty() ? 0 : 1;
  }
  EXPECT_GE(found_bias, 64);
  EXPECT_GE(found_drift, 64);
}

TEST(Scan, WhatTheReadingsDoNotShowHasNoLimit) {
  // What needs motion shows next to nothing in readings at rest.
  for (const CandidateScore& score :
       scan(plain(), {find_effect("sensor_delay")}, {.draws = 0, .limits = true})) {
    EXPECT_FALSE(score.visible);
    EXPECT_FALSE(score.detectable < 3.0);  // many typical sizes, or NaN: none at all
  }
  // Nobody asked.
  EXPECT_TRUE(std::isnan(scan(plain(), {find_effect("mass")}, {.draws = 0}).front().detectable));
}

/// Three poses of one run, without effects, as readings would be without noise.
DiagnosisModel three_poses() {
  DiagnosisModel model = plain();
  model.runs.resize(1);
  DiagnosisRun& run = model.runs[0];
  run.poses.resize(3);
  run.rows.resize(3);
  run.measurements.resize(3);
  return model;
}

/// The same with readings that are off by noise alone, of the levels that the model has.
DiagnosisModel with_noise(DiagnosisModel model, RandomNormal& random) {
  DiagnosisRun& run = model.runs[0];
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    Measurement& m = run.measurements[i];
    const PlatformState state = platform_state(model.robot, run.poses[i]);
    m.length_m = state.length_m() + run.offsets.head(4);
    m.swivel_rad = state.swivel_rad() + run.offsets.segment(4, 4);
    m.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, model.robot.euler_convention);
    m.roll_pitch_yaw_rad[2] += run.offsets[8];
    const auto add = [&](auto& values, double level) {
      for (double& v : values) v += level * random();
    };
    const test::PoseSystem system = test::poses_of(linearise(model))[i];
    const auto level = [&](NoiseGroup group) {
      for (std::size_t row = 0; row < system.channel.size(); ++row) {
        if (system.channel[row] == group) return system.scale[static_cast<Eigen::Index>(row)];
      }
      return 0.0;
    };
    add(m.length_m, level(at_rest(Channel::length)));
    add(m.swivel_rad, level(at_rest(Channel::swivel)));
    auto roll_pitch = m.roll_pitch_yaw_rad.head<2>();
    add(roll_pitch, level(at_rest(Channel::roll_pitch)));
    m.roll_pitch_yaw_rad[2] += level(at_rest(Channel::yaw)) * random();
    m.balance_counts = false;  // its noise is not of four readings
  }
  return model;
}

TEST(Scan, OnNoiseAlonePValuesAreUniform) {
  RandomNormal random(97);
  const Candidates tried{find_effect("transmission_ratio"), find_effect("swivel_scale"),
                         find_effect("ahrs_misalignment"), find_effect("platform_anchors")};
  constexpr int kTrials = 250, kDraws = 39;
  const DiagnosisModel exact = three_poses();
  double sum = 0.0;
  int below_tenth = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<CandidateScore> scores =
        scan(with_noise(exact, random), tried,
             {.draws = kDraws, .seed = static_cast<std::uint64_t>(trial) + 1});
    double least = 1.0;
    for (const CandidateScore& score : scores) least = std::min(least, score.p_value);
    EXPECT_EQ(least, scores.front().p_value);
    sum += least;
    below_tenth += least <= 0.1 ? 1 : 0;
  }
  // Four standard errors: the best of all candidates is as good as chance's best, no more, no less.
  EXPECT_NEAR(sum / kTrials, 0.5 + 0.5 / (kDraws + 1), 4.0 * 0.29 / std::sqrt(kTrials));
  EXPECT_NEAR(below_tenth, 0.1 * kTrials, 4.0 * std::sqrt(0.09 * kTrials));
}

TEST(Scan, OneDrawIsADraw) {
  RandomNormal random(98);
  int beaten = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const DiagnosisModel model = with_noise(three_poses(), random);
    const double p = scan(model, candidates(), {.draws = 1, .seed = seed}).front().p_value;
    EXPECT_TRUE(p == 0.5 || p == 1.0) << p;
    beaten += p == 1.0 ? 1 : 0;
  }
  EXPECT_GT(beaten, 0);
  EXPECT_LT(beaten, 20);
}

TEST(Scan, PValuesCountHowOftenChanceDoesAsWell) {
  const std::vector<CandidateScore> scores = scan(plain(), candidates(), {.draws = 99});
  EXPECT_DOUBLE_EQ(scores.front().p_value, 0.01);  // no draw is as good: one in a hundred at most
  for (std::size_t i = 0; i + 1 < scores.size(); ++i) {
    EXPECT_LE(scores[i].p_value, scores[i + 1].p_value);
  }
  for (const CandidateScore& s : scan(plain(), candidates(), {.draws = 0})) {
    EXPECT_EQ(s.p_value, 1.0);
  }
  EXPECT_GT(scores.back().p_value, 0.5);  // what explains nothing is beaten by most draws
}

TEST(Scan, BeyondChanceIsTenNatsAboveMarkovsBound) {
  CandidateScore score;
  const double bound = 10.0 + std::log(20.0 * 1000.0);
  score.log_evidence = bound + 1e-9;
  EXPECT_TRUE(beyond_chance(score, 20, 999));
  score.log_evidence = bound - 1e-9;
  EXPECT_FALSE(beyond_chance(score, 20, 999));
}

/// Shares of a signature, against the dense problem; and of the same signature a thousandth as
/// large.
void expect_shares(const CandidateScore& winner) {
  const std::vector<double> shares = imitation(plain(), winner, candidates());
  CandidateScore small = winner;
  small.values *= 1e-3;
  const std::vector<double> of_small = imitation(plain(), small, candidates());
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    SCOPED_TRACE(kNames[k]);
    const DiagnosisModel both = with_effect(with_effect(plain(), winner.effect->name()), kNames[k]);
    const Dense all = dense(linearise(both));
    const Eigen::Index own = both.effects.back().values.size(), its = winner.values.size();
    const Eigen::Index others = all.jacobian.cols() - own - its;
    const Eigen::MatrixXd rest = all.jacobian.leftCols(others);
    const Eigen::VectorXd unit = rest.colwise().norm().cwiseInverse();
    const Eigen::MatrixXd basis = range_basis(rest * unit.asDiagonal());
    const auto off = [&](const Eigen::MatrixXd& columns) -> Eigen::MatrixXd {
      return columns - basis * (basis.transpose() * columns);
    };
    const Eigen::VectorXd signature = off(all.jacobian.middleCols(others, its) * winner.values);
    const Eigen::MatrixXd columns = off(all.jacobian.rightCols(own));
    Eigen::MatrixXd posterior = columns.transpose() * columns;
    posterior.diagonal() += all.precision.tail(own);
    const Eigen::VectorXd product = columns.transpose() * signature;
    const Eigen::VectorXd taken = columns * solve_symmetric(posterior, product);
    EXPECT_NEAR(shares[k], 1.0 - (signature - taken).squaredNorm() / signature.squaredNorm(), 1e-6);
    EXPECT_NEAR(of_small[k], shares[k], 1e-9);
  }
}

TEST(Scan, ImitationIsTheShareOfTheSignatureThatARivalTakesUnderItsPrior) {
  CandidateScore bias, bending;
  bias.effect = find_effect("load_cell_bias");
  bias.values = Eigen::Vector4d(5.0, -3.0, 2.0, -6.0);
  bending.effect = find_effect("bending_hysteresis");  // values of two units
  bending.values = Eigen::Vector2d(2.0, 0.02);
  for (const CandidateScore& winner : {bias, bending}) expect_shares(winner);
  EXPECT_GT(imitation(plain(), bias, candidates())[0], 0.99);
  bias.values.setZero();  // nothing to imitate
  EXPECT_EQ(imitation(plain(), bias, candidates()), std::vector<double>(kNames.size(), 0.0));
}

/// More poses in one run than are evaluated side by side.
const DiagnosisModel& many_poses() {
  static const DiagnosisModel model = [] {
    std::vector<Log> logs{test::startup_log(load_robot("irma4"), 0.2, 73)};
    std::vector<std::string> left_out;
    return baseline_model(load_robot("irma4"), logs, left_out);
  }();
  return model;
}

TEST(Evidence, OfARefitIsTheRatioOfTheReadingsProbabilities) {
  ASSERT_EQ(many_poses().pose_count(), 18);
  for (const DiagnosisModel* model : {&plain(), &test::few_readings(), &many_poses()}) {
    const EvidenceAgainst against(*model);
    for (const CandidateScore& score : scan(*model, candidates(), {.draws = 0})) {
      SCOPED_TRACE(score.effect->name());
      const Refit refit = against.refit(score);
      ASSERT_EQ(refit.model.effects.size(), 1U);
      const double scale = refit.model.effects[0].prior_scale;
      const auto* const prior = std::ranges::find(kPriorScales, scale, &PriorScale::scale);
      ASSERT_NE(prior, std::end(kPriorScales));
      const double of_prior = log_prior_of(refit.model, 0);
      if (!score.effect->info().of_one_make) {
        EXPECT_EQ(of_prior, std::log(prior->probability));
      }
      const double expected = log_probability(refit.model) - log_probability(*model) + of_prior;
      EXPECT_NEAR(refit.log_evidence, expected, 1e-3);
    }
  }
}

TEST(Evidence, IsLargestAtTheNoiseThatTheResidualsShow) {
  // Its derivative by the logarithm of a channel's noise: the squares less the freedom.
  constexpr double kStep = 1e-4;
  for (const DiagnosisModel* model : {&plain(), &test::few_readings(), &many_poses()}) {
    for (std::size_t c = 0; c < kRestGroups; ++c) {
      SCOPED_TRACE(c);
      DiagnosisModel louder = *model;
      louder.noise[c] *= 2.0;
      for (DiagnosisRun& run : louder.runs) {  // means of fewer readings have a share of it
        for (Measurement& m : run.measurements) m.samples = 100;
      }
      louder.rest_samples = 100.0;
      ASSERT_TRUE(fit(louder));
      const ChannelSums sums = channel_sums(louder);
      DiagnosisModel above = louder, below = louder;
      above.noise[c] *= std::exp(kStep);
      below.noise[c] *= std::exp(-kStep);
      const double slope = (log_evidence(above) - log_evidence(below)) / (2.0 * kStep);
      EXPECT_NEAR(slope, sums.squares[c] - sums.freedom[c], 1e-3 * sums.freedom[c] + 1e-3);
    }
  }
}

TEST(Evidence, ChannelsWithoutReadingsSayNothing) {
  DiagnosisModel silent = plain();
  for (std::size_t c = kRestGroups; c < kNoiseGroups; ++c) {
    silent.floor[c] = silent.noise[c] = 0.0;  // nothing was read in motion, so nothing is known
  }
  const CandidateScore score = scan(plain(), {find_effect("mass")}, {.draws = 0}).front();
  EXPECT_EQ(scan(silent, {find_effect("mass")}, {.draws = 0}).front().log_evidence,
            score.log_evidence);
  EXPECT_EQ(EvidenceAgainst(silent).refit(score).log_evidence,
            EvidenceAgainst(plain()).refit(score).log_evidence);
}

TEST(Evidence, TheTruthBeatsTheRestAndAddsWhatIsThere) {
  const EvidenceAgainst against(plain());
  const std::vector<CandidateScore> scores = scan(plain(), candidates(), {.draws = 0});
  const std::vector<Refit> best =
      against.refits(scores, 3, [](const CandidateScore& s) { return s.effect->name() != "mass"; });
  ASSERT_EQ(best.size(), 3U);
  for (std::size_t i = 0; i + 1 < best.size(); ++i) {
    EXPECT_GE(best[i].log_evidence, best[i + 1].log_evidence);
  }
  for (const Refit& refit : best) EXPECT_NE(refit.score.effect->name(), "mass");
  EXPECT_EQ(against.refits(scores, 0, [](const CandidateScore&) { return true; }).size(), 0U);
}

TEST(Evidence, CountsThatValuesMayHaveOneCause) {
  const Log log = test::startup_log(load_robot("irma4"), 0.2, 51, 0);
  const auto of_ratios = [&](const std::vector<double>& shares) {
    Log off = log;
    for (int c = 0; c < 4; ++c) off.length_m.col(c) *= 1.0 + shares[static_cast<std::size_t>(c)];
    const DiagnosisModel without = diagnose(load_robot("irma4"), {off}).baseline;
    const auto scores = scan(without, {find_effect("transmission_ratio")}, {.draws = 0});
    const DiagnosisModel with = EvidenceAgainst(without).refit(scores.front()).model;
    const double scale = with.effects.back().prior_scale;
    const auto prior = std::ranges::find(kPriorScales, scale, &PriorScale::scale);
    return log_prior_of(with, with.effects.size() - 1) - std::log(prior->probability);
  };
  // One number is asked of the readings, not four: so much less is chance.
  EXPECT_GT(of_ratios({0.01, 0.01, 0.01, 0.01}), 2.0);
  // Or they have none, which is half of what could be.
  EXPECT_NEAR(of_ratios({0.02, -0.015, 0.025, 0.01}), std::log(0.5), 0.01);
}

/// Pulleys so large that every cable's anchor is inside: no pose is possible.
CandidateScore impossible() {
  CandidateScore score;
  score.effect = find_effect("pulley_radius");
  score.values = EffectValues::Constant(score.effect->size(4), 50.0);
  score.log_evidence = 1e6;  // of the scan: nothing that the refit would look at
  return score;
}

TEST(Evidence, OfAFitThatFailsIsBelowAllOthers) {
  const EvidenceAgainst against(plain());
  EXPECT_LT(against.refit(impossible()).log_evidence, -1e299);
  std::vector<CandidateScore> scores = scan(plain(), {find_effect("mass")}, {.draws = 0});
  scores.insert(scores.begin(), impossible());
  const std::vector<Refit> best =
      against.refits(scores, 2, [](const CandidateScore&) { return true; });
  ASSERT_EQ(best.size(), 2U);
  EXPECT_EQ(best[0].score.effect->name(), "mass");
  EXPECT_GT(best[0].log_evidence, -1e3);
}

TEST(Evidence, AModelThatCannotBeFittedIsNothing) {
  DiagnosisModel model = two_runs();
  model.effects.insert(model.effects.begin(), {impossible().effect, impossible().values});
  EXPECT_FALSE(linearise(model).valid);
  EXPECT_FALSE(fit(model));
  EXPECT_EQ(estimate_noise(model), 0.0);
  EXPECT_FALSE(without_effect(model, 1).has_value());
  EXPECT_TRUE(without_effect(model, 0).has_value());  // what made it impossible is gone
  // Nor does anything else say something about it.
  EXPECT_TRUE(scan(model, candidates(), {.draws = 0}).empty());
  CandidateScore winner;
  winner.effect = find_effect("mass");
  winner.values = EffectValues::Constant(1, 0.5);
  EXPECT_EQ(imitation(model, winner, candidates()), std::vector<double>(kNames.size(), 0.0));
  const HeldOut held = held_out(model, two_runs());
  EXPECT_EQ(held.gain, 0.0);
  EXPECT_EQ(held.gain_error, 0.0);
  EXPECT_EQ(held_out(two_runs(), model).gain, 0.0);
}

TEST(Evidence, WithoutAnEffectTheOthersStayAndAreFittedAgain) {
  const DiagnosisModel& model = two_runs();
  const std::optional<DiagnosisModel> without = without_effect(model, 0);
  ASSERT_TRUE(without.has_value());
  ASSERT_EQ(without->effects.size(), 1U);
  EXPECT_EQ(without->effects[0].effect->name(), "yaw_drift");
  EXPECT_GT(without->noise[4], 2.0 * model.noise[4]);  // the load cells' bias is noise to it
  // Adding it again gives back what was there.
  CandidateScore score;
  score.effect = model.effects[0].effect;
  score.values = model.effects[0].values;
  const Refit again = EvidenceAgainst(*without).refit(score);
  EXPECT_GT(again.log_evidence, 20.0);
  const Eigen::VectorXd deviation =
      dense(linearise(again.model)).covariance().diagonal().tail(4).cwiseSqrt();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(again.model.effects[1].values[i], model.effects[0].values[i], 0.5 * deviation[i]);
  }
}

TEST(Evidence, ValuesAreBelievableUpToTheirLimitOnEitherSide) {
  DiagnosisModel model;
  model.robot = load_robot("irma4");
  const auto bias = find_effect("load_cell_bias");
  const double limit = bias->plausible(model.robot)[0];
  const auto believable = [&](const Eigen::VectorXd& values) {
    return plausible({bias, values}, model);
  };
  EXPECT_TRUE(believable(Eigen::Vector4d(limit, -limit, 0.0, 0.0)));
  EXPECT_FALSE(believable(Eigen::Vector4d(1.001 * limit, 0.0, 0.0, 0.0)));
  EXPECT_FALSE(believable(Eigen::Vector4d(0.0, 0.0, 0.0, -1.001 * limit)));
  // Values of several runs, one after the other.
  const auto drift = find_effect("yaw_drift");
  const double rate = drift->plausible(model.robot)[0];
  EXPECT_TRUE(plausible({drift, Eigen::Vector2d(rate, -rate)}, model));
  EXPECT_FALSE(plausible({drift, Eigen::Vector2d(0.0, 2.0 * rate)}, model));
}

TEST(Evidence, InMotionFrictionDoesNotDrive) {
  DiagnosisModel model;
  model.robot = load_robot("irma4");
  model.runs.emplace_back().measurements.resize(2);
  const EffectTerm driving{find_effect("pulley_friction"), Eigen::VectorXd::Constant(1, -1e-3)};
  EXPECT_TRUE(plausible(driving, model));  // what rests do not tell
  model.runs.front().measurements.back().twist.setOnes();
  EXPECT_FALSE(plausible(driving, model));
  const EffectTerm rubbing{driving.effect, -driving.values};
  EXPECT_TRUE(plausible(rubbing, model));
}

/// Squares of held-out poses, each with its own pose free, common unknowns from the other folds.
double left_out(const Dense& all, const std::vector<int>& fold_of_pose, std::size_t pose,
                const std::vector<Eigen::Index>& begin) {
  const Eigen::Index others = all.jacobian.cols() - all.poses;
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(others, others);
  hessian.diagonal() = all.precision.tail(others);
  Eigen::VectorXd gradient =
      all.precision.tail(others).cwiseSqrt().cwiseProduct(all.prior_residual.tail(others));
  const auto rows = [&](std::size_t i) {
    const Eigen::Index first = begin[i], count = begin[i + 1] - begin[i];
    const Eigen::MatrixXd own =
        all.jacobian.block(first, 6 * static_cast<Eigen::Index>(i), count, 6);
    const Eigen::MatrixXd basis = range_basis(own);
    const Eigen::MatrixXd common = all.jacobian.block(first, all.poses, count, others);
    const Eigen::VectorXd residual = all.residual.segment(first, count);
    return std::pair<Eigen::MatrixXd, Eigen::VectorXd>(
        common - basis * (basis.transpose() * common),
        residual - basis * (basis.transpose() * residual));
  };
  for (std::size_t i = 0; i < fold_of_pose.size(); ++i) {
    if (fold_of_pose[i] == fold_of_pose[pose]) continue;
    const auto [common, residual] = rows(i);
    hessian += common.transpose() * common;
    gradient += common.transpose() * residual;
  }
  const Eigen::VectorXd unit = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
  const Eigen::VectorXd right = unit.asDiagonal() * gradient;
  const Eigen::VectorXd step = -(unit.asDiagonal() * solve_symmetric(scaled, right));
  const auto [common, residual] = rows(pose);
  return 0.5 * (residual + common * step).squaredNorm();
}

TEST(HeldOutPoses, AreExplainedWithWhatTheOthersTaught) {
  const DiagnosisModel& after = two_runs();
  DiagnosisModel before = plain();
  const HeldOut held = held_out(before, after);
  before.noise = after.noise;
  const DiagnosisSystem system = linearise(after);
  const Dense dense_before = dense(linearise(before)), dense_after = dense(system);
  const std::size_t count = system.poses.size();
  std::vector<Eigen::Index> begin{0};
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    begin.push_back(begin.back() + pose.residual.size());
  }
  // Blocks of time: a quarter of each run. Regions: along the axis in which the poses lie.
  Eigen::MatrixXd position(static_cast<Eigen::Index>(count), 3);
  for (std::size_t i = 0; i < count; ++i) {
    const test::PoseSystem pose = test::poses_of(system)[i];
    position.row(static_cast<Eigen::Index>(i)) = after.runs[pose.run].poses[pose.pose].position_m;
  }
  const Eigen::MatrixXd centred = position.rowwise() - position.colwise().mean();
  const SymmetricEigen<Eigen::MatrixXd> axes(centred.transpose() * centred);
  const Eigen::VectorXd along = centred * axes.eigenvectors().col(2);
  ASSERT_EQ(count % 4, 0U);
  std::vector<int> by_time(count), by_region(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t own = after.runs[system.poses[i].run].poses.size();
    by_time[i] = static_cast<int>(4 * system.poses[i].pose / own);
    const auto before_it = (along.array() < along[static_cast<Eigen::Index>(i)]).count();
    by_region[i] = static_cast<int>(4 * static_cast<std::size_t>(before_it) / count);
  }
  double sum_before = 0.0, sum_after = 0.0, variance = 0.0;
  for (const std::vector<int>& folds : {by_time, by_region}) {
    Eigen::VectorXd gain(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) {
      const double b = left_out(dense_before, folds, i, begin);
      const double a = left_out(dense_after, folds, i, begin);
      sum_before += 0.5 * b, sum_after += 0.5 * a;
      gain[static_cast<Eigen::Index>(i)] = b - a;
    }
    const auto n = static_cast<double>(count);
    variance += 0.5 * n * (gain.array() - gain.mean()).square().sum() / (n - 1.0);
  }
  const auto n = static_cast<double>(count);
  EXPECT_NEAR(held.before, sum_before / n, 1e-5 * held.before);
  EXPECT_NEAR(held.after, sum_after / n, 1e-5 * held.after);
  EXPECT_NEAR(held.gain, sum_before - sum_after, 1e-5 * held.gain);
  EXPECT_NEAR(held.gain_error, std::sqrt(variance), 1e-5 * held.gain_error);
}

TEST(HeldOutPoses, WithNothingLearntAreOffByWhatTheirOwnPoseLeaves) {
  // One log, held out whole: there are no other poses, and no effect's prior either.
  DiagnosisModel one = plain();
  one.runs.resize(1);
  const HeldOut held = held_out(one, one, HeldOutPart::log);
  NoiseLevels squares{}, freedom{};
  const DiagnosisSystem system = linearise(one);
  // Its offsets are its own.
  const Eigen::MatrixXd hessian = system.free_by_common.transpose() * system.free_by_common;
  const Eigen::VectorXd gradient = system.free_by_common.transpose() * system.free_residual;
  const Eigen::VectorXd step = -least_norm(hessian, gradient);
  const Eigen::VectorXd by_offsets = system.by_common * step;
  Eigen::Index begin = 0;
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    const Eigen::MatrixXd by_pose = pose.by_pose;
    const Eigen::MatrixXd q = householder_q(by_pose).leftCols(by_pose.cols());
    const Eigen::VectorXd residual = pose.residual + by_offsets.segment(begin, by_pose.rows());
    begin += by_pose.rows();
    const Eigen::VectorXd left = residual - q * (q.transpose() * residual);
    for (Eigen::Index row = 0; row < left.size(); ++row) {
      const auto c = static_cast<std::size_t>(pose.channel[static_cast<std::size_t>(row)]);
      squares[c] += std::pow(left[row] * pose.scale[row], 2);
      freedom[c] += 1.0 - q.row(row).squaredNorm();
    }
  }
  for (std::size_t c = 0; c < 5; ++c) {
    const double unit = c == 4 ? plain().robot.sigma.tension_N : 1.0;
    const double rms = unit * std::sqrt(squares[c] / freedom[c]);
    EXPECT_NEAR(held.held_out_rms[c], rms, 1e-5 * rms) << c;
    EXPECT_TRUE(std::isnan(held.train_rms[c])) << c;
  }
  EXPECT_EQ(held.gain, 0.0);
}

TEST(HeldOutPoses, OfAWholeLogHaveItsOwnOffsetsAndWhatTheOtherLogTaught) {
  const DiagnosisModel& after = two_runs();
  const HeldOut held = held_out(plain(), after, HeldOutPart::log);
  const DiagnosisSystem system = linearise(after);
  // By another way: all rows together, of which those held out count for next to nothing. They then
  // decide what no other row depends on, and nothing else.
  constexpr double kNothing = 1e-7;
  double total = 0.0;
  for (std::size_t run = 0; run < 2; ++run) {
    Eigen::VectorXd weight(system.free_residual.size());
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      weight.segment(pose.begin, pose.size).setConstant(pose.run == run ? kNothing : 1.0);
    }
    Eigen::VectorXd precision = system.prior_precision;
    // The drift of the log that is held out (the last value of each log) is told by it alone.
    precision[precision.size() - 2 + static_cast<Eigen::Index>(run)] *= kNothing;
    Eigen::MatrixXd hessian =
        system.free_by_common.transpose() * weight.asDiagonal() * system.free_by_common;
    hessian.diagonal() += precision;
    const Eigen::VectorXd gradient =
        system.free_by_common.transpose() * weight.cwiseProduct(system.free_residual) +
        precision.cwiseProduct(system.prior_residual.cwiseQuotient(
            system.prior_precision.cwiseMax(1e-300).cwiseSqrt()));
    const Eigen::VectorXd unit = hessian.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
    const Eigen::VectorXd right = unit.asDiagonal() * gradient;
    const Eigen::VectorXd step = -(unit.asDiagonal() * solve_symmetric(scaled, right));
    const Eigen::VectorXd left = system.free_residual + system.free_by_common * step;
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      if (pose.run == run) total += 0.5 * left.segment(pose.begin, pose.size).squaredNorm();
    }
  }
  const auto count = static_cast<double>(system.poses.size());
  EXPECT_NEAR(held.after, total / count, 1e-4 * held.after);
  EXPECT_GT(held.gain, 2.0 * held.gain_error);  // the load cells are the robot's, in both logs
}

TEST(HeldOutPoses, ScatterAsTheOthersDoInUnitsOfTheReadings) {
  const DiagnosisModel& model = two_runs();
  const HeldOut held = held_out(model, model);
  constexpr std::size_t kRead = 5;  // of the groups
  for (std::size_t c = 0; c < kRead; ++c) {
    // The fit bends to the poses it was made on, never to those left out.
    EXPECT_GT(held.held_out_rms[c], held.train_rms[c]) << c;
    const double unit = c == 4 ? model.robot.sigma.tension_N : 1.0;
    EXPECT_NEAR(held.train_rms[c], unit * model.noise[c], 0.5 * unit * model.noise[c]) << c;
    EXPECT_LT(held.held_out_rms[c], 5.0 * unit * model.noise[c]) << c;  // eight poses a run
  }
  for (std::size_t c = kRead; c < kNoiseGroups; ++c) {
    EXPECT_TRUE(std::isnan(held.train_rms[c]));
    EXPECT_TRUE(std::isnan(held.held_out_rms[c]));
  }
}

}  // namespace
}  // namespace cdprcal
