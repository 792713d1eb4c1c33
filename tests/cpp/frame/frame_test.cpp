#include "cdprcal/frame/frame.hpp"

#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/frame/each_its_own.hpp"
#include "cdprcal/frame/mirror.hpp"
#include "cdprcal/frame/rows.hpp"
#include "cdprcal/frame/start.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

using test::Rng;
using test::uniform;

constexpr double kNoise_m = 1e-3;

/// Pulleys of a flat frame about 3 m wide, none of its corners square, in the x, z plane.
std::vector<Vector3> corners() {
  return {{0.0, 0.0, 0.0}, {3.041, 0.0, 0.0}, {3.021, 0.0, 2.137}, {-0.023, 0.0, 2.094}};
}

Robot belts(const std::vector<Vector3>& places, Motion motion = Motion::t2) {
  Robot robot;
  robot.name = "belts";
  robot.platform.motion = motion;
  if (row_of(motion).is_planar()) robot.platform.motion_plane_normal = Vector3::UnitY();
  robot.tension_max_N = 400.0;
  for (const Vector3& place : places) {
    Cable cable;
    cable.pulley.position_m = place;
    cable.pulley.axes_world << Vector3::UnitX(), Vector3::UnitZ().cross(Vector3::UnitX()),
        Vector3::UnitZ();
    if (row_of(motion).is_planar()) {
      cable.pulley.axes_world << Vector3::UnitX(), Vector3::UnitY().cross(Vector3::UnitX()),
          Vector3::UnitY();
    }
    robot.cables.push_back(cable);
  }
  finalise(robot);
  return robot;
}

/// What somebody knows who knows nothing but "about 3 m wide".
std::vector<Vector3> rectangle() {
  return {{0.0, 0.0, 0.0}, {3.0, 0.0, 0.0}, {3.0, 0.0, 2.0}, {0.0, 0.0, 2.0}};
}

struct Twin {
  Log log;
  std::vector<Vector3> points;
};

/// Whole lengths at points of a grid, with noise and an offset.
Twin grid(const Robot& truth, int across, int up, double offset_m, Rng& rng,
          double noise_m = kNoise_m) {
  std::normal_distribution<double> noise(0.0, noise_m);
  Twin twin;
  const int n = truth.cable_count();
  twin.log.source = "twin";
  twin.log.time_s = Eigen::VectorXd::LinSpaced(across * up, 0.0, across * up - 1.0);
  twin.log.direct_length_m.resize(across * up, n);
  for (int i = 0; i < across * up; ++i) {
    const Vector3 point(0.6 + 1.8 * (i % across) / (across - 1), 0.0,
                        0.4 + 1.3 * (i / across) / (up - 1));
    twin.points.push_back(point);
    for (int c = 0; c < n; ++c) {
      const Vector3& place = truth.cables[static_cast<std::size_t>(c)].pulley.position_m;
      twin.log.direct_length_m(i, c) = (point - place).norm() + offset_m + noise(rng);
    }
  }
  return twin;
}

void expect_within(const FrameResult& found, const Robot& truth, double sigmas) {
  ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
  for (std::size_t i = 0; i < truth.cables.size(); ++i) {
    const Vector3 error = found.anchors_m[i] - truth.cables[i].pulley.position_m;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(std::abs(error[axis]), sigmas * found.anchors_sigma_m[i][axis] + 1e-9)
          << "pulley " << i + 1 << " axis " << axis;
    }
  }
}

/// Every command that takes the corrected file reads the lengths as they are.
void expect_taken_off(const FrameResult& found, const Twin& twin, const Robot& truth) {
  const std::optional<Log> log = correct_readings(found.corrected, twin.log);
  ASSERT_TRUE(log);
  for (std::size_t i = 0; i < twin.points.size(); ++i) {
    for (std::size_t c = 0; c < truth.cables.size(); ++c) {
      const double length_m = (twin.points[i] - truth.cables[c].pulley.position_m).norm();
      const double read_m =
          log->direct_length_m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c));
      EXPECT_NEAR(read_m, length_m, 4e-3);
    }
  }
}

