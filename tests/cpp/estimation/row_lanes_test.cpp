// Eight poses at once against one after the other, with every kind of vectors that this machine
// has.
#include "cdprcal/estimation/row_lanes.hpp"

#include <gtest/gtest.h>

#include <map>

#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/lanes/processor.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

using lanes::kLanes;
using lanes::Processor;

std::vector<Processor> processors() {
  const Processor before = lanes::processor();
  std::vector<Processor> out;
  for (const Processor one : {Processor::any, Processor::avx2, Processor::avx512}) {
    try {
      lanes::use_processor(one);
      out.push_back(one);
    } catch (const InputError&) {  // not on this machine
    }
  }
  lanes::use_processor(before);
  return out;
}

class EachProcessor : public ::testing::TestWithParam<Processor> {
 protected:
  void SetUp() override { lanes::use_processor(GetParam()); }
  void TearDown() override { lanes::use_processor(before_); }

 private:
  Processor before_ = lanes::processor();
};

/// Poses that are not equilibria, with readings of all sensors or of some.
CalibrationProblem random_problem(Rng& rng, int cables, StaticsModel statics,
                                  std::vector<Pose>& poses) {
  CalibrationProblem problem;
  problem.robot = random_robot(rng, cables, rng() % 3 == 0);
  problem.statics = statics;
  RandomNormal random(rng());
  const bool absolute = rng() % 2 == 0;
  const ReadingOffsets offsets = random_offsets(cables, random);
  const std::size_t count = 1 + rng() % 19;
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back(random_pose(rng, problem.robot));
    const PoseKind kind = rng() % 4 == 0 ? PoseKind::kinematic_pose : PoseKind::static_pose;
    Measurement m = synthetic_measurement(
        problem.robot, poses.back(), random_tensions(rng, problem.robot), kind, offsets,
        reading_noise(problem.robot.sigma, 1.0, absolute), random);
    m.samples = 1 + static_cast<int>(rng() % 50);
    const auto lose = [&](auto&& values) {
      for (double& v : values) {
        if (rng() % 6 == 0) v = kNaN;
      }
    };
    lose(m.length_m);
    lose(m.swivel_rad);
    lose(m.roll_pitch_yaw_rad);
    if (absolute) lose(m.direct_length_m);
    if (absolute) lose(m.position_m);
    if (rng() % 6 == 0) m.tension_N.setConstant(kNaN);
    problem.measurements.push_back(m);
  }
  return completed(problem, poses);
}

using LabelledRow = std::array<double, 8>;  // derivatives, residual, derivative by the offset

/// Rows by channel and component; rows of zeros say nothing and are left out.
std::map<std::pair<int, int>, LabelledRow> by_label(const PoseRows& rows) {
  std::map<std::pair<int, int>, LabelledRow> out;
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
    LabelledRow& row = out[{static_cast<int>(rows.label[r].channel), rows.label[r].component}];
    std::copy(rows.own[r].begin(), rows.own[r].end(), row.begin());
    row[6] = rows.residual[r];
    row[7] = rows.by_offset[r];
  }
  return out;
}
std::map<std::pair<int, int>, LabelledRow> by_label(const RowLanes& lanes_of, int offsets,
                                                    std::size_t lane) {
  std::map<std::pair<int, int>, LabelledRow> out;
  std::map<int, int> next;  // component of a channel
  for (int slot = 0; slot < offsets + lanes_of.own_rows(); ++slot) {
    const int channel = static_cast<int>(lanes_of.channel(slot));
    const bool yaw =
        lanes_of.channel(slot) == Channel::yaw || lanes_of.channel(slot) == Channel::absolute_yaw;
    const int component = yaw ? 2 : next[channel]++;
    LabelledRow row{};
    for (std::size_t a = 0; a < 7; ++a) {
      row[a] = lanes_of.rows()[(7 * static_cast<std::size_t>(slot) + a) * kLanes + lane];
    }
    if (slot < offsets)
      row[7] = lanes_of.by_offset()[static_cast<std::size_t>(slot) * kLanes + lane];
    if (row != LabelledRow{}) out[{channel, component}] = row;
  }
  return out;
}

TEST_P(EachProcessor, RowsAreThoseOfOnePoseAfterTheOther) {
  Rng rng(20261121);
  int compared = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const auto statics = static_cast<StaticsModel>(trial % 3);
    const int cables = 1 + trial % (statics == StaticsModel::left_inverse ? 6 : kMaxCables);
    SCOPED_TRACE("trial " + std::to_string(trial));
    std::vector<Pose> poses;
    const CalibrationProblem problem = random_problem(rng, cables, statics, poses);
    Assembly assembly(problem, poses);
    Eigen::VectorXd errors(assembly.reference().size());
    for (double& e : errors) e = uniform(rng, -0.1, 0.1);
    assembly.set_reference_errors(errors);
    assembly.cache().update_wrench_whitening(3.0);

    PoseEvaluation initial, evaluation;
    PoseRows rows;
    ASSERT_TRUE(assembly.evaluate_rows(0, poses[0], initial, initial, rows));
    RowLanes side_by_side(problem, assembly.cache(), assembly.reference());
    EXPECT_EQ(side_by_side.row_count(), assembly.residual_count() - assembly.rows_at(0));
    side_by_side.update_weights();
    side_by_side.set_offsets(initial);
    PoseLanes others(poses.size() - 1);
    for (std::size_t i = 1; i < poses.size(); ++i) others.set(i - 1, poses[i]);
    const int offsets = assembly.reference().size();
    for (std::size_t b = 0; b < side_by_side.batches(); ++b) {
      bool valid = true;
      std::vector<PoseRows> expected;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::size_t i = 1 + b * kLanes + lane;
        if (i >= poses.size()) break;
        valid = assembly.evaluate_rows(i, poses[i], initial, evaluation, rows) && valid;
        expected.push_back(rows);
      }
      ASSERT_EQ(side_by_side.evaluate(b, others), valid);
      if (!valid) continue;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto got = by_label(side_by_side, offsets, lane);
        if (lane >= expected.size()) {
          EXPECT_TRUE(got.empty());
          continue;
        }
        const auto wanted = by_label(expected[lane]);
        ASSERT_EQ(got.size(), wanted.size());
        for (const auto& [label, row] : wanted) {
          ASSERT_TRUE(got.contains(label)) << label.first << ", " << label.second;
          double largest = 1.0;  // tensions near a singularity are large, and so is their rounding
          for (const double v : row) largest = std::max(largest, std::abs(v));
          for (std::size_t a = 0; a < row.size(); ++a) {
            EXPECT_NEAR(got.at(label)[a], row[a], 1e-11 * largest)
                << "channel " << label.first << ", component " << label.second << ", " << a;
          }
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 10000);
}

