// Faults of the readings' map: what each means, and which are looked for.
#include "cdprcal/diagnosis/discrete.hpp"

#include <gtest/gtest.h>

#include <set>

#include "../support/run.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using test::named;
using test::startup_log;

class Discrete : public testing::Test {
 protected:
  static const Log& clean() {
    static const Log log = startup_log(load_robot("irma4"), 0.2, 31, 0);
    return log;
  }
  Robot robot = load_robot("irma4");
  Log log = clean();
};

TEST_F(Discrete, ALogThatAgreesIsLeftAsItIs) {
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(log.length_m, clean().length_m);
  EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
  EXPECT_EQ(log.roll_pitch_yaw_rad, clean().roll_pitch_yaw_rad);
}

TEST_F(Discrete, SeveralFaultsAreFoundOneAfterTheOther) {
  log.length_m *= 1e3;
  log.swivel_rad.col(1) *= -1.0;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].name, "length_unit");  // the worse one first
  EXPECT_EQ(faults[0].parameter, "factor");
  EXPECT_EQ(faults[0].values, std::vector<double>{1e-3});
  EXPECT_EQ(faults[0].text, "the lengths are in millimetres");
  EXPECT_EQ(faults[1].name, "swivel_sign");
  EXPECT_EQ(faults[1].parameter, "sign");
  EXPECT_EQ(faults[1].values, (std::vector<double>{1, -1, 1, 1}));
  EXPECT_EQ(faults[1].text, "the swivel of cable 2 counts backwards");
  // What comes back reads as if nothing had been wrong.
  EXPECT_LE((log.length_m - clean().length_m).norm(), 1e-12);
  EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
}

TEST_F(Discrete, AllSignsAtOnceAreOneFault) {
  log.swivel_rad *= -1.0;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "swivel_sign");
  EXPECT_EQ(faults[0].values, (std::vector<double>{-1, -1, -1, -1}));
  EXPECT_EQ(faults[0].text, "the swivel of cable 1, 2, 3, 4 counts backwards");
}

TEST_F(Discrete, AllAnglesInDegreesAreOneFault) {
  log.swivel_rad /= kDegree;
  log.roll_pitch_yaw_rad /= kDegree;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, (std::vector<double>{kDegree, kDegree}));
  EXPECT_EQ(faults[0].text, "all angles are in degrees");
}

TEST_F(Discrete, SwivelsInDegreesAreOne) {
  log.swivel_rad /= kDegree;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, (std::vector<double>{kDegree, 1.0}));
  EXPECT_EQ(faults[0].text, "the swivel angles are in degrees");
}

TEST_F(Discrete, AFaultIsFoundWithoutLoadCells) {
  log.tension_N.resize(log.sample_count(), 0);
  log.tension_setpoint_N.resize(log.sample_count(), 0);
  log.length_m.col(3) *= -1.0;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "length_sign");
  EXPECT_EQ(faults[0].values, (std::vector<double>{1, 1, 1, -1}));
}

TEST_F(Discrete, WhatTheRobotFileListsIsSetRightOnceAndNotFoundAgain) {
  log.swivel_rad.col(1) *= -1.0;
  log.length_m *= 1e3;
  robot.effects.push_back({"swivel_sign", "", {{"sign", {1, -1, 1, 1}}}});
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "length_unit");
}

TEST_F(Discrete, LengthsInAnotherUnitAreOneFault) {
  for (const auto& [factor, unit] : std::vector<std::pair<double, std::string>>{
           {1e-2, "centimetres"}, {0.0254, "inches"}, {0.3048, "feet"}}) {
    SCOPED_TRACE(unit);
    Log read = clean();
    read.length_m /= factor;
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, read);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, "length_unit");
    EXPECT_EQ(faults[0].values, std::vector<double>{factor});
    EXPECT_EQ(faults[0].text, "the lengths are in " + unit);
  }
}

TEST_F(Discrete, OneSensorInAnotherUnitThanTheOthersIsTold) {
  struct Case {
    LogMatrix Log::* channel;
    double factor;
    const char *name, *text;
  };
  for (const auto& [channel, factor, name, text] : {
           Case{&Log::length_m, 1e-3, "length_factor", "the length of cable 3 is in millimetres"},
           Case{&Log::length_m, 0.3048, "length_factor", "the length of cable 3 is in feet"},
           Case{&Log::swivel_rad, kDegree, "swivel_factor", "the swivel of cable 3 is in degrees"},
           Case{&Log::tension_N, 9.80665, "tension_factor", "the load cell of cable 3 is in kgf"},
           Case{&Log::tension_N, 4.4482216152605, "tension_factor",
                "the load cell of cable 3 is in lbf"},
       }) {
    SCOPED_TRACE(text);
    Log read = clean();
    (read.*channel).col(2) /= factor;
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, read);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, name);
    EXPECT_EQ(faults[0].values, (std::vector<double>{1.0, 1.0, factor, 1.0}));
    EXPECT_EQ(faults[0].text, text);
    EXPECT_LE((read.*channel - clean().*channel).norm(), 1e-9 * (clean().*channel).norm());
  }
}