TEST(Frame, RowsHaveTheirNumericDerivatives) {
  Rng rng(1);
  for (const Motion motion : {Motion::r3t3, Motion::t3, Motion::r1t2, Motion::t2}) {
    detail::FrameProblem problem;
    problem.robot = test::random_robot(rng, 5);
    problem.robot.platform.motion = motion;
    if (row_of(motion).is_planar()) problem.robot.platform.motion_plane_normal = Vector3::UnitY();
    problem.basis = motion_basis(problem.robot);
    problem.sigma.fill(1.0);
    detail::FrameUnknowns& u = problem.unknowns;
    u.cables = 5;
    u.axis_count = row_of(motion).is_planar() ? 2 : 3;
    u.axes = test::random_rotation(rng).toRotationMatrix();
    u.size = u.axis_count * u.cables;
    u.direct_offsets = u.size++;
    u.direct_offset_count = 1;
    u.length_offsets = {u.size};
    u.swivel_offsets = {u.size + 5};
    u.yaw_offset = {u.size + 10};
    u.scale = u.size + 11;
    u.compliance = u.size + 12;
    u.off_plane = u.size + 13;
    u.untold_tension = u.size + 14;
    u.mean_tension_N = 30.0;
    u.tension_spread_N = 10.0;
    u.size += 19;
    u.precision = Eigen::VectorXd::Zero(u.size);
    for (const detail::Own what : {detail::Own::offset, detail::Own::scale, detail::Own::square}) {
      detail::add_own(problem.robot, what, u);
    }
    problem.ratio = CableVector::LinSpaced(5, -0.01, 0.01);
    Pose pose;
    pose.position_m = Vector3(0.1, 0.0, 0.4);
    pose = on_motion(problem.robot, pose);
    detail::FramePose from;
    const CableVector some = CableVector::Constant(5, 1.5);
    from.reading.direct_length_m = from.reading.length_m = some;
    from.reading.swivel_rad = CableVector::Constant(5, 0.1);
    from.reading.tension_N = CableVector::LinSpaced(5, 10.0, 50.0);
    from.reading.tension_N[1] = kNaN;
    from.reading.roll_pitch_yaw_rad = Vector3(0.1, 0.1, 0.1);
    from.reading.absolute_yaw_rad = 0.1;
    from.reading.position_m = Vector3::Zero();
    Eigen::VectorXd values = 0.01 * Eigen::VectorXd::Random(u.size);
    values[u.compliance] = 1e-5;
    const auto residual = [&](const Eigen::VectorXd& at, const Pose& there) {
      return detail::frame_rows(problem, detail::moved(problem, at), at, from, there, false)
          .residual;
    };
    const detail::FrameRows rows =
        detail::frame_rows(problem, detail::moved(problem, values), values, from, pose, true);
    ASSERT_TRUE(rows.valid);
    ASSERT_EQ(rows.residual.size(), 5 + 5 + 5 + 3 + 1 + 3);
    EXPECT_TRUE(test::jacobian_matches(
        rows.by_common,
        test::numeric_jacobian([&](const Eigen::VectorXd& x) { return residual(x, pose); }, values,
                               1e-3)));
    EXPECT_TRUE(test::jacobian_matches(
        rows.by_pose, test::numeric_tangent_jacobian(
                          [&](const Eigen::VectorXd& delta) {
                            return residual(values, plus(pose, Vector6(problem.basis * delta)));
                          },
                          problem.basis.cols())));
  }
}

TEST(Frame, LengthsAloneGiveAFrameInClosedForm) {
  Rng rng(2);
  for (const int dimensions : {2, 3}) {
    const int n = dimensions + 2, poses = 30;
    Eigen::MatrixXd anchors(dimensions, n), points(dimensions, poses);
    for (double& x : anchors.reshaped()) x = uniform(rng, -2.0, 2.0);
    for (double& x : points.reshaped()) x = uniform(rng, -1.0, 1.0);
    Eigen::MatrixXd lengths(poses, n);
    for (int i = 0; i < poses; ++i) {
      for (int c = 0; c < n; ++c) lengths(i, c) = (points.col(i) - anchors.col(c)).norm();
    }
    const auto found = detail::closed_form(lengths, dimensions);
    ASSERT_TRUE(found);
    for (int i = 0; i < poses; ++i) {
      for (int c = 0; c < n; ++c) {
        EXPECT_NEAR((found->points.col(i) - found->anchors.col(c)).norm(), lengths(i, c), 1e-9);
      }
    }
    EXPECT_FALSE(detail::closed_form(lengths.leftCols(dimensions), dimensions));
    EXPECT_FALSE(detail::closed_form(lengths.topRows(4), dimensions));
  }
}

TEST(Frame, OfBeltsIsFoundWithoutAGuessOfItsSize) {
  const Robot truth = belts(corners());
  for (const double offset_m : {0.0, 0.03, -0.05, 0.2}) {
    for (const double size : {0.2, 1.0, 4.0}) {
      Rng rng(3);
      const Twin twin = grid(truth, 10, 10, offset_m, rng);
      std::vector<Vector3> guess = rectangle();
      for (Vector3& place : guess) place *= size;
      const FrameResult found = find_frame(belts(guess), {twin.log});
      expect_within(found, truth, 3.5);
      ASSERT_EQ(found.offset_m.size(), 1U);
      EXPECT_LE(std::abs(found.offset_m[0].value - offset_m), 3.0 * found.offset_m[0].sigma);
      EXPECT_NEAR(found.noise_m, kNoise_m, 0.15e-3);
      EXPECT_LT(found.held_out_rms_m, 1.3e-3);
      EXPECT_TRUE(found.left_out.empty());
      EXPECT_FALSE(found.off_plane_m);
    }
  }
}

TEST(Frame, IsAtTheFilesFirstPulleyAndOnItsSide) {
  Rng rng(4);
  const Twin twin = grid(belts(corners()), 9, 9, 0.0, rng);
  std::vector<Vector3> guess = rectangle();
  for (Vector3& place : guess) {
    place.z() = 1.0 - place.z();  // the file has it upside down, and elsewhere
    place.x() += 5.0;
  }
  const FrameResult found = find_frame(belts(guess), {twin.log});
  ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
  EXPECT_TRUE(found.anchors_m[0].isApprox(guess[0]));
  EXPECT_NEAR(found.anchors_m[1].z(), guess[1].z(), 1e-9);
  EXPECT_NEAR(found.anchors_m[1].x() - 5.0, 3.041, 0.05);
  EXPECT_NEAR(found.anchors_m[2].z(), 1.0 - 2.137, 0.05);
  EXPECT_EQ(found.anchors_sigma_m[0], Vector3::Zero());
  EXPECT_NE(found.gauge.find("pulley 1"), std::string::npos);
}

