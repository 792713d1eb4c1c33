// A log with the column of docs/extend/sensor.md's altimeter, in the library with that sensor.
#include <cmath>
#include <cstdio>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/readings/measurement.hpp"
#include "cdprcal/readings/noise.hpp"

using namespace cdprcal;

// These take long to compile, and nothing here calls them.
TensionModel cdprcal::tensions_left_inverse(const Robot&, const PlatformState&,
                                            const std::vector<WrenchRow>&) {
  return {};
}
CableVector cdprcal::corrected_tension_N(const EffectContext&, const ActiveEffects&,
                                         const CableVector&) {
  return {};
}

namespace {
int failures = 0;
void expect(bool fine, const char* what) {
  if (!fine) std::printf("wrong: %s\n", what), ++failures;
}
}  // namespace

int main() {
  const Log log = parse_log("time_s,length_1_m,height_m\n0,1,0.5\n1,1,0.7\n2,1,\n", "show");
  expect(log.height_m.cols() == 1 && log.height_m(1, 0) == 0.7, "column");
  expect(parse_log(format_log(log), "again").height_m.topRows(2) == log.height_m.topRows(2),
         "text");
  Measurement m = measurement_mean(log, {0, 3}, PoseKind::static_pose, 1);
  expect(std::abs(m.height_m - 0.6) < 1e-12, "mean");
  expect(readings_of(m, Channel::height)[0] == m.height_m, "reading of a channel");
  expect(specified_noise({})[Channel::height].pose == 5e-3, "σ");
  Robot robot;
  robot.cables.resize(1);
  robot.cables[0].pulley.position_m = {0.0, 0.0, 2.0};
  const auto at = [&](double z) {
    PoseEvaluation e;
    evaluate_pose(robot, m, {{0.1, 0.2, z}, Eigen::Quaterniond::Identity()}, StaticsModel::none, {},
                  {}, true, e);
    return e;
  };
  const PoseEvaluation e = at(0.5);
  expect(e.valid && e.height_m == 0.5, "modelled value");
  const double slope = (at(0.501).height_m - at(0.499).height_m) / 0.002;
  expect(std::abs(e.absolute_by_twist.height_m[2] - slope) < 1e-9, "derivative");
  static_assert(kMostAbsoluteReadings == 1 + kMaxCables + 3 + 3 + 3 + 1);
  expect(kChannelTable.back().of().field() == "height_m", "name");
  return failures;
}