TEST_F(Discrete, ACellThatShowsNoLoadIsInNoUnit) {
  log.tension_N.col(1).setConstant(3.0);  // it hangs on nothing, or its bridge is open
  for (const DiscreteFault& fault : find_discrete_faults(robot, log)) {
    EXPECT_NE(fault.name, "tension_factor");
    EXPECT_NE(fault.name, "tension_unit");
  }
}

TEST_F(Discrete, LengthsOfNoRobotAreInMillimetresWhateverTheirFitSays) {
  Log lengths = log;
  lengths.tension_N.resize(log.time_s.size(), 0);
  lengths.swivel_rad.resize(log.time_s.size(), 0);
  lengths.roll_pitch_yaw_rad.resize(log.time_s.size(), 0);
  lengths.length_m *= 1e3;
  Robot as_is = robot;
  const auto faults = find_discrete_faults(as_is, lengths);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].name, "length_unit");
  EXPECT_LT(lengths.length_m.cwiseAbs().maxCoeff(), 10.0);  // the log is set right

  // Encoders of which one, or none, reads anything are no reason to look at units.
  for (const bool any : {true, false}) {
    Log missing = log;
    missing.length_m.rightCols(any ? 1 : missing.length_m.cols()).setConstant(kNaN);
    for (const DiscreteFault& fault : find_discrete_faults(as_is, missing)) {
      EXPECT_NE(fault.name, "length_unit");
    }
  }
  // Nor do a few numbers beyond any robot make a unit.
  Log spiked = log;
  for (Eigen::Index row = 0; row < spiked.length_m.rows(); row += 50) {
    spiked.length_m.row(row).setConstant(1e5);
  }
  for (const DiscreteFault& fault : find_discrete_faults(as_is, spiked)) {
    EXPECT_NE(fault.name, "length_unit");
  }
}

TEST_F(Discrete, WhereCablesWouldPushALoadCellIsReversedAndNoCableElsewhere) {
  // Of a point that four cables hold from all sides another order fits as well, pushed.
  constexpr double kNoise_N = 1.0;
  Robot point;
  point.name = "point";
  point.platform.motion = Motion::t2;
  point.platform.mass_kg = 5.0;
  point.platform.motion_plane_normal = Vector3::UnitY();
  point.tension_min_N = 5.0;
  point.tension_max_N = 400.0;
  for (const Vector3& at : {Vector3(-1.0, 0.0, -1.0), Vector3(1.0, 0.0, -1.0),
                            Vector3(1.0, 0.0, 1.0), Vector3(-1.0, 0.0, 1.0)}) {
    Cable cable;
    cable.pulley.position_m = at;
    cable.pulley.axes_world << Vector3::UnitX(), Vector3::UnitY().cross(Vector3::UnitX()),
        Vector3::UnitY();
    point.cables.push_back(cable);
  }
  point.sigma.length_m = 1e-3;
  point.sigma.tension_N = kNoise_N;
  finalise(point);
  RandomNormal random(5);
  constexpr int kRests = 8;
  Log reversed;
  reversed.source = "reversed";
  reversed.time_s = Eigen::VectorXd::LinSpaced(kRests, 0.0, 10.0 * (kRests - 1));
  reversed.length_m.resize(kRests, 4);
  reversed.tension_N.resize(kRests, 4);
  for (int i = 0; i < kRests; ++i) {
    Pose pose;
    pose.position_m =
        Vector3(0.4 * random.uniform() - 0.2 + 0.1 * i - 0.35, 0.0, 0.8 * random.uniform() - 0.4);
    const PlatformState state = platform_state(point, pose);
    // Whatever pulls beside the weight is held by all four.
    const Eigen::Matrix<double, 2, 4> pull = [&] {
      Eigen::Matrix<double, 2, 4> out;
      for (std::size_t c = 0; c < 4; ++c) {
        const Vector3& direction = state.cable[c].direction;
        out.col(static_cast<Eigen::Index>(c)) << -direction.x(), -direction.z();
      }
      return out;
    }();
    const Eigen::Vector2d weight_N(0.0, point.weight_N());
    Eigen::Vector4d tension_N = Eigen::Vector4d::Constant(60.0);
    tension_N +=
        pull.transpose() * (pull * pull.transpose()).inverse() * (weight_N - pull * tension_N);
    for (int c = 0; c < 4; ++c) {
      reversed.length_m(i, c) = state.length_m()[c] + 1e-3 * random();
      reversed.tension_N(i, c) = -tension_N[c] + kNoise_N * random();
    }
  }
  ASSERT_LT(reversed.tension_N.maxCoeff(), 0.0);
  reversed.length_m.rowwise() -= reversed.length_m.row(0).eval();
  const auto faults = find_discrete_faults(point, reversed);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "tension_sign");
  EXPECT_GT(reversed.tension_N.minCoeff(), 0.0);
}

