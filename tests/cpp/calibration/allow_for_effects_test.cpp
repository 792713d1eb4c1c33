#include "cdprcal/calibration/allow_for_effects.hpp"

#include <gtest/gtest.h>

#include <regex>

#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/evidence/checks.hpp"

namespace cdprcal {
namespace {

/// Eight rests of irma4 with what really was.
SyntheticLog made(bool absolute = false) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2, absolute);
  options.seed = 81;
  options.dwell_s = 4.0;
  options.move_s = 4.0;
  return synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
}

CalibrateOptions unasked() {
  CalibrateOptions options;
  options.allow_for_effects = false;
  return options;
}

Log biased(Log log) {
  log.tension_N.rowwise() += Eigen::RowVector4d(12.0, -10.0, 11.0, -14.0);
  return log;
}

void expect_same(const Calibration& a, const Calibration& b) {
  EXPECT_EQ(a.result.poses.front().position_m, b.result.poses.front().position_m);
  EXPECT_EQ(a.result.covariance, b.result.covariance);
  EXPECT_EQ(a.result.reason, b.result.reason);
}

TEST(AllowForEffects, MovesNothingWhereTheModelFits) {
  const Robot robot = load_robot("irma4");
  const Log log = made().log;
  const Calibration plain = calibrate(robot, log, unasked());
  EXPECT_EQ(misfit(plain), "");
  const Calibration allowing = calibrate(robot, log);
  EXPECT_EQ(allowing.result.poses.front().position_m, plain.result.poses.front().position_m);
  EXPECT_EQ(allowing.result.reason, plain.result.reason);
}

TEST(AllowForEffects, CountsWhatALogCannotRuleOut) {
  const Robot robot = load_robot("irma4");
  const Log log = made().log;
  const Calibration plain = calibrate(robot, log, unasked()), allowing = calibrate(robot, log);
  const Matrix6 more = *allowing.result.covariance - *plain.result.covariance;
  const SymmetricEigen<Matrix6> added(more);
  EXPECT_GE(added.eigenvalues()[0], -1e-12 * more.norm());
  EXPECT_GT(more.norm(), 0.0);
  EXPECT_EQ(allowing.result.standard_deviation(),
            Vector6(allowing.result.covariance->diagonal().cwiseSqrt()));
  // No smaller than diagnose's before it finds anything.
  CalibrateOptions at_rest;
  at_rest.method = Method::statics;
  const Calibration rests = calibrate(robot, log, at_rest);
  const Diagnosis found = diagnose(robot, {log});
  const Vector6 before = found.covariance_before.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(rests.result.standard_deviation()[i], 0.8 * before[i]);
  }
}

TEST(AllowForEffects, ChangesNothingUnasked) {
  const Robot robot = load_robot("irma4");
  const Log log = biased(made().log);
  CalibrateOptions options;
  options.allow_for_effects = false;
  options.noise = NoiseSource::specified;  // the user's word against the residuals'
  const Calibration plain = calibrate(robot, log, options);
  options.allow_for_effects = true;
  expect_same(calibrate(robot, log, options), plain);
  EXPECT_EQ(plain.result.reason.find("allow for"), std::string::npos);
}

TEST(AllowForEffects, CountsWhatAnErrorThatAllReadingsShareCanDo) {
  const Robot robot = load_robot("irma4");
  const SyntheticLog truth = made();
  const Log log = biased(truth.log);
  const Calibration plain = calibrate(robot, log, unasked());
  ASSERT_EQ(plain.result.status, CalibrationStatus::converged) << plain.result.reason;
  EXPECT_NE(misfit(plain).find("the balance by "), std::string::npos) << misfit(plain);
  const Calibration allowing = calibrate(robot, log);
  EXPECT_NE(allowing.result.reason.find("the model misfits " + misfit(plain)), std::string::npos);
  EXPECT_NE(allowing.result.reason.find("allow for every known effect"), std::string::npos);
  const Vector6 error = minus(allowing.result.poses.front(), truth.poses.front());
  EXPECT_LT(error.dot(solve_symmetric(*allowing.result.covariance, error)),
            22.5);  // χ² of 6, 0.999
  for (int i = 0; i < 6; ++i) {
    const double deviation = allowing.result.standard_deviation()[i];
    EXPECT_NEAR(deviation * deviation, (*allowing.result.covariance)(i, i), 1e-18);
  }
  // The lengths at the initial pose are those of its geometry, as far as effects leave it alone.
  const PlatformState state = platform_state(robot, allowing.result.poses.front());
  EXPECT_LE((allowing.result.initial_length_m - state.length_m()).norm(), 0.05);
}