TEST(Frame, SigmaHolds) {
  const Robot truth = belts(corners());
  double squares = 0.0, count = 0.0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    Rng rng(100 + seed);
    const Twin twin = grid(truth, 7, 7, 0.05, rng);
    const FrameResult found = find_frame(belts(rectangle()), {twin.log});
    ASSERT_EQ(found.status, FrameStatus::converged);
    const double z = (found.offset_m[0].value - 0.05) / found.offset_m[0].sigma;
    squares += z * z;
    count += 1.0;
  }
  // χ² of 30, 99.9 % from both sides; σ never below those of independent readings.
  EXPECT_LT(squares, 59.7);
  EXPECT_GT(squares, 6.0);
}

/// What each cable has of its own, none on average.
CableVector own_values(int cables, double spread, Rng& rng) {
  std::normal_distribution<double> normal(0.0, spread);
  CableVector out(cables);
  for (double& value : out) value = normal(rng);
  return out.array() - out.mean();
}

/// The largest error of a pulley by its σ.
double worst_in_sigmas(const FrameResult& found, const Robot& truth) {
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.cables.size(); ++i) {
    const Vector3 error = found.anchors_m[i] - truth.cables[i].pulley.position_m;
    worst = std::max(
        worst, error.cwiseQuotient(found.anchors_sigma_m[i].cwiseMax(1e-6)).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(Frame, SigmaAllowsForWhatEachCableHasOfItsOwn) {
  const Robot truth = belts(corners());
  int beyond = 0;
  for (unsigned seed = 0; seed < 24; ++seed) {
    Rng rng(200 + seed);
    Twin twin = grid(truth, 7, 7, 0.05, rng, 0.5e-3);
    if (seed % 2 == 0) {
      twin.log.direct_length_m.rowwise() += own_values(4, 0.01, rng).transpose();
    } else {
      const CableVector gain = 1.0 + own_values(4, 0.003, rng).array();
      twin.log.direct_length_m *= gain.asDiagonal();
    }
    const FrameResult found = find_frame(belts(rectangle()), {twin.log});
    ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
    if (worst_in_sigmas(found, truth) > 4.0) ++beyond;
  }
  // Where no reading shows them they count for as little as that is rare.
  EXPECT_LE(beyond, 1);
}

TEST(Frame, AScaleOfEachIsFoundAndTakenOff) {
  Rng rng(31);
  const Robot truth = belts(corners());
  Twin twin = grid(truth, 10, 10, 0.05, rng, 0.3e-3);
  const CableVector own{{0.004, -0.002, -0.001, -0.001}};
  twin.log.direct_length_m *= CableVector(1.0 + own.array()).asDiagonal();
  const auto hint = [](const FrameResult& found) {
    return std::count_if(found.next.begin(), found.next.end(), [](const std::string& text) {
      return text.find("--scale each") != std::string::npos;
    });
  };
  const FrameResult alike = find_frame(belts(rectangle()), {twin.log});
  EXPECT_EQ(hint(alike), 1);
  EXPECT_TRUE(alike.own_scale.empty());
  FrameOptions options;
  options.scale = LengthScale::each;
  const FrameResult found = find_frame(belts(rectangle()), {twin.log}, options);
  expect_within(found, truth, 3.5);
  EXPECT_EQ(hint(found), 0);
  ASSERT_EQ(found.own_scale.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    const Estimate& scale = found.own_scale[static_cast<std::size_t>(i)];
    EXPECT_LE(std::abs(scale.value - own[i]), 3.5 * scale.sigma) << "length " << i + 1;
  }
  // The corrected file has taken it off: nothing is left to find, and twice is once.
  const FrameResult again = find_frame(found.corrected, {twin.log}, options);
  EXPECT_EQ(again.status, FrameStatus::converged) << again.reason;
  for (const Estimate& scale : again.own_scale) EXPECT_LT(std::abs(scale.value), scale.sigma);
  expect_taken_off(found, twin, truth);
}

TEST(Frame, PosesThatDoNotBelongAreNamed) {
  Rng rng(5);
  const Robot truth = belts(corners());
  Twin twin = grid(truth, 10, 10, 0.02, rng);
  twin.log.direct_length_m(37, 2) += 0.04;
  const FrameResult found = find_frame(belts(rectangle()), {twin.log});
  expect_within(found, truth, 3.5);
  ASSERT_EQ(found.left_out.size(), 1U);
  EXPECT_EQ(found.left_out[0].sample, 37);
}

TEST(Frame, BeltsOutsideThePlaneAreToldFromAnOffset) {
  Rng rng(6);
  std::vector<Vector3> places = corners();
  for (Vector3& place : places) place.y() = 0.2;
  const Twin twin = grid(belts(places), 10, 10, 0.05, rng);
  const FrameResult found = find_frame(belts(rectangle()), {twin.log});
  ASSERT_EQ(found.status, FrameStatus::converged);
  ASSERT_TRUE(found.off_plane_m);
  EXPECT_LE(std::abs(found.off_plane_m->value - 0.2), 3.5 * found.off_plane_m->sigma);
  EXPECT_LE(std::abs(found.offset_m[0].value - 0.05), 3.5 * found.offset_m[0].sigma);
}

TEST(Frame, ATrackerShowsTheScaleAndThePlaceInTheWorld) {
  Rng rng(7);
  const Robot truth = belts(corners());
  Twin twin = grid(truth, 8, 8, 0.01, rng, 1e-4);
  twin.log.direct_length_m *= 1.004;
  twin.log.position_m.resize(64, 3);
  std::normal_distribution<double> noise(0.0, 1e-4);
  for (int i = 0; i < 64; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      twin.log.position_m(i, axis) = twin.points[static_cast<std::size_t>(i)][axis] + noise(rng);
    }
  }
  const FrameResult found = find_frame(belts(rectangle()), {twin.log});
  expect_within(found, truth, 3.5);
  ASSERT_TRUE(found.scale);
  EXPECT_LE(std::abs(found.scale->value - 0.004), 3.5 * found.scale->sigma);
  EXPECT_LT(found.scale->sigma, 1e-3);
  // The file that is written reads in the tracker's metres.
  const auto ratio =
      std::find_if(found.corrected.effects.begin(), found.corrected.effects.end(),
                   [](const AppliedEffect& effect) { return effect.name == "whole_length_scale"; });
  ASSERT_NE(ratio, found.corrected.effects.end());
  EXPECT_EQ(ratio->parameters.front().values, std::vector<double>(4, found.scale->value));
}

TEST(Frame, ATrackerLeavesTheNoiseOfLengthsAsItIs) {
  // What is left out of σ, the place of the frame, takes part in how well readings are fitted; and
  // no σ is far larger than what was known before.
  constexpr double kKnown_m = 0.03;
  Robot truth = load_robot("posts8");
  truth.cables.resize(6);  // a reading for each coordinate of a pose
  for (unsigned seed = 0; seed < 8; ++seed) {
    Rng rng(980 + seed);
    std::normal_distribution<double> unit(0.0, 1.0);
    constexpr int kPoses = 30;
    Log log;
    log.source = "tracked";
    log.time_s = Eigen::VectorXd::LinSpaced(kPoses, 0.0, kPoses - 1.0);
    log.direct_length_m.resize(kPoses, truth.cable_count());
    log.position_m.resize(kPoses, 3);
    log.roll_pitch_yaw_rad.resize(kPoses, 3);
    for (int i = 0; i < kPoses; ++i) {
      Pose pose;
      pose.position_m =
          Vector3(uniform(rng, -0.4, 0.4), uniform(rng, -0.4, 0.4), uniform(rng, 0.7, 1.3));
      pose.rotation = exp_so3(Vector3(0.15 * unit(rng), 0.15 * unit(rng), 0.15 * unit(rng)));
      const PlatformState state = platform_state(truth, pose);
      const Vector3 angles = euler_from_rotation(state.rotation, truth.euler_convention);
      for (int c = 0; c < truth.cable_count(); ++c) {
        log.direct_length_m(i, c) = state.length_m()[c] + kNoise_m * unit(rng);
      }
      for (int a = 0; a < 3; ++a) {
        log.position_m(i, a) = pose.position_m[a] + kNoise_m * unit(rng);
        log.roll_pitch_yaw_rad(i, a) = angles[a] + 5e-3 * unit(rng);
      }
    }
    Robot file = truth;
    file.sigma.direct_length_m = file.sigma.position_m = kNoise_m;
    for (Cable& cable : file.cables) {
      cable.pulley.position_m += kKnown_m * Vector3(unit(rng), unit(rng), unit(rng));
      cable.pulley.position_sigma_m.setConstant(kKnown_m);
    }
    const FrameResult found = find_frame(file, {log});
    expect_within(found, truth, 4.0);
    EXPECT_NEAR(found.noise_m, kNoise_m, 0.35 * kNoise_m);
    for (const Vector3& sigma : found.anchors_sigma_m) EXPECT_LT(sigma.maxCoeff(), 2.0 * kKnown_m);
  }
}

TEST(Frame, TooFewPosesAreSaidToDetermineNothing) {
  Rng rng(8);
  const Robot truth = belts(corners());
  for (const int poses : {1, 2, 3}) {
    Twin twin = grid(truth, 10, 10, 0.0, rng);
    twin.log.time_s.conservativeResize(poses);
    twin.log.direct_length_m.conservativeResize(poses, Eigen::NoChange);
    const FrameResult found = find_frame(belts(rectangle()), {twin.log});
    EXPECT_NE(found.status, FrameStatus::converged) << poses;
    EXPECT_FALSE(found.reason.empty());
    EXPECT_EQ(found.reason.find("no further pose"), std::string::npos);
  }
}

TEST(Frame, PosesWithoutAReadingToSpareAreSaidToDetermineNothing) {
  Rng rng(10);
  std::vector<Vector3> three = corners();
  three.pop_back();
  for (Vector3& place : three) place.y() = place.z();
  const Twin twin = grid(belts(three, Motion::t3), 5, 5, 0.0, rng);
  for (const LengthOffset offset : {LengthOffset::none, LengthOffset::common}) {
    FrameOptions options;
    options.offset = offset;
    const FrameResult found = find_frame(belts(three, Motion::t3), {twin.log}, options);
    EXPECT_EQ(found.status, FrameStatus::unobservable);
    EXPECT_NE(found.reason.find("no more readings than unknowns"), std::string::npos)
        << found.reason;
    EXPECT_NE(found.reason.find("no further pose would add one"), std::string::npos)
        << found.reason;
  }
}

/// Whole lengths at places of a box.
Log in_box(const Robot& truth, int poses, const Vector3& low, const Vector3& high, Rng& rng,
           double noise_m = kNoise_m) {
  std::normal_distribution<double> noise(0.0, noise_m);
  Log log;
  log.source = "box";
  log.time_s = Eigen::VectorXd::LinSpaced(poses, 0.0, poses - 1.0);
  log.direct_length_m.resize(poses, truth.cable_count());
  for (int i = 0; i < poses; ++i) {
    Vector3 point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = uniform(rng, low[axis], high[axis]);
    for (int c = 0; c < truth.cable_count(); ++c) {
      const Vector3& place = truth.cables[static_cast<std::size_t>(c)].pulley.position_m;
      log.direct_length_m(i, c) = (point - place).norm() + noise(rng);
    }
  }
  return log;
}

TEST(Frame, WhoseFirstPulleysAreInLineIsNotMirrored) {
  const Robot file = belts({{0, 0, 2}, {1.5, 0, 2}, {3, 0, 2}, {1.5, 0, 0}});
  for (unsigned seed = 0; seed < 6; ++seed) {
    Rng rng(200 + seed);
    for (const double sag_m : {-0.03, 0.03}) {
      const Robot truth =
          belts({{0, 0, 2.01}, {1.52, 0, 2.01 + sag_m}, {3.05, 0, 2.0}, {1.5, 0, -0.05}});
      const Log log = in_box(truth, 60, {0.4, 0.0, 0.3}, {2.6, 0.0, 1.7}, rng);
      const FrameResult found = find_frame(file, {log});
      ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
      EXPECT_NEAR(found.anchors_m[3].z(), -0.05, 0.2);
      EXPECT_NE(found.gauge.find("it is the file's"), std::string::npos) << found.gauge;
    }
  }
}

TEST(Frame, OfMastsOfOneHeightHangsBelowThem) {
  const std::vector<Vector3> masts{{0, 0, 15}, {20, 0, 15}, {20, 15, 15}, {0, 15, 15}};
  FrameOptions options;
  options.offset = LengthOffset::none;
  for (unsigned seed = 0; seed < 6; ++seed) {
    Rng rng(300 + seed);
    std::vector<Vector3> places = masts;
    places[3].z() += seed % 2 == 0 ? 1.0 : -1.0;
    const Log log = in_box(belts(places, Motion::t3), 60, {2, 2, 2}, {18, 13, 11}, rng);
    const FrameResult found = find_frame(belts(masts, Motion::t3), {log}, options);
    expect_within(found, belts(places, Motion::t3), 6.0);
    EXPECT_NE(found.gauge.find("cables can hold"), std::string::npos) << found.gauge;
  }
}

/// Changes of length near pulleys of about one height fit a point above them nearly as well.
TEST(Frame, OfChangesOfLengthHasNoPoseAboveItsPulleys) {
  constexpr double kTape_m = 0.05;
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(350 + seed);
    std::normal_distribution<double> off(0.0, kTape_m);
    std::vector<Vector3> places{
        {-3.1, 1.5, 3.7}, {-0.6, -3.4, 3.4}, {3.4, -0.5, 3.5}, {0.7, 3.4, 3.4}};
    const Robot truth = belts(places, Motion::t3);
    for (Vector3& place : places) place += Vector3(off(rng), off(rng), off(rng));
    Robot file = belts(places, Motion::t3);
    for (Cable& cable : file.cables) cable.pulley.position_sigma_m.setConstant(kTape_m);
    Log log = in_box(truth, 40, {-1.5, -1.5, 0.4}, {1.5, 1.5, 2.7}, rng);
    log.length_m = log.direct_length_m.rowwise() - log.direct_length_m.row(0).eval();
    log.direct_length_m.resize(log.time_s.size(), 0);
    const FrameResult found = find_frame(file, {log});
    ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
    EXPECT_LT(found.rms_m, kNoise_m);
    const double sigma_m = found.covariance.diagonal().cwiseSqrt().maxCoeff();
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const auto apart_m = [&](const Robot& robot) {
          return (robot.cables[i].pulley.position_m - robot.cables[k].pulley.position_m).norm();
        };
        EXPECT_LT(std::abs(apart_m(found.corrected) - apart_m(truth)), 4.0 * sigma_m);
      }
    }
    for (const Pose& pose : found.poses) EXPECT_LT(pose.position_m.z(), 3.2);
  }
}

