// A start-up of robots far lighter and heavier than irma4, with everything of the simulator's and
// of the procedure's at its default but the sensors, which are chosen for the robot.
#include <gtest/gtest.h>

#include "../support/scaled.hpp"
#include "cdprcal/simulator/simulate_startup.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

TEST(SimulatorSizes, LightAndHeavyRobotsComeToRest) {
  for (const double mass_kg : {0.3, 500.0}) {
    SCOPED_TRACE(mass_kg);
    const Robot drawn = load_robot("irma4");
    const double mass = mass_kg / drawn.platform.mass_kg;
    const Robot robot = test::scaled(drawn, {mass, std::cbrt(mass)});
    StartUpRunOptions options;
    SensorOptions& sensors = options.simulator.sensors;
    sensors.length_m.noise *= std::cbrt(mass);
    sensors.tension_N.noise *= mass;
    sensors.tension_N.resolution *= mass;
    StartUpPlan plan;
    plan.setpoint_N = default_setpoints(robot, 2, 1, 2);
    const StartUpRun run = simulate_startup(robot, plan, options);
    EXPECT_EQ(run.state, StartUpState::done) << run.reason;
    EXPECT_EQ(run.rests.size(), 4U);
  }
}

}  // namespace
}  // namespace cdprcal
