// Our minimiser against dense algebra and against Ceres.
#include "cdprcal/estimation/arrowhead.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numeric>
#include <tuple>

#include "../support/scenario.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal::test {
namespace {

/// Random rows of eight poses at a time, all of the offsets' slots and some more; the last batch's
/// idle lanes are zero.
struct RandomBatches {
  RandomBatches(int pose_count, int offset_count, int own, int column_count, RandomNormal& random)
      : poses(pose_count), offsets(offset_count), columns(column_count), slots(offset_count + own) {
    for (int b = 0; b < static_cast<int>(lanes::batches(static_cast<std::size_t>(poses))); ++b) {
      const auto fill = [&](int numbers) {
        lanes::Buffer& to =
            of_batch.emplace_back(lanes::buffer(static_cast<std::size_t>(std::max(numbers, 1))));
        for (int i = 0; i < numbers * lanes::kLanes; ++i) {
          to[static_cast<std::size_t>(i)] = 8 * b + i % lanes::kLanes < poses ? random() : 0.0;
        }
      };
      fill(kRow * slots);
      fill(offsets);
      fill(slots * columns);
    }
    counted.resize(static_cast<std::size_t>(slots));
    std::iota(counted.begin(), counted.end(), 0);
  }
  void add_to(PoseElimination& elimination) const {
    for (std::size_t b = 0; 3 * b < of_batch.size(); ++b) {
      elimination.add(of_batch[3 * b].get(), of_batch[3 * b + 1].get(), of_batch[3 * b + 2].get());
    }
  }
  /// Row `slot` of a pose in all unknowns: six a pose, offsets, columns; and its residual.
  [[nodiscard]] std::pair<Eigen::VectorXd, double> row(int pose, int slot) const {
    const auto batch = static_cast<std::size_t>(pose / lanes::kLanes);
    const auto number = [&](std::size_t which, int index) {
      return of_batch[3 * batch + which]
                     [static_cast<std::size_t>(index * lanes::kLanes + pose % lanes::kLanes)];
    };
    Eigen::VectorXd out = Eigen::VectorXd::Zero(6 * poses + offsets + columns);
    for (int a = 0; a < 6; ++a) out[6 * pose + a] = number(0, kRow * slot + a);
    if (slot < offsets) out[6 * poses + slot] = number(1, slot);
    for (int k = 0; k < columns; ++k) {
      out[6 * poses + offsets + k] = number(2, slot * columns + k);
    }
    return {out, number(0, kRow * slot + 6)};
  }

