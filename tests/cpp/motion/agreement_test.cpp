// Readings of one moment against one another: chance, one that is wrong, a sensor that is wrong.
#include "cdprcal/motion/agreement.hpp"

#include <gtest/gtest.h>

#include <random>

#include "cdprcal/motion/contradictions.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal::test {
namespace {

constexpr double kLength_m = 1e-3, kAngle_rad = 0.2 * kDegree;

/// What irma4 reads at a pose inside its workspace, all of it as good as that.
struct Bench {
  Robot robot = load_robot("irma4");
  KnownOffsets offsets;
  GeometricReadings readings;
  std::mt19937_64 random{1};

  Bench() {
    const std::vector<RowLabel> labels = geometric_rows(robot.cable_count());
    const Pose pose{{0.1, -0.2, 0.9}, exp_so3(Vector3(0.1, -0.05, 0.2))};
    Measurement m;
    m.length_m = m.swivel_rad = CableVector::Zero(robot.cable_count());
    m.roll_pitch_yaw_rad.setZero();
    EXPECT_TRUE(evaluate(robot, {}, m, pose, readings));
    for (std::size_t r = 0; r < labels.size(); ++r) {
      if (!std::isfinite(readings.misfit[static_cast<Eigen::Index>(r)])) continue;
      offsets.rows.push_back({labels[r], static_cast<Eigen::Index>(r), is_angle(labels[r])});
    }
    const auto count = static_cast<Eigen::Index>(offsets.rows.size());
    offsets.sample_variance.resize(count);
    for (Eigen::Index r = 0; r < count; ++r) {
      const double sigma = label(r).channel == Channel::length ? kLength_m : kAngle_rad;
      offsets.sample_variance[r] = sigma * sigma;
    }
    offsets.covariance = 0.25 * ReadingMatrix(offsets.sample_variance.asDiagonal());
  }
  [[nodiscard]] const RowLabel& label(Eigen::Index row) const {
    return offsets.rows[static_cast<std::size_t>(row)].label;
  }
  /// Of a platform that is elsewhere than was thought.
  ReadingVector misfits() {
    std::normal_distribution<double> normal;
    const Vector6 elsewhere = Vector6::NullaryExpr([&] { return 0.02 * normal(random); });
    ReadingVector out(offsets.sample_variance.size());
    for (Eigen::Index r = 0; r < out.size(); ++r) {
      const double sigma = std::sqrt(offsets.sample_variance[r] + offsets.covariance(r, r));
      const Eigen::Index at = offsets.rows[static_cast<std::size_t>(r)].reading;
      out[r] = sigma * normal(random) + readings.by_pose.row(at).dot(elsewhere);
    }
    return out;
  }
  [[nodiscard]] Disagreement of(const ReadingVector& misfits, double pose_sigma = 0.0) const {
    const Agreement agreement(offsets, FreeMotion(robot), robot_size_m(robot));
    return agreement.of(misfits, readings.by_pose, offsets.sample_variance,
                        Vector6::Constant(pose_sigma));
  }
};

TEST(Agreement, WhereverThePlatformIsReadingsAgree) {
  Bench bench;
  for (int i = 0; i < 2000; ++i) EXPECT_FALSE(bench.of(bench.misfits()).contradicts) << i;
}

TEST(Agreement, TellsTheReadingThatIsWrong) {
  Bench bench;
  int told = 0, all = 0;
  for (Eigen::Index wrong = 0; wrong < bench.offsets.sample_variance.size(); ++wrong) {
    for (int i = 0; i < 20; ++i) {
      ReadingVector misfits = bench.misfits();
      misfits[wrong] += 60.0 * std::sqrt(bench.offsets.sample_variance[wrong]);
      const Disagreement found = bench.of(misfits);
      if (found.rows.empty()) continue;
      ++all;
      told += found.rows == std::vector<Eigen::Index>{wrong} ? 1 : 0;
    }
  }
  EXPECT_GT(all, 150);
  EXPECT_EQ(told, all) << "named, but another";
}

TEST(Agreement, TellsASensorThatIsWrongAltogether) {
  Bench bench;
  for (int i = 0; i < 20; ++i) {
    ReadingVector misfits = bench.misfits();
    std::vector<Eigen::Index> lengths;
    for (Eigen::Index r = 0; r < misfits.size(); ++r) {
      if (bench.label(r).channel != Channel::length) continue;
      lengths.push_back(r);
      misfits[r] += (r % 2 == 0 ? 0.3 : -0.2) + 0.1 * static_cast<double>(r);
    }
    const Disagreement found = bench.of(misfits);
    EXPECT_TRUE(found.contradicts);
    if (!found.rows.empty()) {
      EXPECT_EQ(found.rows, lengths);
    }
  }
}

TEST(Agreement, SaysNothingWithoutReadingsToSpare) {
  Bench bench;
  ReadingVector misfits = bench.misfits();
  for (Eigen::Index r = 6; r < misfits.size(); ++r) misfits[r] = kNaN;
  misfits[2] += 0.1;
  EXPECT_FALSE(bench.of(misfits).contradicts);
}

TEST(Agreement, OfWhichNothingIsTheWorseItIsNoMatter) {
  Bench bench;
  ReadingVector misfits = bench.misfits();
  misfits[0] += 30.0 * kLength_m;
  EXPECT_TRUE(bench.of(misfits).contradicts);
  EXPECT_FALSE(bench.of(misfits, 10.0).contradicts);
}

TEST(Contradictions, AReadingComesBackWhenItIsFarLessOff) {
  Contradictions of(1);
  const double dt_s = 0.01;
  const auto note = [&](bool contradicts, double misfit, bool agrees, double for_s) {
    for (double t_s = 0.5 * dt_s; t_s < for_s; t_s += dt_s) {
      of.note(0, contradicts, misfit, agrees, false, dt_s);
    }
  };
  note(true, 0.1, false, 0.05);
  EXPECT_FALSE(of.is_out(0)) << "a spike";
  note(false, 0.0, true, 0.05);
  EXPECT_EQ(of.against_s(0), 0.0);
  note(true, 0.1, false, 0.15);
  EXPECT_TRUE(of.is_out(0));
  note(false, 0.1, true, 5.0);
  EXPECT_TRUE(of.is_out(0)) << "as far off as ever, of a pose that is known less";
  note(false, 0.01, true, 0.4);
  EXPECT_TRUE(of.is_out(0)) << "not for long enough";
  note(false, 0.01, true, 0.6);
  EXPECT_FALSE(of.is_out(0));
}

TEST(Contradictions, OfAReadingThatComesBackTheMeanSquareCounts) {
  Contradictions of(1);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> random;
  const double dt_s = 0.01, sigma = 1.0, was_off = 6.0 * sigma;
  for (int k = 0; k < 20; ++k) of.note(0, true, was_off, false, false, dt_s);
  ASSERT_TRUE(of.is_out(0));
  for (int k = 0; k < 60; ++k)
    of.note(0, false, std::abs(sigma * random(engine)), true, false, dt_s);
  EXPECT_FALSE(of.is_out(0));
}

TEST(Contradictions, AReadingThatAloneMustBeWrongIsToldAfterAWhile) {
  Contradictions of(2);
  const double dt_s = 0.01;
  for (int k = 0; k < 40; ++k) {
    of.note(0, true, 1.0, false, true, dt_s);
    of.note(1, true, 1.0, false, false, dt_s);
  }
  EXPECT_TRUE(of.is_out(0));
  EXPECT_FALSE(of.is_told(0));
  for (int k = 0; k < 20; ++k) {
    of.note(0, true, 1.0, false, true, dt_s);
    of.note(1, true, 1.0, false, false, dt_s);
  }
  EXPECT_TRUE(of.is_told(0));
  EXPECT_TRUE(of.is_out(1));
  EXPECT_FALSE(of.is_told(1)) << "it may be the pose that is wrong";
}

}  // namespace
}  // namespace cdprcal::test
