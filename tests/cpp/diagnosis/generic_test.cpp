// "This channel depends on that": each dependence against its definition over the runs.
#include "cdprcal/diagnosis/generic.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "../support/dense.hpp"
#include "../support/numeric_jacobian.hpp"
#include "../support/run.hpp"

namespace cdprcal {
namespace {

using test::two_runs;

/// Channel and dependence, and how many numbers: alike in all cables, or cable by cable.
struct Expected {
  const char *channel, *depends_on;
  int size;
};
constexpr Expected kExpected[] = {
    {"length", "time", 4},     {"length", "time", 8},      {"length", "pose", 12},
    {"length", "tension", 1},  {"length", "tension", 8},   {"length", "direction", 4},
    {"length", "reading", 8},  {"swivel", "time", 8},      {"swivel", "pose", 12},
    {"swivel", "tension", 4},  {"swivel", "direction", 4}, {"swivel", "reading", 8},
    {"roll_pitch", "time", 6}, {"roll_pitch", "pose", 6},  {"roll_pitch", "reading", 4},
    {"yaw", "time", 4},        {"yaw", "pose", 9},         {"yaw", "reading", 2},
    {"tension", "time", 4},    {"tension", "time", 8},     {"tension", "pose", 12},
    {"tension", "reading", 2}, {"tension", "reading", 8},  {"tension", "direction", 4},
};

/// The two runs with yaws apart by more than noise and load cells as they are.
const DiagnosisModel& model() {
  static const DiagnosisModel out = [] {
    DiagnosisModel m = two_runs();
    m.effects.clear();
    return m;
  }();
  return out;
}

/// Columns of an effect at every measurement of the model.
std::vector<Eigen::MatrixXd> columns(const Effect& effect) {
  std::vector<Eigen::MatrixXd> out;
  for (const DiagnosisRun& run : model().runs) {
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      const PlatformState state = platform_state(model().robot, run.poses[i]);
      Eigen::MatrixXd at = Eigen::MatrixXd::Zero(2 * 4 + 9, effect.size(4));
      effect.columns({model().robot, state, run.poses[i], run.measurements[i]}, {}, at);
      out.push_back(at);
    }
  }
  return out;
}

/// What an effect of size `values` takes off each tension at a measurement.
CableVector tensions(const Effect& effect, const DiagnosisRun& run, std::size_t i,
                     const EffectValues& values) {
  const PlatformState state = platform_state(model().robot, run.poses[i]);
  CableVector out = CableVector::Zero(4);
  effect.correct_tension({model().robot, state, run.poses[i], run.measurements[i]}, values, out);
  return out;
}

TEST(Generic, EveryChannelMayDependOnWhatItCould) {
  const Candidates candidates = generic_candidates(model());
  ASSERT_EQ(candidates.size(), std::size(kExpected));
  std::set<std::string> names;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const auto what = generic_name(*candidates[k]);
    ASSERT_TRUE(what.has_value());
    EXPECT_EQ(what->channel, kExpected[k].channel) << k;
    EXPECT_EQ(what->depends_on, kExpected[k].depends_on) << k;
    EXPECT_EQ(candidates[k]->size(4), kExpected[k].size) << k;
    EXPECT_EQ(candidates[k]->info().scope, EffectScope::run);
    EXPECT_EQ(candidates[k]->name(), "unexplained_" + what->channel + "_vs_" + what->depends_on +
                                         "_" + std::to_string(k + 1));
    names.insert(candidates[k]->name());
  }
  EXPECT_EQ(names.size(), candidates.size());
  for (const auto& effect : effect_catalogue()) EXPECT_FALSE(generic_name(*effect).has_value());
}

TEST(Generic, SizesToExpectAreThoseOfTypicalEffectsOnTheirChannel) {
  const std::map<std::string, double> typical{
      {"length", 0.003}, {"swivel", 0.01}, {"roll_pitch", 0.01}, {"yaw", 0.03}, {"tension", 4.0}};
  for (const auto& effect : generic_candidates(model())) {
    const EffectValues sizes = effect->typical(load_robot("irma4"));
    EXPECT_EQ(sizes.minCoeff(), typical.at(generic_name(*effect)->channel)) << effect->name();
    EXPECT_EQ(sizes.maxCoeff(), sizes.minCoeff());
  }
}

