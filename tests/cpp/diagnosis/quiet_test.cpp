// Tensions less their noise: the balance takes away what it sees of it, and laws are drawn to none;
// and directions that are those of motion.
#include "cdprcal/diagnosis/quiet.hpp"

#include <gtest/gtest.h>

#include <map>

#include "../support/fitted_rests.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/diagnosis/generic.hpp"
#include "cdprcal/diagnosis/model_residuals.hpp"
#include "cdprcal/evidence/directions.hpp"
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
  DiagnosisModel model = rests("irma4", 5.0, 3);
  model = with_quiet_covariates(model, {});
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

/// A tour whose lengths are off by so much at each rest, by another amount every time, which comes
/// when the platform has all but arrived; fitted. The log comes back as the diagnosis leaves it.
DiagnosisModel tour(double off_m, std::vector<Log>& logs) {
  constexpr double kLate_s = 0.5;
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.02);
  Log log = synthetic_log(robot, default_setpoints(robot, 3, 3, 3), options).log;
  const double leg_s = options.dwell_s + options.move_s;
  RandomNormal random(7);
  std::vector<CableVector> off;
  for (int k = 0; k < 29; ++k) {
    off.push_back(CableVector::NullaryExpr(4, [&](Eigen::Index) { return off_m * random(); }));
  }
  for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
    const double at = log.time_s[i] / leg_s;
    const auto k = static_cast<std::size_t>(at);
    const double on = std::clamp((at - std::floor(at) - 1.0) * leg_s / kLate_s + 1.0, 0.0, 1.0);
    log.length_m.row(i) += (off[k] + on * (off[k + 1] - off[k])).transpose();
  }
  logs = {log};
  std::vector<std::string> left_out;
  return baseline_model(robot, logs, left_out);
}

/// Of what is left of the lengths at rests: its mean along the directions, in its rms.
double left_along_directions(const DiagnosisModel& model, const DiagnosisModel& directions) {
  double along = 0.0, squares = 0.0, count = 0.0;
  for (const ModelResidual& entry : model_residuals(model)) {
    const CableVector& left_m = entry.residual.length_m;
    const CableVector& s = directions.runs[0].measurements[entry.pose].length_direction;
    if (entry.pose == 0 || left_m.size() == 0) continue;
    along += left_m.dot(s);
    squares += left_m.squaredNorm();
    count += static_cast<double>(left_m.size());
  }
  return along / std::sqrt(squares * count);
}

TEST(FollowedDirections, AreNotThoseOfErrorsThatStayOverARest) {
  std::vector<Log> logs;
  const DiagnosisModel as_read = tour(0.01, logs);
  const double read = std::abs(left_along_directions(as_read, as_read));
  EXPECT_GT(read, 0.3);
  const std::optional<DiagnosisModel> followed = with_followed_directions(as_read, logs);
  ASSERT_TRUE(followed);
  EXPECT_LT(std::abs(left_along_directions(as_read, *followed)), 0.5 * read);
}

TEST(FollowedDirections, AreThoseReadWhereReadingsAreSure) {
  std::vector<Log> logs;
  const DiagnosisModel model = tour(0.0, logs);
  const std::optional<DiagnosisModel> followed = with_followed_directions(model, logs);
  ASSERT_TRUE(followed);
  for (std::size_t i = 1; i < model.runs[0].measurements.size(); ++i) {
    const CableVector& read = model.runs[0].measurements[i].length_direction;
    const CableVector& found = followed->runs[0].measurements[i].length_direction;
    EXPECT_LE((read - found).cwiseAbs().maxCoeff(), 0.5) << i;  // s goes from −1 to 1
  }
}

TEST(FollowedDirections, AreAskedForByEffectsThatDependOnThem) {
  std::vector<Log> logs;
  const DiagnosisModel model = tour(0.0, logs);
  for (const char* name : {"swivel_hysteresis", "pulley_friction", "bending_hysteresis"}) {
    EXPECT_TRUE(looks_at_directions(*find_effect(name), model)) << name;
  }
  for (const char* name : {"mass", "load_cell_gain", "yaw_drift", "transmission_ratio"}) {
    EXPECT_FALSE(looks_at_directions(*find_effect(name), model)) << name;
  }
}

}  // namespace
}  // namespace cdprcal
