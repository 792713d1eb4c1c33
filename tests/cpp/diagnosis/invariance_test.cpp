// A diagnosis does not depend on the size of the robot: the log of a robot that is heavier or
// larger in every part says the same, in numbers of that robot. What fails here holds a number in
// newtons, kilograms or metres that belongs to one robot.
#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "../support/scaled.hpp"

namespace cdprcal {
namespace {

using test::scaled;
using test::Scaling;
using test::startup_log;
using test::summary;

/// A log of irma4, and what is wrong with it.
struct Case {
  const char* name;
  Log (*log)();
};

constexpr double kShareOfSigma = 0.2;  // of σ, a sample

Log of_changed(void (*change)(Robot&), std::uint64_t seed) {
  Robot robot = load_robot("irma4");
  change(robot);
  return startup_log(robot, kShareOfSigma, seed);
}

Log with_bias() {
  Log log = startup_log(load_robot("irma4"), kShareOfSigma, 21);
  log.tension_N.rowwise() += Eigen::RowVector4d(9, -7, 11, -8);
  return log;
}

const Case kCases[] = {
    {"clean", [] { return startup_log(load_robot("irma4"), kShareOfSigma, 11); }},
    {"few_poses", [] { return startup_log(load_robot("irma4"), kShareOfSigma, 12, 0); }},
    {"bias", &with_bias},
    {"bias_and_drift",
     [] {
       Log log = with_bias();
       log.roll_pitch_yaw_rad.col(2) += 0.0004 * log.time_s;
       return log;
     }},
    {"mass", [] { return of_changed([](Robot& r) { r.platform.mass_kg += 1.0; }, 22); }},
    {"centre_of_mass",
     [] {
       return of_changed(
           [](Robot& r) { r.platform.centre_of_mass_m += Vector3(0.012, -0.015, 0.0); }, 23);
     }},
    {"anchors",
     [] { return of_changed([](Robot& r) { r.cables[1].pulley.position_m.x() += 0.01; }, 24); }},
    {"ratio",
     [] {
       Log log = startup_log(load_robot("irma4"), kShareOfSigma, 25);
       log.length_m.array().rowwise() *= Eigen::Array4d(1.02, 0.985, 1.025, 1.012).transpose();
       return log;
     }},
    {"bump", &test::log_with_bump},
    {"outlier_and_slip",
     [] {
       Log log = startup_log(load_robot("irma4"), kShareOfSigma, 26);
       const Eigen::Index half = log.sample_count() / 2;
       log.length_m(half / 2, 1) += 0.2;
       log.length_m.col(2).tail(half).array() += 0.03;
       return log;
     }},
    {"sign",
     [] {
       Log log = startup_log(load_robot("irma4"), kShareOfSigma, 27, 0);
       log.length_m.col(1) *= -1.0;
       return log;
     }},
};

struct Size {
  const char* name;
  Scaling by;
};
// Powers of four: the numbers of a computation then scale without rounding, as far as they do.
constexpr Size kSizes[] = {{"heavy", {64.0, 1.0}},
                           {"light", {1.0 / 64.0, 1.0}},
                           {"large", {1.0, 4.0}},
                           {"small", {1.0, 0.25}},
                           {"large_and_heavy", {64.0, 4.0}}};

class Invariance : public testing::TestWithParam<std::tuple<Case, Size>> {};

void expect_close(double is, double was, double share, const std::string& what) {
  if (std::isnan(was)) {
    EXPECT_TRUE(std::isnan(is)) << what;
  } else {
    EXPECT_NEAR(is, was, share * std::max(1.0, std::abs(was))) << what;
  }
}

TEST_P(Invariance, OfTheDiagnosis) {
  const auto& [what, size] = GetParam();
  const Robot robot = load_robot("irma4"), other = scaled(robot, size.by);
  const Log log = what.log();
  const Diagnosis was = diagnose(robot, {log});
  const Diagnosis is = diagnose(other, {scaled(log, size.by)});

  EXPECT_EQ(is.verdict, was.verdict);
  ASSERT_EQ(summary(is), summary(was));
  for (std::size_t i = 0; i < was.effects.size(); ++i) {
    const NamedEffect &a = is.effects[i], &b = was.effects[i];
    SCOPED_TRACE(b.effect->name());
    expect_close(a.log_evidence, b.log_evidence, 1e-4, "evidence");
    expect_close(a.p_value, b.p_value, 1e-9, "p");
    EXPECT_EQ(a.rivals, b.rivals);
    const EffectValues unit_a = a.effect->typical(other), unit_b = b.effect->typical(robot);
    ASSERT_EQ(a.values.size(), b.values.size());
    for (Eigen::Index j = 0; j < a.values.size(); ++j) {
      const Eigen::Index k = j % unit_a.size();
      expect_close(a.values[j] / unit_a[k], b.values[j] / unit_b[k], 1e-4, "value");
      expect_close(a.standard_deviation[j] / unit_a[k], b.standard_deviation[j] / unit_b[k], 1e-4,
                   "deviation");
    }
  }
  ASSERT_EQ(is.identifiability.size(), was.identifiability.size());
  for (std::size_t i = 0; i < was.identifiability.size(); ++i) {
    const Identifiability &a = is.identifiability[i], &b = was.identifiability[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.visible, b.visible) << b.name;
    expect_close(a.detectable, b.detectable, 1e-4, b.name);
  }
  for (std::size_t i = 0; i < was.ranking.size(); ++i) {
    EXPECT_EQ(is.ranking[i].effect->name(), was.ranking[i].effect->name());
    expect_close(is.ranking[i].log_evidence, was.ranking[i].log_evidence, 1e-4, "ranking");
  }
  EXPECT_EQ(is.gated.size(), was.gated.size());
  const double micrometre = 1e-6 * size.by.length;
  EXPECT_LT((is.initial_pose_after.position_m - size.by.length * was.initial_pose_after.position_m)
                .norm(),
            micrometre);
  EXPECT_LT(is.initial_pose_after.rotation.angularDistance(was.initial_pose_after.rotation), 1e-6);
  for (int i = 0; i < 6; ++i) {
    const double unit = i < 3 ? size.by.length : 1.0;
    expect_close(
        std::sqrt(is.covariance_after(i, i)) / (unit * std::sqrt(was.covariance_after(i, i))), 1.0,
        1e-4, "deviation of the pose");
  }
}

INSTANTIATE_TEST_SUITE_P(SizesAndFaults, Invariance,
                         testing::Combine(testing::ValuesIn(kCases), testing::ValuesIn(kSizes)),
                         [](const auto& one) {
                           return std::string(std::get<0>(one.param).name) + "_" +
                                  std::get<1>(one.param).name;
                         });

}  // namespace
}  // namespace cdprcal