TEST(Generic, ColumnsOfTensionsAreTheDerivativesOfTheBalance) {
  // Of the balance itself: its weight follows the tensions as well.
  const DiagnosisRun& run = model().runs[0];
  const Robot& robot = model().robot;
  for (const auto& effect : generic_candidates(model())) {
    if (generic_name(*effect)->channel != "tension") continue;
    SCOPED_TRACE(effect->name());
    const Pose& pose = run.poses[3];
    const PlatformState state = platform_state(robot, pose);
    const EffectContext context{robot, state, pose, run.measurements[3]};
    const EffectValues values = 0.3 * effect->typical(robot);
    const ReadingRows rows{4};
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows.size(), values.size());
    effect->columns(context, values, columns);
    const auto balance = [&](const EffectValues& at) -> Vector6 {
      CableVector tension_N = run.measurements[3].tension_N;
      effect->correct_tension(context, at, tension_N);
      return structure_matrix(state) * tension_N;
    };
    for (Eigen::Index j = 0; j < values.size(); ++j) {
      const double h = 0.1 * effect->typical(robot)[j];
      const Vector6 difference =
          (balance(values + h * EffectValues::Unit(values.size(), j)) - balance(values)) / h;
      EXPECT_LE((columns.col(j).segment<6>(rows.wrench()) - difference).norm(),
                1e-9 * (1.0 + difference.norm()));
    }
  }
}

TEST(Generic, ColumnsAreTheDerivativesOfWhatTheEffectDoes) {
  for (const auto& effect : generic_candidates(model())) {
    if (generic_name(*effect)->channel == "tension") continue;
    SCOPED_TRACE(effect->name());
    DiagnosisModel with = model();
    const EffectValues typical = effect->typical(load_robot("irma4"));
    const auto size = static_cast<Eigen::Index>(effect->size(4));
    Eigen::VectorXd values(2 * size);
    for (Eigen::Index j = 0; j < values.size(); ++j) {
      values[j] = typical[j % size] * (0.2 + 0.1 * static_cast<double>(j % 5));
    }
    with.effects.push_back({effect, values});
    const auto residuals = [&](const Eigen::VectorXd& step) {
      DiagnosisModel moved = with;
      moved.effects[0].values += step;
      return test::dense(linearise(moved)).residual;
    };
    const Eigen::MatrixXd jacobian = test::dense(linearise(with)).jacobian.rightCols(2 * size);
    for (Eigen::Index j = 0; j < 2 * size; ++j) {
      // Linear in the values: a difference is the derivative, but for angles that wrap.
      const double h = 0.1 * typical[j % size];
      const Eigen::VectorXd difference =
          (residuals(h * Eigen::VectorXd::Unit(2 * size, j)) - residuals(0.0 * values)) / h;
      EXPECT_LE((jacobian.col(j) - difference).norm(), 1e-7 * (1.0 + difference.norm())) << j;
    }
  }
}

TEST(Generic, AReadingThatLacksAtOneRestTakesNothingFromTheOthers) {
  DiagnosisModel gap = model();
  Measurement& there = gap.runs[0].measurements[2];
  there.length_m[1] = there.swivel_rad[1] = there.tension_N[1] = there.roll_pitch_yaw_rad[0] = kNaN;
  const Candidates candidates = generic_candidates(gap), whole = generic_candidates(model());
  const DiagnosisRun& run = gap.runs[1];
  const PlatformState state = platform_state(gap.robot, run.poses[3]);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    SCOPED_TRACE(candidates[k]->name());
    const auto size = static_cast<Eigen::Index>(candidates[k]->size(4));
    const EffectContext context{gap.robot, state, run.poses[3], run.measurements[3]};
    Eigen::MatrixXd with = Eigen::MatrixXd::Zero(17, size), without = with;
    whole[k]->columns(context, {}, with);
    candidates[k]->columns(context, {}, without);
    // Scales and middles are those of the readings that there are: no column vanishes.
    for (Eigen::Index j = 0; j < size; ++j) {
      EXPECT_EQ(with.col(j).isZero(0.0), without.col(j).isZero(0.0)) << j;
    }
    EXPECT_LT((with - without).norm(), 0.5 * (1e-9 + with.norm()));
  }
}

