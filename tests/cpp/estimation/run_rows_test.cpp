// Eight poses at once against one after the other, with every kind of vectors that this machine
// has.
#include "cdprcal/estimation/run_rows.hpp"

#include <gtest/gtest.h>

#include <map>

#include "../support/random_robot.hpp"
#include "cdprcal/effects/catalogue.hpp"
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
    if (absolute) lose(m.specific_force_m_s2);
    m.balance_counts = rng() % 6 != 0;
    problem.measurements.push_back(m);
  }
  return completed(problem, poses);
}

/// One row, whitened: derivatives by the pose, residual, derivative by its offset.
struct ExpectedRow {
  Vector6 own = Vector6::Zero();
  double residual = 0.0, by_offset = 0.0;
};
using ExpectedRows = std::map<std::pair<int, int>, ExpectedRow>;

/// Eq. 13 as it stands, reading by reading, from the models of one pose.
ExpectedRows expected_rows(Assembly& assembly, std::size_t index, const Pose& pose,
                           const PoseEvaluation& initial) {
  const CalibrationProblem& problem = assembly.problem();
  const Measurement& m = problem.measurements[index];
  const ReferenceReadings& reference = assembly.reference();
  const int n = problem.robot.cable_count();
  PoseEvaluation e;
  evaluate_pose(assembly.poses().robot(), m, pose, assembly.poses().statics_of(index),
                problem.left_inverse_rows, problem.effects, true, e);
  ExpectedRows out;
  const auto add = [&](Channel channel, int component, double residual, const auto& by_twist,
                       bool relative) {
    if (!std::isfinite(residual)) return;
    const double weight = assembly.poses().weight(index, channel);
    ExpectedRow& row = out[{static_cast<int>(channel), component}];
    row.residual = weight * residual;
    row.own = weight * by_twist.transpose();
    row.by_offset = relative ? -weight : 0.0;
  };
  const auto counts = [&](int offset) { return index > 0 || reference.is_known(offset); };
  const OffsetVector& error = reference.errors();
  for (int c = 0; c < n; ++c) {
    if (counts(c)) {
      add(Channel::length, c,
          e.length_m[c] - initial.length_m[c] - (m.length_m[c] - reference.length_m[c]) - error[c],
          e.length_by_twist.row(c), true);
    }
    if (counts(n + c)) {
      add(Channel::swivel, c,
          wrap_angle(e.swivel_rad[c] - initial.swivel_rad[c] -
                     (m.swivel_rad[c] - reference.swivel_rad[c]) - error[n + c]),
          e.swivel_by_twist.row(c), true);
    }
    if (m.direct_length_m.size() == n) {
      add(Channel::direct_length, c, e.direct_length_m[c] - m.direct_length_m[c],
          e.absolute_by_twist.direct_length_m.row(c), false);
    }
  }
  if (counts(2 * n)) {
    add(Channel::yaw, 2,
        wrap_angle(e.roll_pitch_yaw_rad[2] - initial.roll_pitch_yaw_rad[2] -
                   (m.roll_pitch_yaw_rad[2] - reference.yaw_rad) - error[2 * n]),
        e.attitude_by_twist.row(2), true);
  }
  for (int a = 0; a < 2 && (index > 0 || problem.reference_attitude); ++a) {
    add(Channel::roll_pitch, a, wrap_angle(e.roll_pitch_yaw_rad[a] - m.roll_pitch_yaw_rad[a]),
        e.attitude_by_twist.row(a), false);
  }
  add(Channel::absolute_yaw, 0, wrap_angle(e.absolute_yaw_rad - m.absolute_yaw_rad),
      e.absolute_by_twist.absolute_yaw_rad, false);
  for (int a = 0; a < 3; ++a) {
    add(Channel::position, a, pose.position_m[a] - m.position_m[a], Vector6::Unit(a).transpose(),
        false);
    if (!m.rests()) continue;  // in motion more than gravity is felt
    add(Channel::specific_force, a, e.specific_force_m_s2[a] - m.specific_force_m_s2[a],
        e.absolute_by_twist.specific_force_m_s2.row(a), false);
  }
  const StaticsModel statics = assembly.poses().statics_of(index);
  const auto balance = [&](int component, double residual, const Vector6& by_twist) {
    out[{static_cast<int>(Channel::balance), component}] = {by_twist, residual, 0.0};
  };
  if (statics == StaticsModel::left_inverse) {
    const double weight = assembly.poses().tension_weight(index);
    for (int c = 0; c < n; ++c) {
      balance(c, weight * (e.tension_N[c] - m.tension_N[c]),
              weight * e.tension_by_twist.row(c).transpose());
    }
  } else if (statics == StaticsModel::wrench) {
    const Matrix6& whitening = assembly.poses().wrench_whitening(index);
    const Vector6 residual = whitening * e.wrench;
    const Matrix6 by_twist = whitening * e.wrench_by_twist;
    for (int a = 0; a < 6; ++a) balance(a, residual[a], by_twist.row(a).transpose());
  }
  return out;
}