TEST(AllowForEffects, LeastCertainIsADirectionOfTheCovarianceThatIsShown) {
  const Robot robot = load_robot("irma4");
  const Log clean = made().log;
  for (const Log& log : {clean, biased(clean)}) {
    for (const Method method : {Method::unified, Method::statics}) {
      CalibrateOptions options;
      options.method = method;
      const CalibrationResult result = calibrate(robot, log, options).result;
      std::smatch said;
      ASSERT_TRUE(std::regex_search(result.least_observed, said,
                                    std::regex("least certain: .*, (.*) (mm|deg);")));
      const bool is_rotation = said[2] == "deg";
      const double sigma = std::stod(said[1]) * (is_rotation ? kDegree : 1e-3);
      Vector6 scale;
      scale << Vector3::Ones(), Vector3::Constant(1.0 / characteristic_length_m(robot));
      const Vector6 back = scale.cwiseInverse();
      const SymmetricEigen<Matrix6> spread(
          Matrix6(back.asDiagonal() * *result.covariance * back.asDiagonal()));
      const Vector6 most =
          std::sqrt(spread.eigenvalues()[5]) * scale.cwiseProduct(spread.eigenvectors().col(5));
      const int first = is_rotation ? 3 : 0;
      EXPECT_GT(sigma, 0.9 * most.segment<3>(first).norm()) << result.least_observed;
      EXPECT_LT(sigma, 1.01 * result.standard_deviation().segment<3>(first).norm());
      const std::string axis = "xyz";
      for (int i = 0; i < 3; ++i) {  // one axis alone has the number of the table
        if (result.least_observed.find(std::string(" about ") + axis[i] + ",") == std::string::npos)
          continue;
        EXPECT_NEAR(sigma, result.standard_deviation()[3 + i], 0.006 * sigma);
      }
    }
  }
}

TEST(AllowForEffects, AbsoluteSensorsAreInTheLargerModel) {
  // A tracker says where the platform is, whatever else may be wrong with the robot.
  const Robot robot = load_robot("irma4");
  const SyntheticLog truth = made(true);
  const Calibration allowing = calibrate(robot, biased(truth.log));
  ASSERT_EQ(allowing.result.status, CalibrationStatus::converged) << allowing.result.reason;
  EXPECT_NE(allowing.result.reason.find("allow for every known effect"), std::string::npos);
  const Calibration without = calibrate(robot, biased(made().log));
  EXPECT_LT(allowing.result.standard_deviation().head<3>().maxCoeff(), robot.sigma.position_m);
  EXPECT_GT(without.result.standard_deviation().head<3>().maxCoeff(), robot.sigma.position_m);
  const Vector6 error = minus(allowing.result.poses.front(), truth.poses.front());
  EXPECT_LT(error.dot(solve_symmetric(*allowing.result.covariance, error)),
            22.5);  // χ² of 6, 0.999
}

/// A converged calibration whose channels scatter by 2 and misfit by `pose`.
Calibration judged(double pose) {
  Calibration out;
  out.problem.robot = load_robot("irma4");
  out.problem.noise = specified_noise(out.problem.robot.sigma);
  out.problem.noise->wrench_force_N = 0.0;
  Measurement& rest = out.problem.measurements.emplace_back();
  rest.tension_N.setConstant(4, 50.0);
  for (ChannelNoise& channel : out.problem.noise->channel) channel = {pose, {.sigma = 2.0}};
  ResidualRms& rms = out.result.residual_rms;
  for (double* v :
       {&rms.length_m, &rms.swivel_rad, &rms.roll_pitch_rad, &rms.yaw_rad, &rms.wrench_force_N,
        &rms.absolute_yaw_rad, &rms.direct_length_m, &rms.position_m}) {
    *v = 1.0;  // that there are readings is all that counts
  }
  return out;
}

