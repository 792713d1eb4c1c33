#include "cdprcal/model/robot.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

using test::Rng;

/// finalise must refuse irma4 after `change`, in a message that names `field`.
void expect_refused(const std::string& field, const std::function<void(Robot&)>& change) {
  Robot robot = load_robot("irma4");
  change(robot);
  try {
    finalise(robot);
    ADD_FAILURE() << field << " was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(field + ": "), std::string::npos) << error.what();
  }
}

TEST(Finalise, RefusesEveryImpossibleNumberByName) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, infinity, -1.0, 0.0}) {
    expect_refused("gravity_m_s2", [&](Robot& r) { r.gravity_m_s2 = bad; });
    expect_refused("platform.mass_kg", [&](Robot& r) { r.platform.mass_kg = bad; });
    expect_refused("sensors.sigma.length_m", [&](Robot& r) { r.sigma.length_m = bad; });
    expect_refused("sensors.sigma.swivel_deg", [&](Robot& r) { r.sigma.swivel_rad = bad; });
    expect_refused("sensors.sigma.attitude_deg", [&](Robot& r) { r.sigma.attitude_rad = bad; });
    expect_refused("sensors.sigma.tension_N", [&](Robot& r) { r.sigma.tension_N = bad; });
  }
  for (const double bad : {kNaN, infinity, -1e-9}) {
    expect_refused("cables[#2].pulley.radius_m",
                   [&](Robot& r) { r.cables[1].pulley.radius_m = bad; });
    expect_refused("sensors.sigma.wrench_force_N", [&](Robot& r) { r.sigma.wrench_force_N = bad; });
    expect_refused("sensors.sigma.wrench_moment_Nm",
                   [&](Robot& r) { r.sigma.wrench_moment_Nm = bad; });
  }
  for (const double bad : {kNaN, infinity}) {
    expect_refused("platform.centre_of_mass_m",
                   [&](Robot& r) { r.platform.centre_of_mass_m[1] = bad; });
    expect_refused("cables[#4].pulley.position_m",
                   [&](Robot& r) { r.cables[3].pulley.position_m[0] = bad; });
    expect_refused("cables[#1].platform_anchor_m",
                   [&](Robot& r) { r.cables[0].platform_anchor_m[2] = bad; });
    expect_refused("cables[#3].pulley.x_axis",
                   [&](Robot& r) { r.cables[2].pulley.axes_world(0, 0) = bad; });
    expect_refused("cables[#3].pulley.swivel_axis",
                   [&](Robot& r) { r.cables[2].pulley.axes_world(0, 2) = bad; });
    expect_refused("tension_limits_N", [&](Robot& r) { r.tension_max_N = bad; });
  }
  expect_refused("name", [](Robot& r) { r.name.clear(); });
  expect_refused("name", [](Robot& r) { r.name = "two\nlines"; });
}

TEST(Finalise, RefusesImpossibleCombinations) {
  expect_refused("cables", [](Robot& r) { r.cables.clear(); });
  expect_refused("cables", [](Robot& r) { r.cables.resize(9, r.cables[0]); });
  expect_refused("tension_limits_N", [](Robot& r) { std::swap(r.tension_min_N, r.tension_max_N); });
  expect_refused("tension_limits_N", [](Robot& r) { r.tension_min_N = r.tension_max_N; });
  expect_refused("tension_limits_N", [](Robot& r) { r.tension_min_N = -1.0; });
  expect_refused("cables[#1].pulley.x_axis",
                 [](Robot& r) { r.cables[0].pulley.axes_world.col(0).setZero(); });
  expect_refused("cables[#1].pulley.swivel_axis",
                 [](Robot& r) { r.cables[0].pulley.axes_world.col(2).setZero(); });
  expect_refused("platform.motion_plane_normal", [](Robot& r) { r.platform.motion = Motion::t2; });
  expect_refused("platform.motion_plane_normal",
                 [](Robot& r) { r.platform.motion_plane_normal = Vector3::UnitY(); });
  expect_refused("cables[#1].pulley.position_sigma_m",
                 [](Robot& r) { r.cables[0].pulley.position_sigma_m = Vector3(1.0, kNaN, 1.0); });
  expect_refused("cables[#1].pulley.x_axis", [](Robot& r) {  // 2 mrad off perpendicular
    r.cables[0].pulley.axes_world.col(0) = Vector3(2e-3, 0.0, -1.0);
  });
}

