// The robot file, its effects among it.
#include "cdprcal/robot_file/robot_file.hpp"

#include "target.hpp"

namespace {

using cdprcal::Robot;
using fuzz::require;

void check(const Robot& robot) {
  const auto n = robot.cables.size();
  require(n >= 1 && n <= static_cast<std::size_t>(cdprcal::kMaxCables), "number of cables");
  require(std::isfinite(robot.weight_N()) && robot.weight_N() > 0.0, "weight");
  require(robot.platform.centre_of_mass_m.allFinite(), "centre of mass");
  require(robot.platform.inertia_kg_m2.allFinite(), "inertia");
  for (const cdprcal::Cable& cable : robot.cables) {
    require(std::isfinite(cable.pulley.radius_m), "radius");
    require(cable.pulley.position_m.allFinite() && cable.platform_anchor_m.allFinite(), "anchors");
    require(cable.pulley.axes_world.isUnitary(1e-9), "axes");
  }
  require(robot.tension_min_N >= 0.0 && robot.tension_min_N < robot.tension_max_N &&
              std::isfinite(robot.tension_max_N),
          "tension limits");
  const cdprcal::SensorSigma& sigma = robot.sigma;
  for (const double s : {sigma.length_m, sigma.swivel_rad, sigma.attitude_rad, sigma.tension_N,
                         sigma.absolute_yaw_rad, sigma.direct_length_m, sigma.position_m,
                         sigma.wrench_force_N, sigma.wrench_moment_Nm}) {
    require(std::isfinite(s) && s > 0.0, "sigma");
  }
  for (const cdprcal::AppliedEffect& effect : robot.effects) {
    for (const auto& parameter : effect.parameters) {
      for (const double value : parameter.values) require(std::isfinite(value), "an effect");
    }
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string source = "robot.yaml";
  Robot robot;
  const bool accepted = fuzz::accepts(
      source, [&] { robot = cdprcal::parse_robot(fuzz::text_of(data, size), source); });
  if (!accepted) return 0;
  check(robot);
  // What was accepted can be written, and reads back as it was.
  const std::string written = cdprcal::to_yaml(robot);
  require(cdprcal::to_yaml(cdprcal::parse_robot(written, source)) == written, "round trip");
  return 0;
}
