// The plan file.
#include "cdprcal/planning/plan_file.hpp"
#include "target.hpp"

namespace {

using cdprcal::Plan;
using fuzz::require;

void check_pose(const cdprcal::Pose& pose) {
  require(pose.position_m.allFinite(), "position");
  require(std::abs(pose.rotation.norm() - 1.0) < 1e-5, "quaternion");
}

void check(const Plan& plan) {
  require(!plan.poses.empty(), "stops");
  check_pose(plan.start_pose);
  require(std::isfinite(plan.start_dwell_s) && plan.start_dwell_s >= 0.0, "start dwell");
  require((plan.start_tension_N.array() > 0.0).all() && plan.start_tension_N.allFinite(),
          "start tension");
  for (const cdprcal::PlannedPose& stop : plan.poses) {
    check_pose(stop.pose);
    require(stop.tension_N.size() == plan.start_tension_N.size(), "tensions");
    require((stop.tension_N.array() > 0.0).all() && stop.tension_N.allFinite(), "tension");
    require(std::isfinite(stop.transition_s) && stop.transition_s >= 0.0, "transition");
    require(std::isfinite(stop.dwell_s) && stop.dwell_s >= 0.0, "dwell");
    require(stop.natural_frequencies_hz.allFinite(), "natural frequencies");
    require(stop.constant_tension_frequencies_hz.allFinite(), "frequencies at constant tension");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string source = "plan.csv";
  Plan plan;
  const bool accepted =
      fuzz::accepts(source, [&] { plan = cdprcal::parse_plan(fuzz::text_of(data, size), source); });
  if (!accepted) return 0;
  check(plan);
  const std::string written = cdprcal::format_plan(plan);
  require(cdprcal::format_plan(cdprcal::parse_plan(written, source)) == written, "round trip");
  return 0;
}
