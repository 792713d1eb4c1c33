// Speed and memory of the static workspace. Target: a grid of a million points in under 30 s on two
// cores and under 1 GB, alpha shape included.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/workspace/inscribed_box.hpp"
#include "cdprcal/workspace/workspace_shape.hpp"

namespace cdprcal {
namespace {

/// The step with about this many grid points in irma4's own box.
double step_for(const Robot& robot, std::int64_t points) {
  return std::cbrt(workspace_box(robot).volume_m3() / static_cast<double>(points));
}

double peak_memory_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

Workspace run(std::int64_t points, std::int64_t threads, const std::string& name = "irma4") {
  const Robot robot = load_robot(name);
  WorkspaceOptions options;
  options.step_m = step_for(robot, points);
  options.threads = static_cast<int>(threads);
  return compute_workspace(robot, options);
}

void workspace_flood(benchmark::State& state) {
  Workspace w;
  for (auto _ : state) w = run(state.range(0), state.range(1));
  state.counters["grid_points"] = static_cast<double>(w.grid.size());
  state.counters["tested"] = static_cast<double>(w.points_tested);
  state.counters["inside"] = static_cast<double>(w.points_inside());
  state.counters["peak_MB"] = peak_memory_MB();
}
BENCHMARK(workspace_flood)
    ->ArgNames({"points", "threads"})
    ->Args({100'000, 1})
    ->Args({100'000, 2})
    ->Args({1'000'000, 2})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// Eight cables: where one orientation is wrench-feasible. Target: 100,000 points a second and
/// core.
void workspace_of_eight(benchmark::State& state) {
  Workspace w;
  for (auto _ : state) w = run(state.range(0), 1, "posts8");
  state.counters["tested"] = static_cast<double>(w.points_tested);
  state.counters["inside"] = static_cast<double>(w.points_inside());
  state.counters["tested_per_s"] = benchmark::Counter(
      static_cast<double>(w.points_tested), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(workspace_of_eight)
    ->ArgName("points")
    ->Arg(100'000)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

void workspace_alpha_shape(benchmark::State& state) {
  const Workspace w = run(state.range(0), 2);
  AlphaShape shape;
  for (auto _ : state) shape = workspace_shape(w);
  if (!shape.watertight) state.SkipWithError("the mesh is not watertight");
  state.counters["volume_m3"] = shape.volume_m3;
  state.counters["faces"] = static_cast<double>(shape.mesh.faces.size());
  state.counters["peak_MB"] = peak_memory_MB();
}
BENCHMARK(workspace_alpha_shape)
    ->ArgName("points")
    ->Arg(10'000)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void workspace_inscribed_box(benchmark::State& state) {
  const Workspace w = run(state.range(0), 2);
  for (auto _ : state) benchmark::DoNotOptimize(largest_inscribed_box(w));
}
BENCHMARK(workspace_inscribed_box)
    ->ArgName("points")
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cdprcal
