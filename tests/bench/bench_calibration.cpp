// Time of one calibration: trial-sized problems, and growth with the number of poses.
#include <benchmark/benchmark.h>

#include <sys/resource.h>
#include <numeric>

#include "../cpp/support/scenario.hpp"
#include "cdprcal/estimation/elimination.hpp"

namespace {

using namespace cdprcal;
using cdprcal::test::disturbed;
using cdprcal::test::irma4_setpoints;
using cdprcal::test::Scenario;
using cdprcal::test::scenario;

void configure(CalibrationProblem& problem, StaticsModel statics, bool full) {
  problem.statics = statics;
  problem.reference_attitude = problem.reference_statics = problem.reference_noise = full;
}

/// `poses` readings along the synthetic run, spread evenly; noise a twentieth of σ.
Scenario along_a_run(int poses, PoseKind kind) {
  const Robot robot = load_robot("irma4");
  const std::vector<CableVector> corners = irma4_setpoints();
  std::vector<CableVector> setpoints;
  const double legs = static_cast<double>(corners.size() - 1);
  for (int i = 0; i < poses; ++i) {
    const double at = legs * i / std::max(1, poses - 1);
    const auto leg = std::min(static_cast<std::size_t>(at), corners.size() - 2);
    const double f = at - static_cast<double>(leg);
    setpoints.push_back((1.0 - f) * corners[leg] + f * corners[leg + 1]);
  }
  return scenario(robot, setpoints, kind, 0.05, 3);
}

void run(benchmark::State& state, const Scenario& s, const std::vector<Pose>& guess) {
  int iterations = 0;
  double solve_time_s = 0.0;
  for (auto _ : state) {
    const CalibrationResult result = solve(s.problem, guess);
    solve_time_s += result.solve_time_s;
    if (result.status != CalibrationStatus::converged) state.SkipWithError(result.reason.c_str());
    iterations = result.iterations;
    benchmark::DoNotOptimize(result.cost);
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double poses = static_cast<double>(guess.size());
  state.counters["iterations"] = iterations;
  state.counters["us_per_pose"] = benchmark::Counter(
      poses * 1e-6, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  // Evaluations of all poses with derivatives, elimination and step included; covariance and the
  // judgement of the result are not.
  state.counters["us_per_pose_iteration"] =
      1e6 * solve_time_s / (static_cast<double>(state.iterations()) * poses * iterations);
  state.counters["peak_kB_per_pose"] = static_cast<double>(usage.ru_maxrss) / poses;
}

void TrialSizedPaper(benchmark::State& state) {  // 8 static poses, eqs 13–17, guess 0.1 m, 5° off
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.05, 3);
  configure(s.problem, StaticsModel::left_inverse, false);
  run(state, s, disturbed(s.truth, 0.1, 5.0 * kDegree, 4));
}
BENCHMARK(TrialSizedPaper)->Unit(benchmark::kMillisecond);

void TrialSizedFull(benchmark::State& state) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.05, 3);
  configure(s.problem, StaticsModel::wrench, true);
  run(state, s, disturbed(s.truth, 0.1, 5.0 * kDegree, 4));
}
BENCHMARK(TrialSizedFull)->Unit(benchmark::kMillisecond);

void KinematicPaper(benchmark::State& state) {
  Scenario s = along_a_run(static_cast<int>(state.range(0)), PoseKind::kinematic_pose);
  configure(s.problem, StaticsModel::none, false);
  run(state, s, disturbed(s.truth, 0.02, 2.0 * kDegree, 4));
}
BENCHMARK(KinematicPaper)
    ->Arg(8)
    ->Arg(128)
    ->Arg(100)
    ->Arg(1000)
    ->Arg(10000)
    ->Arg(100000)
    ->Unit(benchmark::kMillisecond);

void KinematicFull(benchmark::State& state) {
  Scenario s = along_a_run(static_cast<int>(state.range(0)), PoseKind::kinematic_pose);
  configure(s.problem, StaticsModel::none, true);
  run(state, s, disturbed(s.truth, 0.02, 2.0 * kDegree, 4));
}
BENCHMARK(KinematicFull)->Arg(128)->Arg(100000)->Unit(benchmark::kMillisecond);

void Elimination(benchmark::State& state) {  // 11 rows a pose, nine offsets: kinematics of 4 cables
  const auto poses = static_cast<std::size_t>(state.range(0));
  constexpr std::size_t kRows = 11, kOffsets = 9;
  RandomNormal random(1);
  const lanes::Buffer rows = lanes::buffer(kRow * kRows), by_offset = lanes::buffer(kOffsets);
  for (std::size_t i = 0; i < kRow * kRows * lanes::kLanes; ++i) rows[i] = random();
  std::fill_n(by_offset.get(), kOffsets * lanes::kLanes, -1.0);
  std::vector<int> slots(kRows);
  std::iota(slots.begin(), slots.end(), 0);
  const Eigen::VectorXd offset_step = Eigen::VectorXd::Ones(kOffsets);
  PoseElimination elimination(poses, kOffsets, 0, true);
  for (auto _ : state) {
    elimination.begin(1e-4, slots);
    for (std::size_t b = 0; b < lanes::batches(poses); ++b) {
      elimination.add(rows.get(), by_offset.get(), rows.get());
    }
    benchmark::DoNotOptimize(elimination.finish().cost);
    benchmark::DoNotOptimize(elimination.back_substitute(offset_step).damping);
  }
  state.counters["ns_per_pose"] = benchmark::Counter(
      static_cast<double>(poses) * 1e-9,
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(Elimination)->Arg(128)->Arg(1000)->Arg(100000)->Unit(benchmark::kMicrosecond);

}  // namespace
