// Speed of the simulated robot: times real time on one core.
#include <benchmark/benchmark.h>

#include "../cpp/support/startup_scenario.hpp"

namespace {

using namespace cdprcal;

/// A transition between two set-points, again and again. Counter x_real_time: seconds per second.
void SimulatorStep(benchmark::State& state) {
  const auto mode = static_cast<WinchMode>(state.range(1));
  const Robot robot = state.range(0) == 4 ? load_robot("irma4")
                                          : test::ring_robot(static_cast<int>(state.range(0)));
  const StartUpPlan plan = state.range(0) == 4 ? test::irma4_plan() : test::ring_plan(robot);
  SimulatorOptions options;
  options.winch.mode = mode;
  Simulator simulator(robot, options);
  const RestResult rest = simulator.reset(plan.setpoint_N[0]);
  if (!rest.found) state.SkipWithError(rest.reason.c_str());
  double simulated_s = 0.0;
  std::size_t next = 0;
  double velocity_m_s = 0.01;
  for (auto _ : state) {
    next = (next + 1) % plan.setpoint_N.size();
    if (mode == WinchMode::velocity) {
      velocity_m_s = -velocity_m_s;  // to and fro: no more cable is hauled in than was let out
      simulator.command_velocity(CableVector::Constant(robot.cable_count(), velocity_m_s));
    } else {
      simulator.command_tension(0.9 * plan.setpoint_N[0] + 0.1 * plan.setpoint_N[next]);
    }
    if (!simulator.advance(1.0)) state.SkipWithError(simulator.crashed().c_str());
    simulated_s += 1.0;
  }
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}
BENCHMARK(SimulatorStep)
    ->ArgNames({"cables", "mode"})
    ->ArgsProduct({{3, 4, 5}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond);

void WholeStartUp(benchmark::State& state) {
  const Robot robot = load_robot("irma4");
  const StartUpPlan plan = test::irma4_plan();
  StartUpRunOptions options;
  if (state.range(0) == 1) {
    for (const char* text : {"cable_sag=0.03", "pulley_friction=0.02", "cable_elasticity=60000"}) {
      options.simulator.effects.push_back(parse_injected_effect(text));
    }
  }
  double simulated_s = 0.0;
  for (auto _ : state) {
    const StartUpRun run = simulate_startup(robot, plan, options);
    if (run.state != StartUpState::done) state.SkipWithError(run.reason.c_str());
    simulated_s += run.log.time_s[run.log.sample_count() - 1];
  }
  state.counters["x_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}
BENCHMARK(WholeStartUp)->ArgName("effects")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