  int poses, offsets, columns, slots;
  std::vector<lanes::Buffer> of_batch;
  std::vector<int> counted;
};

class Elimination : public ::testing::TestWithParam<std::tuple<int, int, int>> {};

TEST_P(Elimination, IsTheSchurComplementOfTheDenseNormalEquations) {
  const auto [offsets, columns, poses] = GetParam();
  RandomNormal random(static_cast<std::uint64_t>(100 * offsets + 10 * columns + poses));
  constexpr double kDamping = 0.3;
  const RandomBatches batches(poses, offsets, 6, columns, random);
  const int common = offsets + columns, own = 6 * poses;
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(own + common, own + common);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(own + common);
  double cost = 0.0;
  for (int pose = 0; pose < poses; ++pose) {
    for (int slot = 0; slot < batches.slots; ++slot) {
      const auto [row, residual] = batches.row(pose, slot);
      hessian += row * row.transpose();
      gradient += row * residual;
      cost += 0.5 * residual * residual;
    }
  }
  PoseElimination elimination(static_cast<std::size_t>(poses), offsets, columns, true);
  elimination.begin(1.0, batches.counted);
  batches.add_to(elimination);  // forgotten at the next begin
  elimination.begin(kDamping, batches.counted);
  batches.add_to(elimination);
  const EliminatedSums& sums = elimination.finish();
  EXPECT_NEAR(sums.cost, cost, 1e-12 * (1.0 + cost));
  EXPECT_TRUE(sums.raw_gradient.isApprox(gradient.tail(common), 1e-12));
  EXPECT_TRUE(sums.raw_diagonal.isApprox(hessian.diagonal().tail(common), 1e-12));

  Eigen::MatrixXd damped = hessian;
  damped.diagonal().head(own) *= 1.0 + kDamping;
  const Eigen::MatrixXd cross = damped.topRightCorner(own, common);
  const Cholesky<Eigen::MatrixXd> factor(damped.topLeftCorner(own, own));
  const Eigen::VectorXd own_gradient = gradient.head(own);
  Eigen::MatrixXd information = damped.bottomRightCorner(common, common);
  Eigen::VectorXd reduced = gradient.tail(common);
  if (poses > 0) {
    information -= cross.transpose() * factor.solve(cross);
    reduced -= cross.transpose() * factor.solve(own_gradient);
    EXPECT_NEAR(sums.decrease, 0.5 * own_gradient.dot(factor.solve(own_gradient)), 1e-9);
    EXPECT_NEAR(sums.largest_gradient, own_gradient.cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_LT((sums.information - information).norm(), 1e-10 * (1.0 + hessian.norm()));
  EXPECT_LT((sums.gradient - reduced).norm(), 1e-10 * (1.0 + gradient.norm()));

  Eigen::VectorXd step(common);
  for (double& v : step) v = random();
  const PoseSteps steps = elimination.back_substitute(step);
  if (poses == 0) return;
  const Eigen::VectorXd expected = -factor.solve(Eigen::VectorXd(own_gradient + cross * step));
  double damping = 0.0;
  for (int i = 0; i < poses; ++i) {
    const double* const at =
        elimination.steps(static_cast<std::size_t>(i) / lanes::kLanes) + i % lanes::kLanes;
    const Vector6 moved = Eigen::Map<const Vector6, 0, Eigen::InnerStride<lanes::kLanes>>(at);
    EXPECT_LT((moved - expected.segment<6>(6 * i)).norm(), 1e-9 * (1.0 + expected.norm()));
    damping += moved.cwiseAbs2().dot(hessian.diagonal().segment<6>(6 * i));
  }
  EXPECT_NEAR(steps.squared_norm, expected.squaredNorm(), 1e-9 * expected.squaredNorm());
  EXPECT_NEAR(steps.damping, damping, 1e-9 * damping);
}

TEST_P(Elimination, LeavesOfEachRowWhatADenseFitLeaves) {
  const auto [offsets, columns, poses] = GetParam();
  if (poses == 0) return;
  RandomNormal random(static_cast<std::uint64_t>(7 + 100 * offsets + 10 * columns + poses));
  const RandomBatches batches(poses, offsets, 9, columns, random);
  const int common = offsets + columns, own = 6 * poses, rows = poses * batches.slots;
  Eigen::MatrixXd jacobian(rows, own + common);
  Eigen::VectorXd residual(rows);
  for (int i = 0; i < rows; ++i) {
    const auto [row, value] = batches.row(i / batches.slots, i % batches.slots);
    jacobian.row(i) = row.transpose();
    residual[i] = value;
  }
  // More is known of the common unknowns than these rows say.
  Eigen::MatrixXd hessian = jacobian.transpose() * jacobian;
  hessian.diagonal().tail(common).array() += 5.0;
  const Eigen::MatrixXd covariance = hessian.inverse();
  const Eigen::VectorXd leverage = (jacobian * covariance).cwiseProduct(jacobian).rowwise().sum();
  const Eigen::MatrixXd by_pose = jacobian.leftCols(own);
  const Eigen::VectorXd left = residual - by_pose * least_squares(by_pose, residual).x;

  PoseElimination elimination(static_cast<std::size_t>(poses), offsets, columns, true);
  elimination.begin(1e-14, batches.counted);
  const lanes::Buffer out = lanes::buffer(2 * static_cast<std::size_t>(batches.slots));
  const Eigen::MatrixXd of_common = covariance.bottomRightCorner(common, common);
  for (std::size_t b = 0; 3 * b < batches.of_batch.size(); ++b) {
    const auto* const of = batches.of_batch.data() + 3 * b;
    elimination.add(of[0].get(), of[1].get(), of[2].get());
    elimination.left_over(of[0].get(), of[1].get(), of[2].get(), of_common, out.get());
    for (int i = 0; i < rows; ++i) {
      const int pose = i / batches.slots, slot = i % batches.slots;
      if (static_cast<std::size_t>(pose / lanes::kLanes) != b) continue;
      const double* const at = out.get() + 2 * slot * lanes::kLanes + pose % lanes::kLanes;
      EXPECT_NEAR(at[0], left[i], 1e-8);
      EXPECT_NEAR(at[lanes::kLanes], 1.0 - leverage[i], 1e-8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Elimination,
                         ::testing::Combine(::testing::Values(1, 9, 17), ::testing::Values(0, 1, 5),
                                            ::testing::Values(0, 1, 7, 8, 9, 30)));

TEST(PoseElimination, APoseThatFewReadingsSeeSaysNothingOfWhatItLeavesOpen) {
  // Three rows cannot determine six unknowns: they are absorbed, and nothing reaches the offsets.
  RandomNormal random(5);
  const RandomBatches batches(2, 9, 0, 0, random);
  PoseElimination elimination(2, 9, 0, false);
  const std::vector<int> three{0, 1, 2};
  elimination.begin(1e-14, three);
  batches.add_to(elimination);
  const EliminatedSums& sums = elimination.finish();
  EXPECT_TRUE(sums.information.allFinite());
  EXPECT_LT(sums.information.norm(), 1e-9);
}

/// Both minimisers from the same start.
void compare(const CalibrationProblem& problem, const std::vector<Pose>& guess) {
  SolveOptions by_ceres;
  by_ceres.minimiser = MinimiserKind::ceres;
  const CalibrationResult theirs = solve(problem, guess, by_ceres);
  const CalibrationResult ours = solve(problem, guess);
  // A minimum that is too curved to be claimed (left inverse with an unknown reference) is one.
  ASSERT_EQ(ours.status, theirs.status) << ours.reason << "\n" << theirs.reason;
  ASSERT_EQ(ours.poses.size(), guess.size());
  // The weights of the balance are renewed until ζ0 settles: that is how far the costs agree.
  EXPECT_NEAR(ours.cost, theirs.cost, 1e-7 * (1.0 + theirs.cost));
  for (std::size_t i = 0; i < guess.size(); ++i) {
    EXPECT_LT(minus(ours.poses[i], theirs.poses[i]).norm(), 1e-6) << "pose " << i;
  }
  EXPECT_LT((ours.reference_errors - theirs.reference_errors).norm(), 1e-6);
  ASSERT_EQ(ours.covariance.has_value(), theirs.covariance.has_value());
  if (ours.covariance) {
    EXPECT_TRUE(ours.covariance->isApprox(*theirs.covariance, 1e-5));
  }
}

class BothMinimisers : public ::testing::TestWithParam<StaticsModel> {};

TEST_P(BothMinimisers, EndAtTheSameMinimum) {
  for (const bool full : {false, true}) {
    Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.2, 11);
    s.problem.statics = GetParam();
    s.problem.reference_attitude = s.problem.reference_statics = s.problem.reference_noise = full;
    SCOPED_TRACE(full ? "with the reference's noise" : "as in the paper");
    compare(s.problem, disturbed(s.truth, 0.05, 3.0 * kDegree, 2));
  }
}

TEST_P(BothMinimisers, EndAtTheSameMinimumWithReadingsMissing) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.2, 12);
  s.problem.statics = GetParam();
  std::vector<Measurement>& m = s.problem.measurements;
  m[2].length_m[1] = kNaN;
  m[3].swivel_rad.setConstant(kNaN);
  m[4].roll_pitch_yaw_rad.setConstant(kNaN);
  m[5].kind = PoseKind::kinematic_pose;
  m[0].swivel_rad[2] = kNaN;  // changes then count from the second reading
  compare(s.problem, disturbed(s.truth, 0.05, 3.0 * kDegree, 3));
}

INSTANTIATE_TEST_SUITE_P(Statics, BothMinimisers,
                         ::testing::Values(StaticsModel::none, StaticsModel::left_inverse,
                                           StaticsModel::wrench));

TEST(Minimiser, HoldsTheInitialPoseWhereAsked) {
  const Scenario s =
      scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 1.0, 4);
  const std::vector<Pose> guess = disturbed(s.truth, 0.02, 1.0 * kDegree, 5);
  const CalibrationProblem problem = completed(s.problem, guess);
  Assembly assembly(problem, guess);
  assembly.poses().update_wrench_whitening(1.0);
  const double before = assembly.cost();
  const MinimiserSummary summary = assembly.minimise({}, true);
  EXPECT_TRUE(summary.converged);
  EXPECT_EQ(assembly.poses().pose(0).position_m, guess[0].position_m);
  EXPECT_EQ(assembly.poses().pose(0).rotation.coeffs(), guess[0].rotation.coeffs());
  const double held = assembly.cost();
  EXPECT_LT(held, before);
  assembly.minimise({});
  EXPECT_LT(assembly.cost(), held);
}

TEST(Minimiser, MotionWithoutABalanceIsGeometryAlone) {
  // Of all that moves the cables were slack: no balance is left that its motion could weigh.
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.3, 4);
  for (Measurement* m : {&s.problem.measurements[2], &s.problem.measurements[5]}) {
    m->balance_counts = false;
  }
  const CalibrationResult still = solve(s.problem, s.truth);
  for (Measurement* m : {&s.problem.measurements[2], &s.problem.measurements[5]}) {
    m->twist << 0.1, 0.0, -0.2, 0.0, 0.3, 0.0;
    m->acceleration << 0.0, 0.5, 0.0, 0.1, 0.0, 0.0;
  }
  const CalibrationResult moving = solve(s.problem, s.truth);
  ASSERT_EQ(moving.status, CalibrationStatus::converged) << moving.reason;
  EXPECT_NEAR(moving.cost, still.cost, 1e-9 * still.cost);
  EXPECT_LT(minus(moving.poses[0], still.poses[0]).norm(), 1e-9);
}

TEST(Minimiser, AStateOutsideTheGeometryIsNotUsable) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  std::vector<Pose> guess = s.truth;
  guess[3].position_m.setConstant(kNaN);
  const CalibrationProblem problem = completed(s.problem, s.truth);
  Assembly assembly(problem, guess);
  EXPECT_FALSE(assembly.minimise({}).usable);
  EXPECT_TRUE(std::isnan(assembly.cost()));
}

TEST(Minimiser, StopsAfterTheIterationsAllowed) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 1.0, 4);
  const std::vector<Pose> guess = disturbed(s.truth, 0.05, 3.0 * kDegree, 5);
  const CalibrationProblem problem = completed(s.problem, guess);
  Assembly assembly(problem, guess);
  assembly.poses().update_wrench_whitening(100.0);
  const MinimiserSummary summary = assembly.minimise({.max_iterations = 1});
  EXPECT_TRUE(summary.usable);
  EXPECT_FALSE(summary.converged);
  EXPECT_LE(summary.evaluations, 2);
}

}  // namespace
}  // namespace cdprcal::test