TEST(Frame, ThatNothingTellsFromItsMirrorImageIsSaidToBeEither) {
  Rng rng(11);
  std::vector<Vector3> lying = corners(), in_line;
  for (Vector3& place : lying) {
    std::swap(place.y(), place.z());
    in_line.emplace_back(static_cast<double>(in_line.size()), 0.0, 0.0);
  }
  Robot truth = belts(lying), file = belts(in_line);
  for (Robot* robot : {&truth, &file}) robot->platform.motion_plane_normal = Vector3::UnitZ();
  const Log log = in_box(truth, 60, {0.6, 0.4, 0.0}, {2.4, 1.7, 0.0}, rng);
  const FrameResult found = find_frame(file, {log});
  ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
  EXPECT_NE(found.gauge.find("may be either"), std::string::npos) << found.gauge;
}

TEST(Frame, CablesHoldNothingAboveTheirPulleys) {
  const Robot robot = belts({{0, 0, 2}, {2, 0, 2}, {1, 2, 2}}, Motion::t3);
  Pose pose;
  pose.position_m = Vector3(1.0, 0.7, 1.0);
  EXPECT_LT(detail::unheld_share(robot, pose), 1e-3);
  pose.position_m.z() = 3.0;
  EXPECT_NEAR(detail::unheld_share(robot, pose), 1.0, 1e-9);
  pose.position_m = Vector3(20.0, 0.7, 1.9);  // beside them: hardly
  EXPECT_GT(detail::unheld_share(robot, pose), 0.9);
}

