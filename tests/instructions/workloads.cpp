// Small fixed workloads whose instructions are counted (tools/instructions): a time depends on the
// machine and on who else uses it, a count hardly does.
//
//   cdprcal_workloads              the names
//   cdprcal_workloads NAME         runs one
//   cdprcal_workloads --toolchain  what the counts depend on, as JSON
#include <ceres/version.h>
#include <gnu/libc-version.h>
#include <nlopt.h>

#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>

#include "../cpp/support/scenario.hpp"
#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/readings/log.hpp"
#include "cdprcal/workspace/workspace.hpp"

/// Only what happens in here is counted: callgrind is told its name (--toggle-collect).
extern "C" __attribute__((noinline)) void cdprcal_measured(const std::function<void()>& work) {
  work();
}

namespace cdprcal {
namespace {

using test::Scenario;

/// Work whose set-up is done. It throws when the result is not what it should be: fast and wrong
/// does not count.
using Work = std::function<void()>;

void require(bool good, const char* what) {
  if (!good) throw std::runtime_error(what);
}

/// `poses` rests of irma4 along the lines between its set-points; noise a twentieth of σ.
Work calibration(int poses, StaticsModel statics, bool as_in_the_paper = false) {
  const std::vector<CableVector> corners = test::irma4_setpoints();
  std::vector<CableVector> setpoints;
  for (int i = 0; i < poses; ++i) {
    const double at = static_cast<double>(corners.size() - 1) * i / (poses - 1);
    const auto leg = std::min(static_cast<std::size_t>(at), corners.size() - 2);
    const double f = at - static_cast<double>(leg);
    setpoints.push_back((1.0 - f) * corners[leg] + f * corners[leg + 1]);
  }
  const PoseKind kind =
      statics == StaticsModel::none ? PoseKind::kinematic_pose : PoseKind::static_pose;
  Scenario s = test::scenario(load_robot("irma4"), setpoints, kind, 0.05, 3);
  s.problem.statics = statics;
  const bool full = !as_in_the_paper;
  s.problem.reference_attitude = s.problem.reference_statics = s.problem.reference_noise = full;
  const std::vector<Pose> guess = test::disturbed(s.truth, 0.02, 0.03, 4);
  return [s, guess] {
    const CalibrationResult result = solve(s.problem, guess);
    require(result.status == CalibrationStatus::converged, "did not converge");
    std::printf("poses %zu iterations %d\n", guess.size(), result.iterations);  // for tools/flops
  };
}

Log start_up(int grid, double dwell_s, double bias_N) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2);
  options.dwell_s = options.move_s = dwell_s;
  Log log = synthetic_log(robot, default_setpoints(robot, grid, grid, grid), options).log;
  log.tension_N.col(0).array() += bias_N;
  return log;
}

/// One effect to find, a load cell 10 N off: scan, refits, held-out test, and the scan of the rest.
Work diagnosis() {
  const std::vector<Log> logs{start_up(3, 5.0, 10.0)};
  return [robot = load_robot("irma4"), logs] {
    require(diagnose(robot, logs).effects.size() == 1, "not one effect named");
  };
}

Work workspace() {
  const Robot robot = load_robot("irma4");
  WorkspaceOptions options;
  options.step_m = std::cbrt(workspace_box(robot).volume_m3() / 1000.0);
  options.threads = 1;
  return [robot, options] {
    require(compute_workspace(robot, options).points_inside() > 300, "workspace too small");
  };
}

Work log_import() {
  Log log = start_up(2, 60.0, 0.0);
  const std::string text = format_log(log);
  return [text, samples = log.sample_count()] {
    require(parse_log(text, "log").sample_count() == samples, "samples were lost");
  };
}

Work inverse_equilibria() {
  const Robot robot = load_robot("irma4");
  std::vector<Vector3> positions;
  for (int i = 0; i < 64; ++i) {
    positions.emplace_back(0.1 * (i % 4) - 0.15, 0.1 * (i / 4 % 4) - 0.15, 0.7 + 0.1 * (i / 16));
  }
  return [robot, positions] {
    for (const Vector3& p : positions) {
      require(inverse(robot, p).status == EquilibriumStatus::found, "no equilibrium");
    }
  };
}

Work direct_equilibria() {
  return [robot = load_robot("irma4"), setpoints = test::irma4_setpoints()] {
    for (const CableVector& tension_N : setpoints) {
      const EquilibriumResult rest = direct_from_tensions(robot, tension_N);
      require(rest.status == EquilibriumStatus::found, "no equilibrium");
      const EquilibriumResult again = direct_from_lengths(robot, rest.length_m, rest.pose);
      require(again.status == EquilibriumStatus::found, "no equilibrium at these lengths");
    }
  };
}

struct Workload {
  const char* name;
  Work (*prepare)();
};

constexpr Workload kWorkloads[] = {
    {"solve_8_poses_paper", [] { return calibration(8, StaticsModel::none, true); }},
    {"solve_27_poses", [] { return calibration(27, StaticsModel::none); }},
    {"solve_27_poses_tensions", [] { return calibration(27, StaticsModel::wrench); }},
    {"solve_128_poses", [] { return calibration(128, StaticsModel::none); }},
    {"solve_128_poses_tensions", [] { return calibration(128, StaticsModel::wrench); }},
    {"diagnose_27_poses", &diagnosis},
    {"workspace_1000_points", &workspace},
    {"log_import", &log_import},
    {"inverse_equilibria", &inverse_equilibria},
    {"direct_equilibria", &direct_equilibria},
};

/// What of the processor callgrind knows of and the library (and libm) asks for.
const char* vector_instructions() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? "AVX2" : "SSE2";
#else
  return "none";
#endif
}

void print_toolchain() {
  int major = 0, minor = 0, patch = 0;
  nlopt_version(&major, &minor, &patch);
  std::printf(
      "{\"compiler\": \"%s\", \"build\": \"%s\", \"eigen\": \"%d.%d.%d\", \"ceres\": \"%s\", "
      "\"nlopt\": \"%d.%d.%d\", \"libc\": \"%s\", \"vectors\": \"%s\"}\n",
      CDPRCAL_COMPILER, CDPRCAL_BUILD, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
      EIGEN_MINOR_VERSION, CERES_VERSION_STRING, major, minor, patch, gnu_get_libc_version(),
      vector_instructions());
}

}  // namespace
}  // namespace cdprcal

int main(int count, char** arguments) {
  using cdprcal::kWorkloads;
  const std::string wanted = count > 1 ? arguments[1] : "";
  if (wanted == "--toolchain") {
    cdprcal::print_toolchain();
    return 0;
  }
  for (const auto& [name, prepare] : kWorkloads) {
    if (wanted.empty()) {
      std::puts(name);
    } else if (wanted == name) {
      try {
        cdprcal_measured(prepare());
      } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", name, error.what());
        return 1;
      }
      return 0;
    }
  }
  if (wanted.empty()) return 0;
  std::fprintf(stderr, "%s: no such workload; without arguments their names are printed\n",
               wanted.c_str());
  return 2;
}
