// Time of the diagnosis: the whole catalogue scanned once, and a diagnosis from log to findings.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace {

using namespace cdprcal;

/// A start-up of irma4 through `poses` set-points (8, 27, or 27 visited again and again), noise a
/// fifth of eq. 18; `bias_N` on the first load cell.
Log run_of(int poses, double bias_N) {
  const Robot robot = load_robot("irma4");
  const std::vector<CableVector> grid =
      poses == 8 ? default_setpoints(robot, 2, 2, 2) : default_setpoints(robot, 3, 3, 3);
  std::vector<CableVector> setpoints;
  const auto count = static_cast<int>(grid.size());
  for (int i = 0; i < poses; ++i) {  // to and fro
    const int turn = i % (2 * count - 2);
    setpoints.push_back(grid[static_cast<std::size_t>(turn < count ? turn : 2 * count - 2 - turn)]);
  }
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2);
  options.dwell_s = options.move_s = 5.0;
  Log log = synthetic_log(robot, setpoints, options).log;
  log.tension_N.col(0).array() += bias_N;
  return log;
}

void memory(benchmark::State& state) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_MB"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// One linearisation, one projection, evidence and p-values for all effects.
void ScanWholeCatalogue(benchmark::State& state) {
  const Diagnosis found =
      diagnose(load_robot("irma4"), {run_of(static_cast<int>(state.range(0)), 0.0)});
  for (auto _ : state) {
    benchmark::DoNotOptimize(scan(found.baseline, effect_catalogue()).front().log_evidence);
  }
  memory(state);
}
BENCHMARK(ScanWholeCatalogue)->Arg(8)->Arg(27)->Arg(128)->Unit(benchmark::kMillisecond);

void DiagnoseCleanLog(benchmark::State& state) {
  const Robot robot = load_robot("irma4");
  const std::vector<Log> logs{run_of(static_cast<int>(state.range(0)), 0.0)};
  for (auto _ : state) {
    const Diagnosis found = diagnose(robot, logs);
    if (!found.effects.empty()) state.SkipWithError("a clean log was accused");
  }
  memory(state);
}
BENCHMARK(DiagnoseCleanLog)->Arg(8)->Arg(27)->Arg(128)->Unit(benchmark::kMillisecond);

void DiagnoseOneEffect(benchmark::State& state) {
  const Robot robot = load_robot("irma4");
  const std::vector<Log> logs{run_of(static_cast<int>(state.range(0)), 10.0)};
  for (auto _ : state) {
    const Diagnosis found = diagnose(robot, logs);
    if (found.effects.size() != 1) state.SkipWithError("not one effect named");
  }
  memory(state);
}
BENCHMARK(DiagnoseOneEffect)->Arg(8)->Arg(27)->Arg(128)->Unit(benchmark::kMillisecond);

}  // namespace