/// The log as a winch counts it whose belts stretch, with tensions about 60 N, of which a share is
/// not read.
void stretch(Log& log, double stiffness_N, double missing, Rng& rng) {
  std::normal_distribution<double> noise(0.0, 1.0);
  log.tension_N = log.direct_length_m;
  for (Eigen::Index i = 0; i < log.tension_N.size(); ++i) {
    const double tension_N = uniform(rng, 40.0, 80.0);
    log.direct_length_m.data()[i] /= 1.0 + tension_N / stiffness_N;
    log.tension_N.data()[i] = uniform(rng, 0.0, 1.0) < missing ? kNaN : tension_N + noise(rng);
  }
}

/// Sum of squares of (found − true)/σ of the distances between pulleys, and how many.
std::pair<double, int> distance_squares(const FrameResult& found, const Robot& truth) {
  std::pair<double, int> out{0.0, 0};
  const Eigen::Index n = truth.cable_count();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const Vector3 apart = found.anchors_m[a] - found.anchors_m[b];
      const double error =
          apart.norm() -
          (truth.cables[a].pulley.position_m - truth.cables[b].pulley.position_m).norm();
      Eigen::VectorXd by = Eigen::VectorXd::Zero(3 * n);
      by.segment<3>(3 * i) = apart.normalized();
      by.segment<3>(3 * j) = -apart.normalized();
      out.first += error * error / by.dot(found.covariance * by);
      ++out.second;
    }
  }
  return out;
}