TEST_F(Discrete, AFaultIsFoundInThreeRests) {
  std::vector<CableVector> setpoints = default_setpoints(robot, 2, 2, 2);
  setpoints.resize(3);
  log = test::run_through(robot, setpoints, 0.2, 33);
  log.length_m *= 1e3;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "length_unit");
  EXPECT_EQ(faults[0].text, "the lengths are in millimetres");
}

TEST_F(Discrete, ASmallErrorIsNoFault) {
  // Far beyond what chance does, and no sign, order, unit or convention.
  log.length_m.col(0) *= 1.1;
  log.length_m.col(2) *= 0.9;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  EXPECT_TRUE(faults.empty());
  EXPECT_GT(calibrate(robot, log).result.cost, 100.0);
}

TEST_F(Discrete, EncodersOfOneKindAreFoundInAnotherOrder) {
  const LogMatrix lengths = log.length_m;
  log.length_m.col(0).swap(log.length_m.col(2));
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, (std::vector<double>{3, 2, 1, 4}));
  EXPECT_EQ(faults[0].swivel_order, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(faults[0].text, "the length encoders of the cables are read in another order");
  EXPECT_EQ(log.length_m, lengths);
}

TEST_F(Discrete, LoadCellsZeroedUnderLoadAreFound) {
  const Eigen::RowVectorXd held = log.tension_N.row(0);
  log.tension_N.rowwise() -= held;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "tension_offset");
  EXPECT_EQ(faults[0].text, "the load cells were zeroed under load");
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(faults[0].values[static_cast<std::size_t>(i)], held[i], 2.0) << i;
  }
  EXPECT_LE((log.tension_N - clean().tension_N).cwiseAbs().maxCoeff(), 2.0);
}

TEST_F(Discrete, LoadsThatDoNotBearThePlatformAreNoZero) {
  // As readings look where the base is tilted: far beyond what chance does.
  log.tension_N.rowwise() += Eigen::RowVector4d(-14.0, 1.0, 11.0, -2.0);
  ASSERT_GT(calibrate(robot, log).result.cost, 100.0);
  EXPECT_TRUE(find_discrete_faults(robot, log).empty());
}

TEST_F(Discrete, AnAhrsMountedOtherwiseIsFound) {
  const Vector3 up(kPi, 0, 0), side(kPi / 2, 0, 0), corner(0, -kPi / 2, 0), askew(0.2, -0.35, 0.1);
  for (const Vector3& turned : {up, side, corner, askew}) {
    SCOPED_TRACE(turned.transpose());
    Log other = clean();
    Robot given = robot;
    for (Eigen::Index row = 0; row < other.sample_count(); ++row) {
      const Vector3 angles = other.roll_pitch_yaw_rad.row(row).transpose();
      const Matrix3 sensor = (rotation_from_euler(angles, robot.euler_convention) * exp_so3(turned))
                                 .toRotationMatrix();
      other.roll_pitch_yaw_rad.row(row) =
          euler_from_rotation(sensor, robot.euler_convention).transpose();
    }
    const std::vector<DiscreteFault> faults = find_discrete_faults(given, other);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, "attitude_mounting");
    // What turns axes into axes is taken as it is meant; yaw has an offset of its own anyway.
    const LogMatrix off = other.roll_pitch_yaw_rad - clean().roll_pitch_yaw_rad;
    EXPECT_LT(off.leftCols<2>().cwiseAbs().maxCoeff(), turned == askew ? 0.02 : 1e-9);
  }
}

TEST_F(Discrete, AnglesZeroedWhereThePlatformWasNotLevelAreFound) {
  const Eigen::RowVector3d zero(0.3, -0.25, 0.0);
  log.roll_pitch_yaw_rad.rowwise() -= zero;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "attitude_offset");
  for (int a = 0; a < 2; ++a) {
    EXPECT_NEAR(faults[0].values[static_cast<std::size_t>(a)], zero[a], 0.01) << a;
  }
}

