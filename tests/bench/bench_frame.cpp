// Speed of a frame found from whole lengths: belts4, its anchors known to decimetres. Target: under
// 20 ms from 100 poses.
#include <benchmark/benchmark.h>

#include <random>

#include "cdprcal/frame/frame.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

void frame_of_belts(benchmark::State& state) {
  const Robot truth = load_robot("belts4");
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> within(-0.3, 0.3);
  std::normal_distribution<double> noise(0.0, 1e-3), off(0.0, 0.1);
  Vector3 low = truth.cables[0].pulley.position_m, high = low;
  for (const Cable& cable : truth.cables) {
    low = low.cwiseMin(cable.pulley.position_m);
    high = high.cwiseMax(cable.pulley.position_m);
  }
  const auto poses = static_cast<Eigen::Index>(state.range(0));
  Log log;
  log.source = "drawn";
  log.time_s = Eigen::VectorXd::LinSpaced(poses, 0.0, 10.0 * static_cast<double>(poses - 1));
  log.direct_length_m.resize(poses, truth.cable_count());
  for (Eigen::Index i = 0; i < poses; ++i) {
    const Vector3 at =
        0.5 * (low + high) +
        Vector3(within(rng), within(rng), within(rng)).cwiseProduct(Vector3(high - low));
    for (int c = 0; c < truth.cable_count(); ++c) {
      const Vector3& pulley = truth.cables[static_cast<std::size_t>(c)].pulley.position_m;
      log.direct_length_m(i, c) = (at - pulley).norm() + noise(rng);
    }
  }
  Robot guess = truth;
  for (Cable& cable : guess.cables) {
    cable.pulley.position_m += Vector3(off(rng), 0.0, off(rng));
    cable.pulley.position_sigma_m = Vector3(0.3, 0.01, 0.3);
  }
  FrameResult found;
  for (auto _ : state) found = find_frame(guess, {log});
  if (found.status != FrameStatus::converged) state.SkipWithError(found.reason.c_str());
  state.counters["iterations"] = found.iterations;
}
BENCHMARK(frame_of_belts)->ArgName("poses")->Arg(30)->Arg(100)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace cdprcal