TEST(Misfit, IsWherePosesMisfitByMoreThanReadingsScatter) {
  EXPECT_EQ(misfit(judged(2.0)), "");
  EXPECT_EQ(misfit(judged(1.0)), "");
  EXPECT_EQ(
      misfit(judged(3.0)),
      "lengths by 3e+03 mm (they scatter by 2e+03 mm), swivel angles by 172 deg (115 deg), roll and "
      "pitch by 172 deg (115 deg), yaw by 172 deg (115 deg), absolute yaw by 172 deg (115 deg), "
      "direct lengths by 3e+03 mm (2e+03 mm), position by 3e+03 mm (2e+03 mm), the balance "
      "by 3 N (tensions scatter by 2 N)");
}

TEST(Misfit, SaysNothingOfAChannelThatTooLittleIsKnownOf) {
  Calibration c = judged(3.0);
  const NoiseModel specified = specified_noise(c.problem.robot.sigma);
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (i != static_cast<std::size_t>(Channel::balance)) {
      c.problem.noise->channel[i] = specified.channel[i];  // kept: not told
    }
  }
  const std::string balance = "the balance by 3 N (tensions scatter by 2 N)";
  EXPECT_EQ(misfit(c), balance);
  // One of its two components alone was told.
  (*c.problem.noise)[Channel::yaw].sample.sigma = 1e-9;
  EXPECT_EQ(misfit(c).find("yaw by "), 0U);
  c.problem.noise = specified;
  c.problem.noise->channel[static_cast<std::size_t>(Channel::length)].pose *= 3.0;
  EXPECT_EQ(misfit(c).find("lengths by "), 0U);
  // Nothing was read.
  Calibration unread = judged(3.0);
  unread.result.residual_rms = {};
  EXPECT_EQ(misfit(unread), "");
  unread.result.residual_rms.wrench_force_N = 1.0;
  EXPECT_EQ(misfit(unread), balance);
  unread.problem.noise.reset();
  EXPECT_EQ(misfit(unread), "");
}

TEST(Misfit, OfTheBalanceLeavesOutWhatTheRobotFileAllows) {
  Calibration c = judged(1.0);
  const double allowed_N = c.problem.robot.sigma.wrench_force_N;
  ASSERT_GT(allowed_N, 0.0);
  c.problem.noise->wrench_force_N = allowed_N;
  EXPECT_EQ(misfit(c), "");
  c.problem.noise->wrench_force_N = 0.5 * allowed_N;  // less than allowed is no misfit either
  EXPECT_EQ(misfit(c), "");
  c.problem.noise->wrench_force_N =
      std::hypot(allowed_N, 2.4);  // beyond it with the load cells: 2.6
  EXPECT_EQ(misfit(c), "the balance by 2.6 N (tensions scatter by 2 N)");
}

/// The allowance by another way: the diagnosis' own model of the log with every effect in it.
DiagnosisModel everything_in(const Robot& robot, const Log& log) {
  std::vector<Log> logs{log};
  std::vector<std::string> left_out;
  DiagnosisModel model = baseline_model(robot, logs, left_out);
  for (const auto& effect : effect_catalogue()) {
    if (effect->needs_motion() || effect->info().all_or_nothing) continue;
    model.effects.push_back({effect, EffectValues::Zero(effect->size(robot.cable_count()))});
  }
  start_noise(model, calibrate(robot, log, unasked()).signals);
  EXPECT_TRUE(fit_with_noise(model));
  return model;
}

void expect_the_diagnosis_model(const Robot& robot, const Log& log) {
  const Calibration allowing = calibrate(robot, log);
  ASSERT_NE(allowing.result.reason.find("allow for every known effect"), std::string::npos)
      << allowing.result.reason;
  ASSERT_GT(allowing.kinematic_poses, 5);  // of which none but the first may count
  const DiagnosisModel model = everything_in(robot, log);
  const Matrix6 covariance = initial_pose_covariance(with_uncertain_noise(model), 0);
  EXPECT_LT((*allowing.result.covariance - covariance).norm(), 0.05 * covariance.norm());
  const Vector6 apart = minus(allowing.result.poses.front(), model.runs[0].poses.front());
  EXPECT_LT(apart.dot(solve_symmetric(covariance, apart)), 0.6);  // as far as both have settled
  const PlatformState initial =
      platform_state(with_effects(robot, model.active(0)), model.runs[0].poses.front());
  // Nearer to it by far than without the allowance.
  const CalibrationResult plain = calibrate(robot, log, unasked()).result;
  const auto off_m = [&](const CableVector& v) { return (v - initial.length_m()).norm(); };
  const auto off_rad = [&](const CableVector& v) { return (v - initial.swivel_rad()).norm(); };
  EXPECT_LT(off_m(allowing.result.initial_length_m), 0.3 * off_m(plain.initial_length_m));
  EXPECT_LT(off_rad(allowing.result.initial_swivel_rad), 0.3 * off_rad(plain.initial_swivel_rad));
}