void expect_rows(const PoseRows& rows, const ExpectedRows& expected) {
  ASSERT_EQ(static_cast<std::size_t>(rows.count), expected.size());
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
    const auto found =
        expected.find({static_cast<int>(rows.label[r].channel), rows.label[r].component});
    ASSERT_NE(found, expected.end());
    const ExpectedRow& row = found->second;
    // Tensions near a singularity are large, and so is their rounding.
    const double largest = std::max({1.0, row.own.cwiseAbs().maxCoeff(), std::abs(row.residual)});
    const Eigen::Map<const Vector6> own(rows.own[r].data());
    EXPECT_LE((own - row.own).cwiseAbs().maxCoeff(), 1e-10 * largest)
        << "channel " << found->first.first << ", component " << found->first.second;
    EXPECT_NEAR(rows.residual[r], row.residual, 1e-10 * largest);
    EXPECT_NEAR(rows.by_offset[r], row.by_offset, 1e-10 * largest);
  }
}

/// Known effects that act on readings, tensions and balance.
ActiveEffects some_effects(const Robot& robot, Rng& rng) {
  ActiveEffects out;
  for (const auto& effect : effect_catalogue()) {
    if (rng() % 3 != 0) continue;
    const EffectValues typical = effect->typical(robot);
    out.push_back({effect, 0.5 * typical});
  }
  return out;
}

void compare_with_one_pose_after_the_other(bool with_known_effects) {
  Rng rng(20261121);
  int compared = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const auto statics = static_cast<StaticsModel>(trial % 3);
    const int cables = 1 + trial % (statics == StaticsModel::left_inverse ? 6 : kMaxCables);
    SCOPED_TRACE("trial " + std::to_string(trial));
    std::vector<Pose> poses;
    CalibrationProblem problem = random_problem(rng, cables, statics, poses);
    problem.reference_noise = rng() % 2 == 0;
    problem.reference_attitude = rng() % 2 == 0;
    problem.reference_statics = rng() % 2 == 0;
    if (with_known_effects) problem.effects = some_effects(problem.robot, rng);
    Assembly assembly(problem, poses);
    Eigen::VectorXd errors(assembly.reference().size());
    for (double& e : errors) e = uniform(rng, -0.1, 0.1);
    assembly.set_reference_errors(errors);
    assembly.poses().update_wrench_whitening(3.0);
    PoseEvaluation initial;
    evaluate_pose(assembly.poses().robot(), problem.measurements[0], poses[0], StaticsModel::none,
                  {}, problem.effects, true, initial);
    bool valid = initial.valid;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      PoseEvaluation e;
      evaluate_pose(assembly.poses().robot(), problem.measurements[i], poses[i],
                    assembly.poses().statics_of(i), problem.left_inverse_rows, problem.effects,
                    true, e);
      valid = valid && e.valid;
    }
    const std::vector<PoseRows> rows = assembly.rows();
    ASSERT_EQ(!rows.empty(), valid);
    int count = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(rows[i].count, assembly.rows_at(i));
      expect_rows(rows[i], expected_rows(assembly, i, poses[i], initial));
      count += rows[i].count;
    }
    if (valid) {
      EXPECT_EQ(assembly.residual_count(), count);
    }
    compared += count;
  }
  EXPECT_GT(compared, 10000);
}

TEST_P(EachProcessor, RowsAreThoseOfOnePoseAfterTheOther) {
  compare_with_one_pose_after_the_other(false);
}

TEST_P(EachProcessor, RowsWithKnownEffectsAreThoseOfOnePoseAfterTheOther) {
  compare_with_one_pose_after_the_other(true);
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
  RunReadings readings;
  for (std::size_t i = 0; i < 8; ++i) readings.measurements.push_back(&problem.measurements[i]);
  readings.statics.assign(8, StaticsModel::none);
  readings.base = OffsetVector::Zero(9);
  RunRows side_by_side(problem.robot, readings, {});
  for (std::size_t i = 0; i < 8; ++i) side_by_side.set_weights(i, std::array<double, kChannels>{});
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
      for (std::size_t i = 0; i < 8; ++i) others.set(i, i == lane ? pose : poses[i]);
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