TEST_F(Discrete, WhatIsListedSetsTheLogRightAsTheFaultDoes) {
  const std::vector<DiscreteFault> faults{
      {"length_sign", "sign", {1, -1, 1, -1}, ""},
      {"cable_order", "order", {2, 3, 4, 1}, "", {1, 2, 3, 4}},
      {"cable_order", "order", {2, 3, 4, 1}, ""},
      {"cable_order", "order", {2, 3, 4, 1}, "", {1, 2, 3, 4}, {1, 2, 3, 4}},
      {"angle_unit", "factor", {1.0, kDegree}, ""},
      {"length_factor", "factor", {1.0, 0.3048, 1.0, 1.0}, ""},
      {"swivel_factor", "factor", {kDegree, 1.0, 1.0, 1.0}, ""},
      {"tension_factor", "factor", {1.0, 1.0, 9.80665, 1.0}, ""},
      {"tension_offset", "offset_N", {1.0, 2.0, 3.0, 4.0}, ""},
      {"attitude_offset", "offset_rad", {0.1, 0.2, 0.3}, ""},
      {"attitude_mounting", "rotation_rad", {0.1, 0.2, 0.3}, ""},
  };
  for (const DiscreteFault& fault : faults) {
    SCOPED_TRACE(fault.name);
    const AppliedEffect listed = as_listed(fault);
    EXPECT_TRUE(is_reading_fault(listed.name));
    Robot listing = robot;
    listing.effects.push_back(listed);
    EXPECT_NO_THROW(check_effects(listing));
    EXPECT_EQ(listed.parameters.size(), 1U + (fault.tension_order.empty() ? 0U : 1U) +
                                            (fault.swivel_order.empty() ? 0U : 1U));
    EXPECT_EQ(listed.parameters[0].name, fault.parameter);
    EXPECT_EQ(listed.parameters[0].values, fault.values);
    Log by_file = log, by_fault = log;
    set_right(listed, robot, by_file);
    set_right(fault, robot, by_fault);
    EXPECT_EQ(by_file.length_m, by_fault.length_m);
    EXPECT_EQ(by_file.swivel_rad, by_fault.swivel_rad);
    EXPECT_EQ(by_file.tension_N, by_fault.tension_N);
    EXPECT_EQ(by_file.roll_pitch_yaw_rad, by_fault.roll_pitch_yaw_rad);
    EXPECT_EQ(robot.euler_convention, load_robot("irma4").euler_convention);
  }
}

TEST_F(Discrete, TheEulerConventionIsTheRobotsAndTheLogStays) {
  set_right({"euler_convention", "convention", {5.0}, "", {}, {}, EulerConvention::ZYX}, robot,
            log);
  EXPECT_EQ(robot.euler_convention, EulerConvention::ZYX);
  EXPECT_EQ(log.roll_pitch_yaw_rad, clean().roll_pitch_yaw_rad);
}

TEST_F(Discrete, WhatNoFaultExplainsIsNone) {
  // Some map may well lower the cost of a log that contradicts its model: not by enough.
  for (const double scale : {0.6, 1.3, 1.6}) {
    log = clean();
    log.tension_N *= scale;
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
    EXPECT_TRUE(faults.empty()) << scale << " " << faults[0].text;
    EXPECT_EQ(log.length_m, clean().length_m);
  }
}

TEST_F(Discrete, FewSensorsThatLeaveThePoseOpenAccuseNobody) {
  for (int left_out = 1; left_out < 15; ++left_out) {
    log = clean();
    const auto without = [&](int bit, LogMatrix& group) {
      if ((left_out >> bit & 1) != 0) group.resize(log.sample_count(), 0);
    };
    without(0, log.length_m);
    without(1, log.swivel_rad);
    without(2, log.tension_N);
    without(3, log.roll_pitch_yaw_rad);
    try {
      const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
      EXPECT_TRUE(faults.empty()) << left_out << " " << faults[0].text;
    } catch (const InputError&) {  // too few to find a rest
    }
  }
}

TEST_F(Discrete, TheAttitudeInDegreesIsOne) {
  log.roll_pitch_yaw_rad /= kDegree;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, (std::vector<double>{1.0, kDegree}));
  EXPECT_EQ(faults[0].text, "the attitude is in degrees");
}