TEST(Frame, TensionsThatWereNotReadAreNotZero) {
  const Robot truth = belts(corners());
  FrameOptions options;
  options.offset = LengthOffset::none;
  for (const double missing : {0.0, 0.2, 0.5}) {
    double squares = 0.0, count = 0.0, of_stiffness = 0.0;
    for (unsigned seed = 0; seed < 10; ++seed) {
      Rng rng(400 + seed);
      Log log = in_box(truth, 80, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng, 5e-4);
      stretch(log, 5e4, missing, rng);
      const FrameResult found = find_frame(belts(rectangle()), {log}, options);
      ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
      const auto [sum, more] = distance_squares(found, truth);
      squares += sum;
      count += more;
      ASSERT_TRUE(found.stiffness_N);
      ASSERT_EQ(found.corrected.effects.size(), 1U);
      EXPECT_EQ(found.corrected.effects[0].name, "whole_length_stretch");
      EXPECT_EQ(found.corrected.effects[0].parameters[0].values[0], found.stiffness_N->value);
      of_stiffness +=
          std::pow((1.0 / found.stiffness_N->value - 2e-5) *
                       std::pow(found.stiffness_N->value, 2.0) / found.stiffness_N->sigma,
                   2.0);
    }
    EXPECT_LT(std::sqrt(squares / count), 1.6) << missing;
    EXPECT_LT(of_stiffness, 29.6) << missing;  // χ² of 10, 99.9 %
  }
}

TEST(Frame, AStiffnessThatIsNotSeenIsNoNumber) {
  const Robot truth = belts(corners());
  Rng rng(12);
  Log log = in_box(truth, 80, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng);
  stretch(log, 1e9, 0.0, rng);
  const FrameResult found = find_frame(belts(rectangle()), {log});
  ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
  ASSERT_TRUE(found.stiffness_N);
  EXPECT_TRUE(std::isnan(found.stiffness_N->value));
  EXPECT_TRUE(
      std::none_of(found.corrected.effects.begin(), found.corrected.effects.end(),
                   [](const AppliedEffect& effect) { return effect.name == "cable_elasticity"; }));
}

TEST(Frame, WhatIsKnownOfPulleysHoldsTheFrame) {
  double squares = 0.0, count = 0.0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Rng rng(500 + seed);
    constexpr double kTape_m = 5e-3;
    std::normal_distribution<double> tape(0.0, kTape_m);
    std::vector<Vector3> places = corners();
    for (Vector3& place : places) place += Vector3(tape(rng), 0.0, tape(rng));
    Robot file = belts(corners());
    for (Cable& cable : file.cables) cable.pulley.position_sigma_m.setConstant(kTape_m);
    const Log log = in_box(belts(places), 12, {0.8, 0.0, 0.6}, {2.2, 0.0, 1.5}, rng);
    FrameOptions options;
    options.offset = LengthOffset::none;
    const FrameResult found = find_frame(file, {log}, options);
    ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
    EXPECT_EQ(found.gauge.find("pulley 1 is where"), std::string::npos) << found.gauge;
    EXPECT_NE(found.gauge.find("3 rigid motions"), std::string::npos) << found.gauge;
    const auto [sum, more] = distance_squares(found, belts(places));
    squares += sum;
    count += more;
  }
  EXPECT_LT(std::sqrt(squares / count), 1.35);
}

