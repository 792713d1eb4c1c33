// Speed of the equilibria, one core. Targets: inverse problem 50,000 points/s warm, any cold NLopt
// solve under 1 ms.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "../cpp/equilibria/robots.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

/// Positions on a 0.02 m lattice inside the workspace, walked like the flood does.
std::array<Vector3, 1000> lattice(std::int64_t cables) {
  const Vector3 corner = cables == 3 ? Vector3(0.25, 0.25, 0.8) : Vector3(-0.1, -0.1, 0.8);
  std::array<Vector3, 1000> points;
  for (int k = 0; k < 1000; ++k) {
    const int i = k % 10;
    const int j = k / 10 % 10;
    const bool back = j % 2 == 1;  // there and back: each point is next to the one before
    points[k] = corner + 0.02 * Vector3(back ? 9 - i : i, k / 100 % 2 == 1 ? 9 - j : j, k / 100);
  }
  return points;
}

void inverse_warm(benchmark::State& state) {
  InverseOptions options;
  options.distribution = static_cast<TensionDistribution>(state.range(1));
  const InverseSolver solver(test::irma4_with_cables(static_cast<int>(state.range(0))), options);
  const auto points = lattice(state.range(0));
  Eigen::Quaterniond rotation = solver.solve(points[0]).rotation;
  const auto balanced = [](const InverseSolver::Point& point) {
    // Balanced is what is timed; a distribution may well miss the tension limits somewhere.
    return rank(point.status) < rank(EquilibriumStatus::not_found);
  };
  std::int64_t searched = 0, failed = 0;
  std::size_t k = 0;
  for (auto _ : state) {
    InverseSolver::Point point = solver.continue_from(points[k], rotation);
    if (!balanced(point)) {  // what Newton loses, NLopt finds
      ++searched;
      point = solver.solve(points[k]);
    }
    if (balanced(point)) {
      rotation = point.rotation;
    } else {
      ++failed;
    }
    k = (k + 1) % points.size();
    if (k == 0) {
      state.PauseTiming();
      rotation = solver.solve(points[0]).rotation;
      state.ResumeTiming();
    }
  }
  if (failed > 0) state.SkipWithError("a lattice point was not solved");
  state.counters["searched_share"] =
      static_cast<double>(searched) / static_cast<double>(state.iterations());
  state.SetItemsProcessed(state.iterations());
  state.SetLabel(to_string(options.distribution));
}
BENCHMARK(inverse_warm)->ArgNames({"cables", "distribution"})->ArgsProduct({{3, 4, 5}, {0, 1, 2}});

void inverse_cold(benchmark::State& state) {
  const InverseSolver solver(test::irma4_with_cables(static_cast<int>(state.range(0))), {});
  const auto points = lattice(state.range(0));
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver.solve(points[k]));
    k = (k + 37) % points.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(inverse_cold)->ArgName("cables")->Arg(3)->Arg(4)->Arg(5)->Unit(benchmark::kMicrosecond);

/// Cold at positions all over the pulleys' box: a third of them hold no equilibrium within the
/// limits, so all starts are tried.
void inverse_cold_anywhere(benchmark::State& state) {
  const InverseSolver solver(load_robot("irma4"), {});
  const Box box = workspace_box(solver.robot());
  std::array<Vector3, 1000> points;
  for (std::size_t k = 0; k < points.size(); ++k) {  // a low-discrepancy sequence (Roberts)
    const auto fraction = [k](double step) {
      return std::fmod(0.5 + step * static_cast<double>(k), 1.0);
    };
    const Vector3 f(fraction(0.8191725134), fraction(0.6710436067), fraction(0.5497004779));
    points[k] = box.lower_m + f.cwiseProduct(box.upper_m - box.lower_m);
  }
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver.solve(points[k]));
    k = (k + 1) % points.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(inverse_cold_anywhere)->Unit(benchmark::kMicrosecond);

/// Tension sets whose equilibria are inside the paper's box.
std::vector<InverseResult> equilibria(const Robot& robot) {
  std::vector<InverseResult> found;
  for (int k = 0; k < 8; ++k) {
    const Vector3 position((k & 1) != 0 ? 0.4 : -0.4, (k & 2) != 0 ? 0.4 : -0.4,
                           (k & 4) != 0 ? 1.2 : 0.6);
    found.push_back(inverse(robot, position));
  }
  return found;
}

enum class Given { tensions, lengths };

void direct(benchmark::State& state, Given given, bool warm) {
  const Robot robot = load_robot("irma4");
  const std::vector<InverseResult> targets = equilibria(robot);
  std::size_t k = 0;
  for (auto _ : state) {
    const InverseResult& target = targets[k];
    std::optional<Pose> start;
    if (warm) start = plus(target.pose, Vector6::Constant(0.02));
    const EquilibriumResult result = given == Given::tensions
                                         ? direct_from_tensions(robot, target.tension_N, start)
                                         : direct_from_lengths(robot, target.length_m, start);
    if (result.status != EquilibriumStatus::found) state.SkipWithError("not found");
    k = (k + 1) % targets.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(direct, tensions_cold, Given::tensions, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(direct, tensions_warm, Given::tensions, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(direct, lengths_cold, Given::lengths, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(direct, lengths_warm, Given::lengths, true)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace cdprcal