TEST_F(Discrete, AUnitIsAccusedOnlyWhereTheReadingsThenSaySomething) {
  // The readings in the right unit vary by less than what their sensors are said to be good for.
  const auto accused = [&](double SensorSigma::* sigma, double coarse, LogMatrix Log::* readings,
                           double factor) {
    robot = load_robot("irma4");
    log = clean();
    log.*readings *= factor;
    Log same = log;
    EXPECT_EQ(find_discrete_faults(robot, same).size(), 1U);
    robot.sigma.*sigma = coarse;
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
    return faults.empty() ? std::string() : faults.front().text;
  };
  constexpr double kInDegrees = 1.0 / kDegree;
  const double coarse_swivel = 40.0 * kDegree, coarse_attitude = 20.0 * kDegree;
  EXPECT_EQ(accused(&SensorSigma::length_m, 2.0, &Log::length_m, 1e3), "");
  EXPECT_EQ(accused(&SensorSigma::swivel_rad, coarse_swivel, &Log::swivel_rad, kInDegrees), "");
  EXPECT_EQ(
      accused(&SensorSigma::attitude_rad, coarse_attitude, &Log::roll_pitch_yaw_rad, kInDegrees),
      "");
  // Only those readings count whose unit is another.
  EXPECT_EQ(accused(&SensorSigma::swivel_rad, coarse_swivel, &Log::roll_pitch_yaw_rad, kInDegrees),
            "the attitude is in degrees");
  EXPECT_EQ(accused(&SensorSigma::attitude_rad, coarse_attitude, &Log::swivel_rad, kInDegrees),
            "the swivel angles are in degrees");
}

TEST_F(Discrete, AnglesThatTheLogLacksAreNotAccused) {
  log.roll_pitch_yaw_rad.resize(log.sample_count(), 0);
  log.swivel_rad /= kDegree;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].text, "the swivel angles are in degrees");
}

/// Columns in another order: cable i is read on channel order[i], counted from 1.
LogMatrix read_on(const LogMatrix& columns, const std::vector<double>& order) {
  LogMatrix out = columns;
  for (std::size_t i = 0; i < order.size(); ++i) {
    out.col(static_cast<Eigen::Index>(order[i]) - 1) = columns.col(static_cast<Eigen::Index>(i));
  }
  return out;
}

TEST_F(Discrete, EveryOrderOfFourCablesIsFoundWithItsLoadCellsOrWithout) {
  std::vector<double> order{1, 2, 3, 4};
  const std::vector<double> as_it_is = order;
  bool cells_too = false;
  while (std::next_permutation(order.begin(), order.end())) {
    cells_too = !cells_too;
    SCOPED_TRACE(testing::PrintToString(order) + (cells_too ? " all" : " encoders"));
    log = clean();
    log.length_m = read_on(log.length_m, order);
    log.swivel_rad = read_on(log.swivel_rad, order);
    if (cells_too) log.tension_N = read_on(log.tension_N, order);
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, "cable_order");
    EXPECT_EQ(faults[0].values, order);
    EXPECT_EQ(faults[0].tension_order, cells_too ? std::vector<double>{} : as_it_is);
    EXPECT_EQ(log.length_m, clean().length_m);
    EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
    EXPECT_EQ(log.tension_N, clean().tension_N);
  }
}

TEST_F(Discrete, EveryEulerConventionIsFound) {
  const EulerConvention right = robot.euler_convention;
  for (int c = 0; c < 6; ++c) {
    robot.euler_convention = static_cast<EulerConvention>(c);
    SCOPED_TRACE(to_string(robot.euler_convention));
    // The platform tilts by 12 deg and turns by 1.5 deg: in fine readings the order matters.
    log = startup_log(robot, 0.01, 31, 0);
    robot.euler_convention = right;
    for (double* sigma : {&robot.sigma.length_m, &robot.sigma.swivel_rad, &robot.sigma.attitude_rad,
                          &robot.sigma.tension_N}) {
      *sigma *= 0.002;  // of a mean over a rest
    }
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
    ASSERT_EQ(faults.size(), c == static_cast<int>(right) ? 0U : 1U);
    EXPECT_EQ(static_cast<int>(robot.euler_convention), c);
    robot = load_robot("irma4");
  }
}

/// A robot of so many cables, for what needs no balance.
Robot of_cables(int n) {
  Robot robot = load_robot("irma4");
  while (robot.cable_count() < n) robot.cables.push_back(robot.cables[0]);
  robot.cables.resize(static_cast<std::size_t>(n));
  return robot;
}

Log channels(int n, bool lengths, bool swivels, bool tensions) {
  Log log;
  log.length_m.resize(1, lengths ? n : 0);
  log.swivel_rad.resize(1, swivels ? n : 0);
  log.tension_N.resize(1, tensions ? n : 0);
  log.roll_pitch_yaw_rad.resize(1, 3);
  return log;
}