TEST(Generic, ADependenceOnTimeBeginsAtNothingAndSpansTheRuns) {
  double last_s = 0.0;
  for (const DiagnosisRun& run : model().runs) {
    for (const Measurement& m : run.measurements) last_s = std::max(last_s, m.run_time_s);
  }
  for (const auto& effect : generic_candidates(model())) {
    if (generic_name(*effect)->channel != "yaw" || generic_name(*effect)->depends_on != "time") {
      continue;
    }
    const DiagnosisRun& run = model().runs[0];
    const PlatformState state = platform_state(model().robot, run.poses[0]);
    const auto at = [&](double time_s) {
      Measurement m = run.measurements[0];
      m.run_time_s = time_s;
      Eigen::MatrixXd out = Eigen::MatrixXd::Zero(17, 4);
      effect->columns({model().robot, state, run.poses[0], m}, {}, out);
      return Eigen::RowVector4d(out.row(2 * 4 + 2));
    };
    EXPECT_LE(at(0.0).norm(), 1e-15);
    // Legendre polynomials less their values at the start: 1 - (-1)^k at the end,
    EXPECT_LE((at(last_s) - Eigen::RowVector4d(2, 0, 2, 0)).norm(), 1e-12);
    // and orthogonal to one another but for that constant.
    constexpr int kSteps = 2000;
    Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
    for (int i = 0; i < kSteps; ++i) {
      const Eigen::RowVector4d p =
          at(last_s * (i + 0.5) / kSteps) + Eigen::RowVector4d(-1, 1, -1, 1);
      products += p.transpose() * p / kSteps;
    }
    const Eigen::Vector4d norms(1.0 / 3, 1.0 / 5, 1.0 / 7, 1.0 / 9);
    EXPECT_LE((products - Eigen::Matrix4d(norms.asDiagonal())).norm(), 1e-5);
  }
}

/// Rows in which a channel's columns stand, for cable-wise ones.
int first_row(const std::string& channel) { return channel == "swivel" ? 4 : 0; }

TEST(Generic, CovariatesAreCentredAndOfOrderOneOverTheRuns) {
  int looked_at = 0;
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    SCOPED_TRACE(effect->name());
    const bool by_cable = what.channel == "length" || what.channel == "swivel";
    const bool scaled =
        what.depends_on == "pose" || what.depends_on == "tension" || what.depends_on == "reading";
    if (!by_cable || !scaled || effect->size(4) == 1) continue;
    ++looked_at;
    const std::vector<Eigen::MatrixXd> all = columns(*effect);
    for (int j = 0; j < effect->size(4); ++j) {
      const int cable = j % 4, term = j / 4;
      double sum = 0.0, squares = 0.0;
      for (const Eigen::MatrixXd& at : all) {
        const double x = at(first_row(what.channel) + cable, j);
        sum += x, squares += x * x;
        // A cable's values act on its own reading alone.
        EXPECT_NEAR(at.col(j).norm(), std::abs(x), 1e-15);
      }
      const auto count = static_cast<double>(all.size());
      EXPECT_NEAR(sum / count, 0.0, 1e-9) << j;
      if (term == 0 || what.depends_on == "pose") {
        EXPECT_NEAR(squares / count, 1.0, 1e-9) << j;
      }
    }
  }
  EXPECT_EQ(looked_at, 6);
}

TEST(Generic, ABentDependenceIsTheSquareLessItsMean) {
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    const bool bent = (what.channel == "length" || what.channel == "swivel") &&
                      (what.depends_on == "reading" || what.depends_on == "tension") &&
                      effect->size(4) == 8;
    if (!bent) continue;
    SCOPED_TRACE(effect->name());
    for (const Eigen::MatrixXd& at : columns(*effect)) {
      for (int cable = 0; cable < 4; ++cable) {
        const int row = first_row(what.channel) + cable;
        EXPECT_NEAR(at(row, 4 + cable), at(row, cable) * at(row, cable) - 1.0, 1e-12);
      }
    }
  }
}

