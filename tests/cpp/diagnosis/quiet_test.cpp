// Tensions less their noise: the balance takes away what it sees of it, and laws are drawn to none.
#include "cdprcal/diagnosis/quiet.hpp"

#include <gtest/gtest.h>

#include <map>

#include "../support/fitted_rests.hpp"
#include "cdprcal/diagnosis/generic.hpp"
#include "cdprcal/evidence/scan.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

/// Rests of a robot whose load cells are off by so much, another amount each time; fitted.
DiagnosisModel rests(const std::string& name, double noise_N, std::uint64_t seed) {
  const Robot robot = load_robot(name);
  ReadingNoise noise = reading_noise(robot.sigma, 0.1);
  noise.tension_N = noise_N;
  static std::map<std::string, std::vector<SyntheticStop>> stops;
  if (!stops.contains(name)) stops[name] = default_stops(robot, 3, 3, 3);
  return test::fitted_rests(robot, stops[name], PoseKind::static_pose, noise, seed);
}

TEST(QuietCovariates, BalanceAsWellAsAnyDo) {
  for (const char* name : {"irma4", "posts8"}) {
    const DiagnosisModel fitted = rests(name, 5.0, 1), model = with_quiet_covariates(fitted, {});
    const DiagnosisRun& run = model.runs[0];
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      const Measurement& m = run.measurements[i];
      ASSERT_EQ(m.balanced_tension_N.size(), model.robot.cable_count());
      EXPECT_EQ(&m.tension_of_laws_N(), &m.balanced_tension_N);
      const PlatformState state = platform_state(model.robot, fitted.runs[0].poses[i]);
      Vector6 left = wrench_residual(model.robot, state, m.balanced_tension_N);
      left.tail<3>() /= std::pow(characteristic_length_m(model.robot), 2);
      // No change of the tensions would balance it better.
      EXPECT_LE((structure_matrix(state).transpose() * left).norm(), 1e-9);
    }
  }
}

TEST(QuietCovariates, HoldNoNoiseThatTheBalanceSees) {
  DiagnosisModel model = rests("irma4", 5.0, 2);
  DiagnosisModel noisier = model;
  for (Measurement& m : noisier.runs[0].measurements) {
    m.tension_N += CableVector::LinSpaced(4, -3.0, 4.0);  // four cables: it sees all of this
  }
  model = with_quiet_covariates(model, {});
  noisier = with_quiet_covariates(noisier, {});
  for (std::size_t i = 0; i < model.runs[0].poses.size(); ++i) {
    EXPECT_LE((model.runs[0].measurements[i].balanced_tension_N -
               noisier.runs[0].measurements[i].balanced_tension_N)
                  .norm(),
              1e-9);
  }
}

TEST(QuietCovariates, ReadingsThatAreTakenAnewAreNot) {
  DiagnosisModel model = with_quiet_covariates(rests("irma4", 5.0, 3), {});
  std::vector<Measurement>& all = model.runs[0].measurements;
  take_readings(log_of(all), all);
  for (const Measurement& m : all) EXPECT_EQ(&m.tension_of_laws_N(), &m.tension_N);
}

/// Mean over draws of the common square in the tension, in standard deviations of one draw.
double mean_square_of_tension(bool balanced) {
  constexpr int kDraws = 40;
  double sum = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    DiagnosisModel model = rests("posts8", 10.0, 100 + static_cast<std::uint64_t>(draw));
    if (balanced) model = with_quiet_covariates(model, {});
    for (const CandidateScore& score : scan(model, generic_candidates(model), {.draws = 0})) {
      const GenericName what = *generic_name(*score.effect);
      if (what.channel != "tension" || what.depends_on != "reading") continue;
      if (score.values.size() == 2) sum += score.values[1] / score.deviation[1] / kDraws;
    }
  }
  return sum;
}

TEST(QuietCovariates, NoiseIsNoLawOfTheTension) {
  // Of 40 draws the mean is known to 0.16.
  EXPECT_GT(std::abs(mean_square_of_tension(false)), 1.0);
  EXPECT_NEAR(mean_square_of_tension(true), 0.0, 0.5);
}

}  // namespace
}  // namespace cdprcal
