// What one core of this machine can do at most: double-precision arithmetic and memory traffic.
// How far the solver is from it stands in docs/performance.md.
#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <vector>

namespace {

/// Fused multiply-adds that do not wait for one another: `chains` vectors of `lanes` doubles. A
/// core starts one or two of them a cycle, each takes four cycles or five, so ten chains suffice.
constexpr int kChains = 12;
constexpr int kSteps = 4096;

template <int lanes>
struct Vector {
  typedef double Type __attribute__((vector_size(lanes * sizeof(double))));
};

/// a ← a·b + c, kChains·kSteps times; returns something that depends on all of it.
template <int lanes>
[[gnu::always_inline]] inline double multiply_add() {
  using V = typename Vector<lanes>::Type;
  std::array<V, kChains> a;
  for (int i = 0; i < kChains; ++i) a[static_cast<std::size_t>(i)] = V{} + 1.0 + 1e-3 * i;
  V b = V{} + 0.999999, c = V{} + 1e-6;
  benchmark::DoNotOptimize(b);
  benchmark::DoNotOptimize(c);
  for (int step = 0; step < kSteps; ++step) {
#pragma GCC unroll 12
    for (int i = 0; i < kChains; ++i) {
      a[static_cast<std::size_t>(i)] = a[static_cast<std::size_t>(i)] * b + c;
    }
  }
  V sum = V{};
  for (const V& one : a) sum += one;
  double total = 0.0;
  for (int lane = 0; lane < lanes; ++lane) total += sum[lane];
  return total;
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::target("fma,avx2"), gnu::noinline]] double fma_avx2() { return multiply_add<4>(); }
[[gnu::target("avx512f,fma"), gnu::noinline]] double fma_avx512() { return multiply_add<8>(); }
bool has_avx2() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
bool has_avx512() { return __builtin_cpu_supports("avx512f"); }
#else
double fma_avx2() { return 0.0; }
double fma_avx512() { return 0.0; }
bool has_avx2() { return false; }
bool has_avx512() { return false; }
#endif
/// As the library itself is compiled: SSE2 on x86-64, multiplication and addition apart.
[[gnu::noinline]] double as_compiled() { return multiply_add<2>(); }

void run(benchmark::State& state, double (*work)(), bool there, int lanes) {
  if (!there) {
    state.SkipWithError("this processor has no such instructions");
    return;
  }
  for (auto _ : state) benchmark::DoNotOptimize(work());
  const double flops = 2.0 * lanes * kChains * kSteps;
  state.counters["GFLOP/s"] =
      benchmark::Counter(flops * 1e-9, benchmark::Counter::kIsIterationInvariantRate);
}
void PeakArithmetic_as_compiled(benchmark::State& state) { run(state, &as_compiled, true, 2); }
void PeakArithmetic_AVX2(benchmark::State& state) { run(state, &fma_avx2, has_avx2(), 4); }
void PeakArithmetic_AVX512(benchmark::State& state) { run(state, &fma_avx512, has_avx512(), 8); }
BENCHMARK(PeakArithmetic_as_compiled);
BENCHMARK(PeakArithmetic_AVX2);
BENCHMARK(PeakArithmetic_AVX512);

/// a ← b + s·c over arrays of `kB` kB each: 24 bytes an element.
void Triad(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0)) * 1024 / sizeof(double);
  std::vector<double> a(count), b(count, 1.0), c(count, 2.0);
  double s = 0.5;
  for (auto _ : state) {
    benchmark::DoNotOptimize(s);
    for (std::size_t i = 0; i < count; ++i) a[i] = b[i] + s * c[i];
    benchmark::ClobberMemory();
  }
  state.counters["GB/s"] = benchmark::Counter(24e-9 * static_cast<double>(count),
                                              benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(Triad)->ArgName("kB")->Arg(8)->Arg(200)->Arg(65536);

}  // namespace