TEST(DiscreteFaults, SignsAreEveryCombination) {
  for (int n = 1; n <= kMaxCables; ++n) {
    const std::vector<DiscreteFault> all =
        discrete_faults(of_cables(n), channels(n, true, true, true));
    for (const std::string name : {"length_sign", "swivel_sign"}) {
      SCOPED_TRACE(name + " " + std::to_string(n));
      std::set<std::vector<double>> different;
      for (const DiscreteFault& fault : named(all, name)) {
        EXPECT_EQ(fault.parameter, "sign");
        ASSERT_EQ(static_cast<int>(fault.values.size()), n);
        std::string cables;
        int turned = 0;
        for (int i = 0; i < n; ++i) {
          const double sign = fault.values[static_cast<std::size_t>(i)];
          EXPECT_EQ(std::abs(sign), 1.0);
          if (sign > 0.0) continue;
          cables += (turned++ == 0 ? "" : ", ") + std::to_string(i + 1);
        }
        EXPECT_GT(turned, 0);
        EXPECT_EQ(fault.text,
                  (name == "length_sign" ? "the length of cable " : "the swivel of cable ") +
                      cables + " counts backwards");
        different.insert(fault.values);
      }
      EXPECT_EQ(different.size(), named(all, name).size());
      EXPECT_EQ(static_cast<int>(different.size()), (1 << n) - 1);
    }
  }
}

TEST_F(Discrete, TensionsInAnotherUnitAreOneFault) {
  for (const auto& [factor, text] :
       std::vector<std::pair<double, std::string>>{{9.80665, "the tensions are in kgf"},
                                                   {4.4482216152605, "the tensions are in lbf"},
                                                   {1e3, "the tensions are in kN"},
                                                   {9.80665e-3, "the tensions are in gf"}}) {
    SCOPED_TRACE(text);
    Log read = clean();
    read.tension_N /= factor;
    read.tension_setpoint_N /= factor;
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, read);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, "tension_unit");
    EXPECT_EQ(faults[0].values, std::vector<double>{factor});
    EXPECT_EQ(faults[0].text, text);
    EXPECT_LE((read.tension_N - clean().tension_N).norm(), 1e-9 * clean().tension_N.norm());
  }
}

TEST_F(Discrete, LoadCellsAloneInAnotherOrder) {
  log.tension_N.col(0).swap(log.tension_N.col(3));
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].name, "cable_order");
  EXPECT_EQ(faults[0].values, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(faults[0].tension_order, (std::vector<double>{4, 2, 3, 1}));
  EXPECT_EQ(log.tension_N, clean().tension_N);
}

TEST_F(Discrete, TheSearchCanBeStoppedAmongOrdersAndSigns) {
  log.length_m.col(0).swap(log.length_m.col(2));
  log.swivel_rad.rowwise().reverseInPlace();
  log.length_m.col(1) *= -1.0;
  std::vector<std::string> steps;
  const std::vector<DiscreteFault> faults =
      find_discrete_faults(robot, log, false, [&](const auto& step) {
        steps.push_back(step);
        return step.find("200 of") == std::string::npos;
      });
  EXPECT_TRUE(faults.empty());
  EXPECT_EQ(steps.front(), "discrete faults: signs, order, units, conventions");
  EXPECT_EQ(steps.back().find("discrete faults: an order and signs together, 200 of "), 0U);
}

TEST_F(Discrete, AnOrderAndSignsTogetherAreFound) {
  for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
    m->col(0).swap(m->col(2));
  }
  log.swivel_rad.col(0) *= -1.0;
  log.swivel_rad.col(1) *= -1.0;
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].name, "swivel_sign");
  EXPECT_EQ(faults[0].values, (std::vector<double>{-1, -1, 1, 1}));
  EXPECT_EQ(faults[1].name, "cable_order");
  EXPECT_EQ(faults[1].values, (std::vector<double>{3, 2, 1, 4}));
  EXPECT_EQ(log.length_m, clean().length_m);
  EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
}