/// Of the file nothing is known but some pulleys, whichever these are.
TEST(Frame, IsAtThePulleysThatAreKnown) {
  constexpr double kKnown_m = 2e-3;
  for (const std::vector<std::size_t>& known :
       {std::vector<std::size_t>{3}, std::vector<std::size_t>{0, 2}}) {
    double squares = 0.0, count = 0.0;
    for (unsigned seed = 0; seed < 10; ++seed) {
      Rng rng(800 + seed);
      std::normal_distribution<double> tape(0.0, kKnown_m), rough(0.0, 0.1);
      const Robot truth = belts(corners());
      Robot file = truth;
      for (std::size_t c = 0; c < 4; ++c) {
        const bool is_known = std::ranges::find(known, c) != known.end();
        auto& how = is_known ? tape : rough;
        Pulley& pulley = file.cables[c].pulley;
        pulley.position_m += Vector3(how(rng), 0.0, how(rng));
        pulley.position_sigma_m.setConstant(is_known ? kKnown_m : 10.0);
      }
      const Log log = in_box(truth, 40, {0.8, 0.0, 0.6}, {2.2, 0.0, 1.5}, rng);
      FrameOptions options;
      options.offset = LengthOffset::none;
      const FrameResult found = find_frame(file, {log}, options);
      ASSERT_EQ(found.status, FrameStatus::converged) << found.reason;
      EXPECT_LT(found.noise_m, 1.3 * kNoise_m);  // no convention contradicts what is known
      // Two of them fix a plane.
      const char* const gauge = known.size() == 1 ? "pulley 4 is as well known" : "3 rigid motions";
      EXPECT_NE(found.gauge.find(gauge), std::string::npos) << found.gauge;
      const auto [sum, more] = distance_squares(found, truth);
      squares += sum;
      count += more;
    }
    EXPECT_LT(std::sqrt(squares / count), 1.35);
    EXPECT_GT(std::sqrt(squares / count), 0.6);
  }
}

TEST(Frame, ReadingsThatNeverChangeAreOneReading) {
  Rng rng(13);
  Log log = in_box(belts(corners()), 30, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng);
  log.direct_length_m.rowwise() = log.direct_length_m.row(0).eval();
  const FrameResult found = find_frame(belts(rectangle()), {log});
  EXPECT_EQ(found.status, FrameStatus::unobservable) << found.reason;
}

TEST(Frame, LengthsOfAnotherUnitAgreeWithNothing) {
  Rng rng(14);
  Log log = in_box(belts(corners()), 30, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng);
  log.direct_length_m *= 1e3;
  const FrameResult found = find_frame(belts(rectangle()), {log});
  EXPECT_EQ(found.status, FrameStatus::not_converged);
  EXPECT_NE(found.reason.find("check units"), std::string::npos) << found.reason;
}

TEST(Frame, PosesOnALineDoNotTellTheSidesOfPulleys) {
  Rng rng(15);
  const Robot truth = belts(corners());
  const Log log = in_box(truth, 40, {0.5, 0.0, 1.0}, {2.5, 0.0, 1.0}, rng);
  // Of the wrong side, and nobody said that they are known at all.
  std::vector<Vector3> places = corners();
  places[2].z() = places[3].z() = -0.1;
  const FrameResult found = find_frame(belts(places), {log});
  EXPECT_EQ(found.status, FrameStatus::unobservable) << found.reason;
  // Where the file knows them the same poses do.
  Robot file = truth;
  for (Cable& cable : file.cables) cable.pulley.position_sigma_m.setConstant(5e-3);
  EXPECT_EQ(find_frame(file, {log}).status, FrameStatus::converged);
}

TEST(Frame, PosesOnAPlaneTellTheSidesByAllOfTheFilesPulleys) {
  const std::vector<Vector3> masts{
      {0, 0, 0.35}, {0.9, 0.1, 0.35}, {-0.2, 1.0, 0.4}, {0.3, 0.2, 1.6}};
  int converged = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    Rng rng(900 + seed);
    std::normal_distribution<double> tape(0.0, 0.1);
    std::vector<Vector3> places = masts;
    for (Vector3& place : places) place += Vector3(tape(rng), tape(rng), tape(rng));
    const Robot truth = belts(places, Motion::t3);
    const Log log = in_box(truth, 60, {-0.5, -0.5, 0.0}, {0.9, 0.9, 0.0}, rng);
    const FrameResult found = find_frame(belts(masts, Motion::t3), {log});
    if (found.status != FrameStatus::converged) {
      EXPECT_NE(found.reason.find("do not determine the frame"), std::string::npos) << found.reason;
      continue;
    }
    ++converged;
    for (std::size_t i = 0; i < masts.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double found_m = (found.anchors_m[i] - found.anchors_m[j]).norm();
        EXPECT_NEAR(found_m, (places[i] - places[j]).norm(), 0.1) << seed;
      }
    }
  }
  EXPECT_GE(converged, 3);
}