TEST(Finalise, RefusesInertiaThatNoBodyHas) {
  const auto inertia = [](const Matrix3& matrix) {
    return [=](Robot& r) { r.platform.inertia_kg_m2 = matrix; };
  };
  const std::string field = "platform.inertia_kg_m2";
  Matrix3 matrix = Matrix3::Identity();
  matrix(0, 1) = 0.1;
  expect_refused(field, inertia(matrix));                                // not symmetric
  expect_refused(field, inertia(Matrix3::Zero()));                       // no body at all
  expect_refused(field, inertia(Vector3(1.0, 1.0, -0.1).asDiagonal()));  // negative
  expect_refused(field, inertia(Vector3(1.0, 1.0, 2.1).asDiagonal()));   // 1 + 1 < 2.1
  matrix = Matrix3::Identity();
  matrix(2, 2) = kNaN;
  expect_refused(field, inertia(matrix));
  Robot plate = load_robot("irma4");
  plate.platform.inertia_kg_m2 = Vector3(1.0, 1.0, 2.0).asDiagonal();  // a flat plate is a body
  EXPECT_NO_THROW(finalise(plate));
}

TEST(Finalise, MakesTheAxesOrthonormalAndRightHanded) {
  Rng rng(61);
  for (int i = 0; i < 200; ++i) {
    Robot robot = test::random_robot(rng, 3);
    for (Cable& cable : robot.cables) {
      Matrix3& axes = cable.pulley.axes_world;
      const Vector3 swivel = axes.col(2), x = axes.col(0);
      axes.col(0) = test::uniform(rng, 0.1, 10.0) * (x + test::uniform(rng, -9e-4, 9e-4) * swivel);
      axes.col(1).setConstant(kNaN);  // never read
      axes.col(2) *= test::uniform(rng, 1e-200, 1e200);
      finalise(robot);
      EXPECT_LE((axes.transpose() * axes - Matrix3::Identity()).cwiseAbs().maxCoeff(), 4e-15);
      EXPECT_LE((axes.col(1) - axes.col(2).cross(axes.col(0))).norm(), 1e-15);
      EXPECT_LE((axes.col(2) - swivel).norm(), 1e-15);  // only x gives way
      EXPECT_LE((axes.col(0) - x).norm(), 1e-14);
    }
  }
}

TEST(Finalise, TwiceChangesNoBit) {
  Rng rng(62);
  for (int i = 0; i < 200; ++i) {
    const Robot once = test::random_robot(rng, 1 + i % 8);
    Robot twice = once;
    finalise(twice);
    EXPECT_EQ(twice.platform.inertia_kg_m2, once.platform.inertia_kg_m2);
    EXPECT_EQ(twice.sigma.wrench_force_N, once.sigma.wrench_force_N);
    for (std::size_t c = 0; c < once.cables.size(); ++c) {
      EXPECT_EQ(twice.cables[c].pulley.axes_world, once.cables[c].pulley.axes_world);
    }
  }
}

TEST(Finalise, WrenchSigmaDefaultsToAMillimetreAndGivenOnesStay) {
  Robot robot = load_robot("irma4");
  EXPECT_DOUBLE_EQ(robot.sigma.wrench_force_N, 12.992 * 9.81 * 1e-3);
  EXPECT_DOUBLE_EQ(robot.sigma.wrench_moment_Nm, 12.992 * 9.81 * 1e-3);
  robot.sigma.wrench_force_N = 0.5;
  robot.sigma.wrench_moment_Nm = 0.0;
  robot.platform.mass_kg = 20.0;
  finalise(robot);
  EXPECT_EQ(robot.sigma.wrench_force_N, 0.5);
  EXPECT_DOUBLE_EQ(robot.sigma.wrench_moment_Nm, 20.0 * 9.81 * 1e-3);
  // A frame of twice the size is known half as well.
  for (Cable& cable : robot.cables) cable.pulley.position_m *= 2.0;
  robot.sigma.wrench_moment_Nm = 0.0;
  finalise(robot);
  EXPECT_DOUBLE_EQ(robot.sigma.wrench_moment_Nm, 20.0 * 9.81 * 2e-3);
}

}  // namespace
}  // namespace cdprcal