TEST(DiscreteFaults, OrdersAreEveryPermutationOfFewCablesAndEveryExchangeInMany) {
  for (int n = 1; n <= kMaxCables; ++n) {
    for (const bool cells : {true, false}) {
      SCOPED_TRACE(n);
      const std::vector<DiscreteFault> orders =
          named(discrete_faults(of_cables(n), channels(n, true, true, cells)), "cable_order");
      std::vector<double> as_it_is;
      for (int i = 1; i <= n; ++i) as_it_is.push_back(i);
      std::set<std::vector<double>> with_cells, encoders_alone, cells_alone, lengths_alone,
          swivels_alone;
      for (const DiscreteFault& fault : orders) {
        EXPECT_EQ(fault.parameter, "order");
        const bool alone = fault.values == as_it_is;
        const std::vector<double>& own =
            fault.swivel_order.empty() ? fault.tension_order : fault.swivel_order;
        const std::vector<double>& wrong = alone ? own : fault.values;
        EXPECT_NE(wrong, as_it_is);
        EXPECT_TRUE(
            std::is_permutation(as_it_is.begin(), as_it_is.end(), wrong.begin(), wrong.end()));
        std::vector<std::size_t> moved;
        for (std::size_t i = 0; i < as_it_is.size(); ++i) {
          if (wrong[i] != as_it_is[i]) moved.push_back(i + 1);
        }
        std::string who = "the cables";
        if (n > 6) {
          ASSERT_EQ(moved.size(), 2U);
          who = "cables " + std::to_string(moved[0]) + " and " + std::to_string(moved[1]);
        }
        who += " are read in another order";
        if (!fault.swivel_order.empty()) {
          (alone ? swivels_alone : lengths_alone).insert(wrong);
          EXPECT_EQ(fault.tension_order, as_it_is);
          EXPECT_EQ(fault.text,
                    (alone ? "the swivel encoders of " : "the length encoders of ") + who);
        } else if (fault.tension_order.empty()) {
          with_cells.insert(fault.values);
          EXPECT_EQ(fault.text, who);
        } else if (alone) {
          cells_alone.insert(wrong);
          EXPECT_EQ(fault.text, "the load cells of " + who);
        } else {
          encoders_alone.insert(fault.values);
          EXPECT_EQ(fault.tension_order, as_it_is);
          EXPECT_EQ(fault.text,
                    "the length and swivel encoders of " + who + ", the load cells are not");
        }
      }
      EXPECT_EQ(with_cells.size() + encoders_alone.size() + cells_alone.size() +
                    lengths_alone.size() + swivels_alone.size(),
                orders.size());
      EXPECT_EQ(lengths_alone, with_cells);
      EXPECT_EQ(swivels_alone, with_cells);
      constexpr std::size_t kPermutations[] = {0, 0, 1, 5, 23, 119, 719};
      const auto count = static_cast<std::size_t>(n);
      EXPECT_EQ(with_cells.size(), n <= 6 ? kPermutations[count] : count * (count - 1) / 2);
      EXPECT_EQ(encoders_alone, cells ? with_cells : std::set<std::vector<double>>{});
      EXPECT_EQ(cells_alone, encoders_alone);
    }
  }
}

TEST(DiscreteFaults, SignsAreOfChannelsThatThereAre) {
  const Robot robot = of_cables(4);
  for (const bool lengths : {true, false}) {
    for (const bool swivels : {true, false}) {
      const auto all = discrete_faults(robot, channels(4, lengths, swivels, true));
      EXPECT_EQ(named(all, "length_sign").empty(), !lengths);
      EXPECT_EQ(named(all, "swivel_sign").empty(), !swivels);
    }
  }
}

TEST(DiscreteFaults, UnitsAndConventions) {
  Robot robot = of_cables(4);
  for (int own = 0; own < 6; ++own) {
    robot.euler_convention = static_cast<EulerConvention>(own);
    const auto all = discrete_faults(robot, channels(4, true, true, true));
    EXPECT_EQ(named(all, "length_unit").size(), 4U);
    EXPECT_EQ(named(all, "length_factor").size(), 16U);
    EXPECT_EQ(named(all, "swivel_factor").size(), 4U);
    EXPECT_EQ(named(all, "tension_factor").size(), 16U);
    EXPECT_EQ(named(all, "angle_unit").size(), 3U);
    std::set<int> others;
    for (const DiscreteFault& fault : named(all, "euler_convention")) {
      EXPECT_EQ(fault.parameter, "convention");
      ASSERT_EQ(fault.values.size(), 1U);
      const int c = static_cast<int>(fault.values[0]);
      others.insert(c);
      EXPECT_EQ(fault.text,
                "the attitude's Euler angles are " + to_string(static_cast<EulerConvention>(c)));
    }
    EXPECT_EQ(others.size(), 5U);
    EXPECT_EQ(others.count(own), 0U);
    EXPECT_EQ(*others.begin(), own == 0 ? 1 : 0);
    EXPECT_EQ(*others.rbegin(), own == 5 ? 4 : 5);
  }
}