TEST(Frame, ColumnsInAnotherOrderAreSeenByTheFilesPulleys) {
  const std::vector<Vector3> masts{{0, 0, 3}, {4, 0, 3.5}, {4, 3, 2.5}, {0, 3, 3}, {2, 1, 0}};
  for (unsigned seed = 0; seed < 4; ++seed) {
    Rng rng(950 + seed);
    std::normal_distribution<double> tape(0.0, 0.1);
    std::vector<Vector3> places = masts;
    for (Vector3& place : places) place += Vector3(tape(rng), tape(rng), tape(rng));
    Log log = in_box(belts(places, Motion::t3), 60, {0.5, 0.5, 0.5}, {3.5, 2.5, 2.0}, rng);
    const Robot file = belts(masts, Motion::t3);
    EXPECT_EQ(find_frame(file, {log}).status, FrameStatus::converged);
    log.direct_length_m.col(1).swap(log.direct_length_m.col(2));
    const FrameResult found = find_frame(file, {log});
    EXPECT_EQ(found.status, FrameStatus::not_converged);
    EXPECT_NE(found.reason.find("pulleys 2 and 3 stand as"), std::string::npos) << found.reason;
  }
}

TEST(Frame, AColumnInAnotherUnitIsNoMatterOfPulleys) {
  Rng rng(970);
  Robot file = belts(corners());
  for (Cable& cable : file.cables) cable.pulley.position_sigma_m.setConstant(0.05);
  Log log = in_box(belts(corners()), 30, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng);
  log.direct_length_m.col(1) *= 1e3;
  const FrameResult found = find_frame(file, {log});
  EXPECT_NE(found.status, FrameStatus::converged);
  EXPECT_NE(found.reason.find("unit"), std::string::npos) << found.reason;
}

TEST(Frame, APulleyThatIsNotWhereTheFileHasItIsNamed) {
  constexpr double kTape_m = 2e-3;
  FrameOptions options;
  options.offset = LengthOffset::none;
  for (const double off_m : {0.0, 0.1}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      Rng rng(600 + seed);
      std::normal_distribution<double> tape(0.0, kTape_m);
      std::vector<Vector3> places = corners();
      for (Vector3& place : places) place += Vector3(tape(rng), 0.0, tape(rng));
      places[2].x() += off_m;
      Robot file = belts(corners());
      for (Cable& cable : file.cables) cable.pulley.position_sigma_m.setConstant(kTape_m);
      const Log log = in_box(belts(places), 60, {0.5, 0.0, 0.4}, {2.5, 0.0, 1.7}, rng);
      const FrameResult found = find_frame(file, {log}, options);
      if (off_m == 0.0) {
        EXPECT_EQ(found.status, FrameStatus::converged) << found.reason;
        continue;
      }
      EXPECT_EQ(found.status, FrameStatus::not_converged);
      EXPECT_EQ(found.reason.find("pulley 3 is "), 0U) << found.reason;
      EXPECT_EQ(found.reason.find(", pulley"), std::string::npos) << found.reason;
    }
  }
}

TEST(Frame, ALogThatIsGivenTwiceIsRefused) {
  Rng rng(13);
  const Twin twin = grid(belts(corners()), 5, 5, 0.0, rng);
  Log holes = twin.log;
  holes.direct_length_m(3, 1) = kNaN;
  EXPECT_THROW(find_frame(belts(rectangle()), {twin.log, twin.log}), InputError);
  EXPECT_THROW(find_frame(belts(rectangle()), {holes, twin.log, holes}), InputError);
  EXPECT_EQ(find_frame(belts(rectangle()), {holes, twin.log}).poses.size(), 50U);
}

TEST(Frame, AnglesThatCountFromBehindHaveTheirMeanThere) {
  Rng rng(14);
  detail::FrameProblem problem;
  problem.robot = test::random_robot(rng, 4);
  problem.basis = motion_basis(problem.robot);
  problem.sigma.fill(1.0);
  detail::FrameUnknowns& u = problem.unknowns;
  u.cables = 4;
  u.length_offsets = {-1};
  u.swivel_offsets = {12};
  u.yaw_offset = {-1};
  u.size = u.offsets_end = 16;
  detail::FrameState state;
  state.values = Eigen::VectorXd::Zero(u.size);
  for (int i = 0; i < 20; ++i) {
    Pose pose;
    pose.position_m = Vector3(0.02 * i, 0.01 * i, 0.4);
    detail::FramePose from;
    from.reading.swivel_rad = platform_state(problem.robot, pose).swivel_rad();
    for (double& angle : from.reading.swivel_rad) {
      angle = wrap_angle(angle + kPi + (i % 2 == 0 ? 0.01 : -0.01));
    }
    problem.poses.push_back(from);
    state.poses.push_back(pose);
  }
  detail::settle_offsets(problem, state);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(std::abs(state.values[12 + i]), kPi, 1e-6);
}

TEST(Frame, LogsOfOtherRobotsAreRefused) {
  Rng rng(9);
  const Twin twin = grid(belts(corners()), 5, 5, 0.0, rng);
  std::vector<Vector3> three = rectangle();
  three.pop_back();
  EXPECT_THROW(find_frame(belts(three), {twin.log}), InputError);
  EXPECT_THROW(find_frame(belts(rectangle()), {}), InputError);
  Log none = twin.log;
  none.direct_length_m.resize(none.sample_count(), 0);
  none.tension_N = twin.log.direct_length_m;
  EXPECT_THROW(find_frame(belts(rectangle()), {none}), InputError);
}

}  // namespace
}  // namespace cdprcal