TEST(Generic, ADependenceOnThePoseIsLinearThenSquareThenMixed) {
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    if (what.channel != "yaw" || what.depends_on != "pose") continue;
    for (const Eigen::MatrixXd& at : columns(*effect)) {
      const Eigen::VectorXd t = at.row(2 * 4 + 2);
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(t[3 + a], t[a] * t[a] - 1.0, 1e-12);
        EXPECT_NEAR(t[6 + a], t[a] * t[(a + 1) % 3], 1e-12);
      }
    }
  }
}

TEST(Generic, ATensionsOwnReadingHasATrueZero) {
  double squares = 0.0, count = 0.0;
  for (const DiagnosisRun& run : model().runs) {
    for (const Measurement& m : run.measurements) {
      squares += m.tension_of_laws_N().squaredNorm();
      count += 4.0;
    }
  }
  const double rms = std::sqrt(squares / count);
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    if (what.channel != "tension" || what.depends_on != "reading") continue;
    SCOPED_TRACE(effect->name());
    const bool alike = effect->size(4) == 2;
    const DiagnosisRun& run = model().runs[1];
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      const CableVector x = run.measurements[i].tension_of_laws_N() / rms;
      EffectValues values = EffectValues::Zero(effect->size(4));
      if (alike) {
        values << 3.0, 0.5;
      } else {
        values << 3.0, 3.0, 3.0, 3.0, 0.5, 0.5, 0.5, 0.5;
      }
      // Readings are more than the tensions by this.
      const CableVector expected = -3.0 * x - 0.5 * x.cwiseAbs2();
      EXPECT_LE((tensions(*effect, run, i, values) - expected).norm(), 1e-12);
    }
  }
}

/// Of the platform, as the AHRS would read it without errors.
Vector3 attitude(const Pose& pose) {
  const PlatformState state = platform_state(model().robot, pose);
  return euler_from_rotation(state.rotation, model().robot.euler_convention);
}

TEST(Generic, AnglesDependOnWhatTheyShouldBeByTheirSizeAndYawByItsDirection) {
  double squares = 0.0, count = 0.0;
  for (const DiagnosisRun& run : model().runs) {
    for (const Pose& pose : run.poses) {
      squares += attitude(pose).head<2>().squaredNorm();
      count += 2.0;
    }
  }
  const double rms = std::sqrt(squares / count);
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    if (what.depends_on != "reading") continue;
    const std::vector<Eigen::MatrixXd> all = columns(*effect);
    std::size_t next = 0;
    for (const DiagnosisRun& run : model().runs) {
      for (const Pose& pose : run.poses) {
        const Eigen::MatrixXd& at = all[next++];
        const Vector3 angles = attitude(pose);
        if (what.channel == "yaw") {
          EXPECT_NEAR(at(10, 0), std::sin(angles[2]), 1e-12);
          EXPECT_NEAR(at(10, 1), std::cos(angles[2]), 1e-12);
        }
        if (what.channel == "roll_pitch") {  // two values of roll, then two of pitch
          for (int a = 0; a < 2; ++a) {
            EXPECT_NEAR(at(8 + a, 2 * a), angles[0] / rms, 1e-12);
            EXPECT_NEAR(at(8 + a, 2 * a + 1), angles[1] / rms, 1e-12);
            EXPECT_EQ(at(8 + a, 2 * (1 - a)), 0.0);
          }
        }
      }
    }
  }
}

TEST(Generic, NoiseOfAGeometricReadingIsNotWhatTheReadingDependsOn) {
  const DiagnosisRun& run = model().runs.front();
  const PlatformState state = platform_state(model().robot, run.poses[0]);
  Measurement noisy = run.measurements[0];
  noisy.length_m.array() += 0.01;
  noisy.swivel_rad.array() += 0.02;
  noisy.roll_pitch_yaw_rad.array() += 0.03;
  int tried = 0;
  for (const auto& effect : generic_candidates(model())) {
    if (generic_name(*effect)->channel == "tension") continue;
    const auto columns_at = [&](const Measurement& m) {
      Eigen::MatrixXd at = Eigen::MatrixXd::Zero(2 * 4 + 9, effect->size(4));
      effect->columns({model().robot, state, run.poses[0], m}, {}, at);
      return at;
    };
    EXPECT_EQ(columns_at(noisy), columns_at(run.measurements[0])) << effect->name();
    ++tried;
  }
  EXPECT_GT(tried, 10);
}