TEST(DiscreteOfFiveCables, AnyOrderIsFound) {
  Robot robot = load_robot("ring5");
  const Log clean = test::run_through(robot, default_setpoints(robot, 2, 2, 2), 0.2, 32);
  for (const std::vector<double>& order :
       {std::vector<double>{2, 1, 3, 4, 5}, {5, 2, 3, 4, 1}, {3, 5, 1, 2, 4}}) {
    SCOPED_TRACE(testing::PrintToString(order));
    Log log = clean;
    log.length_m = read_on(log.length_m, order);
    log.swivel_rad = read_on(log.swivel_rad, order);
    log.tension_N = read_on(log.tension_N, order);
    const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].name, "cable_order");
    EXPECT_EQ(faults[0].values, order);
    EXPECT_EQ(log.length_m, clean.length_m);
    EXPECT_EQ(log.tension_N, clean.tension_N);
  }
}

/// A sixth cable in the largest gap of ring5.
Robot ring6() {
  Robot robot = load_robot("ring5");
  robot.cables.push_back(robot.cables[0]);
  Cable& sixth = robot.cables.back();
  sixth.pulley.position_m = {-0.93, -0.12, 1.7};
  sixth.pulley.axes_world.leftCols<2>() *= -1.0;
  sixth.platform_anchor_m = {-0.11, -0.02, 0.05};
  return robot;
}

/// Tensions do not say where six cables hold a platform: it is moved from pose to pose.
Log moved(const Robot& robot) {
  RandomNormal random(34);
  const ReadingOffsets offsets = random_offsets(6, random);
  const ReadingNoise noise = reading_noise(robot.sigma, 0.2);
  constexpr int kRests = 8, kSamples = 40;  // a rest, and as many on the way to the next
  std::vector<Pose> stops;
  for (int k = 0; k < kRests; ++k) {
    const Vector3 position(0.3 * random.uniform() - 0.15, 0.3 * random.uniform() - 0.15,
                           0.5 + 0.3 * random.uniform());
    const Vector3 turn =
        Vector3(random.uniform(), random.uniform(), random.uniform()).array() - 0.5;
    stops.push_back({position, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, turn.normalized()))});
  }
  Log log;
  const int rows = (2 * kRests - 1) * kSamples;
  log.time_s.resize(rows);
  log.length_m.resize(rows, 6);
  log.swivel_rad.resize(rows, 6);
  log.roll_pitch_yaw_rad.resize(rows, 3);
  log.tension_N.resize(rows, 0);
  log.tension_setpoint_N.resize(rows, 0);
  for (int row = 0; row < rows; ++row) {
    const int leg = row / kSamples;
    const auto from = static_cast<std::size_t>(leg / 2);
    const double way = leg % 2 == 0 ? 0.0 : (row % kSamples + 1.0) / (kSamples + 1.0);
    const Pose& a = stops[from];
    const Pose& b = stops[std::min(from + 1, stops.size() - 1)];
    const Pose pose{(1.0 - way) * a.position_m + way * b.position_m,
                    a.rotation.slerp(way, b.rotation)};
    const Measurement m = synthetic_measurement(robot, pose, CableVector::Zero(6),
                                                PoseKind::kinematic_pose, offsets, noise, random);
    log.time_s[row] = 0.1 * row;
    log.length_m.row(row) = m.length_m;
    log.swivel_rad.row(row) = m.swivel_rad;
    log.roll_pitch_yaw_rad.row(row) = m.roll_pitch_yaw_rad;
  }
  return log;
}

TEST(DiscreteOfSixCables, SeveralSignsAndAnyOrderAreFoundAtOnce) {
  // None of them alone would help.
  Robot robot = ring6();
  const Log clean = moved(robot);
  Log log = clean;
  for (const int i : {0, 2, 5}) log.swivel_rad.col(i) *= -1.0;
  std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, (std::vector<double>{-1, 1, -1, 1, 1, -1}));
  EXPECT_EQ(log.swivel_rad, clean.swivel_rad);

  const std::vector<double> order{2, 3, 1, 4, 6, 5};
  log.length_m = read_on(log.length_m, order);
  log.swivel_rad = read_on(log.swivel_rad, order);
  faults = find_discrete_faults(robot, log);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].values, order);
  EXPECT_EQ(log.swivel_rad, clean.swivel_rad);
}

TEST(DiscreteOfSixCables, AUnitThatLeavesReadingsWithNothingToSayIsNotAccused) {
  // Length encoders that read another run's: no fault that is looked for. In millimetres the
  // lengths would stand still, and contradict nothing any more.
  Robot robot = ring6();
  Log log = moved(robot);
  log.length_m.col(0).reverseInPlace();
  log.length_m.col(3).reverseInPlace();
  EXPECT_GT(calibrate(robot, log).result.cost, 1e3);
  const std::vector<DiscreteFault> faults = find_discrete_faults(robot, log);
  EXPECT_TRUE(faults.empty()) << faults[0].text;
}

}  // namespace
}  // namespace cdprcal
