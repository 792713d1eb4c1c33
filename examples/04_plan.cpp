// Where to measure: a plan whose every transition was followed, and the accuracy to expect.
#include "cdprcal/planning/plan.hpp"

#include <cstdio>

#include "cdprcal/planning/plan_file.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

int main() {
  using namespace cdprcal;
  const Robot robot = load_robot("irma4");
  PlanOptions options;
  options.grid = {2, 2, 1};
  const PlanResult made = make_plan(robot, options);
  if (made.status != PlanStatus::planned) {
    std::puts(made.reason.c_str());
    return 1;
  }
  const Plan& plan = made.plan;
  std::printf("stops: %zu %d\n", plan.poses.size(), plan.measured_count());
  std::printf("duration_s: %.2f\n", plan.duration_s);
  for (const PlannedPose& stop : plan.poses) {
    std::printf("stop:");
    for (double x : stop.pose.position_m) std::printf(" %.3f", x);
    for (double tension_N : stop.tension_N) std::printf(" %.2f", tension_N);
    std::printf(" %.2f\n", stop.transition_s);
  }
  const Vector6& sigma = plan.predicted_standard_deviation;
  std::printf("sigma_mm: %.3f %.3f %.3f\n", 1e3 * sigma[0], 1e3 * sigma[1], 1e3 * sigma[2]);

  write_plan(plan, "plan.csv");  // what `cdprcal acquire` runs
}