TEST(Generic, DirectionsAreThoseOfTheCableOrOfItsSwivel) {
  DiagnosisRun run = model().runs[0];
  Measurement& m = run.measurements[0];
  m.length_direction = Eigen::Vector4d(1.0, -1.0, 0.5, 0.0);
  m.swivel_direction = Eigen::Vector4d(-1.0, 0.25, 1.0, -0.5);
  const PlatformState state = platform_state(model().robot, run.poses[0]);
  const auto at = [&](const Effect& effect) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(17, 4);
    effect.columns({model().robot, state, run.poses[0], m}, {}, out);
    return out;
  };
  for (const auto& effect : generic_candidates(model())) {
    const GenericName what = *generic_name(*effect);
    if (what.depends_on != "direction") continue;
    SCOPED_TRACE(what.channel);
    const CableVector s = what.channel == "swivel" ? m.swivel_direction : m.length_direction;
    const EffectValues one = EffectValues::Ones(4);
    if (what.channel == "tension") {
      EXPECT_LE((tensions(*effect, run, 0, one) + s).norm(), 1e-15);
    } else {
      const Eigen::MatrixXd block = at(*effect).middleRows(first_row(what.channel), 4);
      EXPECT_LE((block - Eigen::MatrixXd(Eigen::VectorXd(s).asDiagonal())).norm(), 1e-15);
    }
    // Not known how the pose was reached: nothing depends on it.
    Measurement unknown = m;
    unknown.length_direction.resize(0);
    unknown.swivel_direction.resize(0);
    Eigen::MatrixXd none = Eigen::MatrixXd::Zero(17, 4);
    effect->columns({model().robot, state, run.poses[0], unknown}, {}, none);
    EXPECT_EQ(none.norm(), 0.0);
  }
}

TEST(Generic, MissingReadingsLeaveTheirDependenceOut) {
  DiagnosisModel gaps = model();
  Measurement& m = gaps.runs[0].measurements[1];
  m.length_m[2] = kNaN;
  m.swivel_rad[1] = kNaN;
  m.tension_N[0] = kNaN;
  m.roll_pitch_yaw_rad.setConstant(kNaN);
  const PlatformState state = platform_state(gaps.robot, gaps.runs[0].poses[1]);
  for (const auto& effect : generic_candidates(gaps)) {
    Eigen::MatrixXd at = Eigen::MatrixXd::Zero(17, effect->size(4));
    effect->columns({gaps.robot, state, gaps.runs[0].poses[1], m}, {}, at);
    EXPECT_TRUE(at.allFinite()) << effect->name();
  }
}

TEST(Generic, WhereNothingChangesNothingIsDividedByNothing) {
  // One pose: no spread of any covariate, and no tilt or tension at all.
  DiagnosisModel one = model();
  one.runs.resize(1);
  one.runs[0].measurements.resize(1);
  one.runs[0].rows.resize(1);
  one.runs[0].poses.resize(1);
  Measurement& m = one.runs[0].measurements[0];
  m.roll_pitch_yaw_rad.setZero();
  m.tension_N.setZero();
  m.run_time_s = 0.0;
  const PlatformState state = platform_state(one.robot, one.runs[0].poses[0]);
  for (const auto& effect : generic_candidates(one)) {
    Eigen::MatrixXd at = Eigen::MatrixXd::Zero(17, effect->size(4));
    effect->columns({one.robot, state, one.runs[0].poses[0], m}, {}, at);
    EXPECT_TRUE(at.allFinite()) << effect->name();
    EXPECT_LE(at.cwiseAbs().maxCoeff(), 100.0) << effect->name();
  }
}

}  // namespace
}  // namespace cdprcal