TEST_P(EachProcessor, AnInvalidPoseIsSeenInEveryLane) {
  Rng rng(3);
  std::vector<Pose> poses;
  CalibrationProblem problem;
  problem.robot = random_robot(rng, 4);
  problem.statics = StaticsModel::none;
  RandomNormal random(1);
  const ReadingOffsets offsets = random_offsets(4, random);
  for (int i = 0; i < 9; ++i) {
    poses.push_back(random_pose(rng, problem.robot));
    problem.measurements.push_back(synthetic_measurement(
        problem.robot, poses.back(), random_tensions(rng, problem.robot), PoseKind::kinematic_pose,
        offsets, reading_noise(problem.robot.sigma), random));
  }
  problem = completed(problem, poses);
  Assembly assembly(problem, poses);
  PoseEvaluation initial;
  PoseRows rows;
  ASSERT_TRUE(assembly.evaluate_rows(0, poses[0], initial, initial, rows));
  RowLanes side_by_side(problem, assembly.cache(), assembly.reference());
  side_by_side.set_offsets(initial);
  // An anchor on its swivel axis, inside its pulley, at no place.
  const Cable& cable = problem.robot.cables[2];
  const auto anchor_at = [&](const Vector3& place_m) {
    return Pose{place_m - cable.platform_anchor_m, Eigen::Quaterniond::Identity()};
  };
  const Pulley& pulley = cable.pulley;
  const std::vector<Pose> bad{
      anchor_at(pulley.position_m),
      anchor_at(pulley.position_m + pulley.radius_m * pulley.axes_world.col(0)),
      {Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()},
      {Vector3::Constant(std::numeric_limits<double>::infinity()), Eigen::Quaterniond::Identity()},
      {Vector3::Constant(1e200), Eigen::Quaterniond::Identity()}};
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    for (const Pose& pose : bad) {
      PoseLanes others(8);
      for (std::size_t i = 0; i < 8; ++i) others.set(i, i == lane ? pose : poses[i + 1]);
      EXPECT_FALSE(side_by_side.evaluate(0, others)) << lane;
    }
  }
}

TEST_P(EachProcessor, PosesMoveAsOneDoes) {
  Rng rng(8);
  RandomNormal random(8);
  for (const double size : {1e-9, 1e-5, 1e-4, 0.1, 3.0}) {
    PoseLanes from(11), to(11);
    std::vector<Pose> poses;
    std::vector<Vector6> twists;
    const lanes::Buffer moves = lanes::buffer(2 * 6);
    std::fill_n(moves.get(), 2 * 6 * kLanes, 0.0);
    double squares = 0.0;
    for (std::size_t i = 0; i < 11; ++i) {
      Vector6 twist;
      for (double& v : twist) v = size * random();
      twists.push_back(twist);
      poses.push_back({Vector3(random(), random(), random()), random_rotation(rng)});
      from.set(i, poses.back());
      squares += poses.back().position_m.squaredNorm() + 1.0;
      for (std::size_t a = 0; a < 6; ++a) {
        moves[((i / kLanes) * 6 + a) * kLanes + i % kLanes] = twist[static_cast<Eigen::Index>(a)];
      }
    }
    const double norms = to.move(0, from, moves.get()) +
                         to.move(1, from, moves.get() + 6 * static_cast<std::size_t>(kLanes));
    EXPECT_NEAR(norms, squares, 1e-12 * squares);
    for (std::size_t i = 0; i < 11; ++i) {
      EXPECT_EQ(from[i].rotation.coeffs(), poses[i].rotation.coeffs());
      const Pose expected = plus(poses[i], twists[i]);
      EXPECT_LT((to[i].position_m - expected.position_m).norm(), 1e-15);
      EXPECT_LT((to[i].rotation.coeffs() - expected.rotation.coeffs()).norm(), 2e-15);
    }
  }
}

std::string name(const ::testing::TestParamInfo<Processor>& one) {
  return std::vector<std::string>{"any", "avx2", "avx512"}[static_cast<std::size_t>(one.param)];
}
INSTANTIATE_TEST_SUITE_P(Lanes, EachProcessor, ::testing::ValuesIn(processors()), name);

}  // namespace
}  // namespace cdprcal::test