TEST(AllowForEffects, IsTheDiagnosisModelWithEveryEffectInIt) {
  Robot robot = load_robot("irma4");
  robot.effects.push_back({"load_cell_bias", "", {{"bias_N", {60, 50, 40, 30}}}});  // known
  Log log = biased(made().log);
  log.tension_N.rowwise() += Eigen::RowVector4d(60, 50, 40, 30);
  log.length_m.array() += 0.4;  // offsets that are not small
  log.roll_pitch_yaw_rad.col(2).array() -= 0.6;
  expect_the_diagnosis_model(robot, log);
}

TEST(AllowForEffects, AReferenceInMotionIsPartOfIt) {
  const Log whole = biased(made().log);
  const Log log = test::cut(whole, 52, whole.sample_count() - 52);  // from the first move on
  const Robot robot = load_robot("irma4");
  const Calibration plain = calibrate(robot, log, unasked());
  ASSERT_EQ(plain.problem.measurements[0].kind, PoseKind::kinematic_pose);
  expect_the_diagnosis_model(robot, log);
  EXPECT_NE(calibrate(robot, log).result.poses[0].position_m, plain.result.poses[0].position_m);
}

TEST(AllowForEffects, RestsMoveAndWhatIsInMotionStays) {
  const Robot robot = load_robot("irma4");
  const Log log = biased(made().log);
  const Calibration plain = calibrate(robot, log, unasked());
  const Calibration allowing = calibrate(robot, log);
  const DiagnosisModel model = everything_in(robot, log);
  const std::vector<Measurement>& readings = plain.problem.measurements;
  ASSERT_EQ(allowing.result.poses.size(), readings.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Pose &before = plain.result.poses[i], &after = allowing.result.poses[i];
    if (readings[i].kind == PoseKind::static_pose) {
      EXPECT_NE(after.position_m, before.position_m) << i;
      ASSERT_LT(next, model.runs[0].poses.size());
      EXPECT_LT(minus(after, model.runs[0].poses[next++]).norm(), 2e-3) << i;
    } else {
      EXPECT_EQ(after.position_m, before.position_m) << i;
    }
  }
  EXPECT_EQ(next, model.runs[0].poses.size());
}

TEST(AllowForEffects, OnlyForAPoseThatIsClaimed) {
  const Robot robot = load_robot("irma4");
  Calibration c = calibrate(robot, biased(made().log), unasked());
  ASSERT_NE(misfit(c), "");
  const Calibration before = c;
  c.result.status = CalibrationStatus::not_converged;
  allow_for_effects({}, c);
  expect_same(c, before);
}

TEST(AllowForEffects, SaysSoWhereTheLargerFitDoesNotSettle) {
  const Robot robot = load_robot("irma4");
  Calibration c = calibrate(robot, biased(made().log), unasked());
  c.result.poses[5].position_m.setConstant(kNaN);  // of a rest
  const Calibration before = c;
  EXPECT_FALSE(allow_for_effects({}, c));
  EXPECT_EQ(c.result.poses.front().position_m, before.result.poses.front().position_m);
  EXPECT_EQ(c.result.covariance, before.result.covariance);
  EXPECT_NE(c.result.reason.find(", and the uncertainty leaves that out"), std::string::npos);
  EXPECT_TRUE(before.result.covariance_holds);
  EXPECT_FALSE(c.result.covariance_holds);
  EXPECT_EQ(c.result.reason.find("allow for every"), std::string::npos);
}

}  // namespace
}  // namespace cdprcal
