#include "cdprcal/model/yardstick.hpp"

#include <algorithm>
#include <array>

namespace cdprcal {
namespace {

// irma4's (paper Table I)
constexpr double kMass_kg = 12.992, kWeight_N = 12.992 * 9.81, kFrame_m = 3.1428110029080654,
                 kPlatform_m = 0.141063815346105, kPulley_m = 0.03;

double largest_radius_m(const Robot& robot) {
  double largest = 0.0;
  for (const Cable& cable : robot.cables) largest = std::max(largest, cable.pulley.radius_m);
  return largest;
}

struct Row {
  const char* in_words;
  double (*times_reference)(const Robot&);
};

double mass(const Robot& robot) { return robot.platform.mass_kg / kMass_kg; }
double weight(const Robot& robot) { return robot.weight_N() / kWeight_N; }
double frame(const Robot& robot) { return robot_size_m(robot) / kFrame_m; }

// clang-format off
const std::array<Row, 10> kTable{{
    {"", [](const Robot&) { return 1.0; }},
    {"the mass of the platform", &mass},
    {"the weight of the platform", &weight},
    {"the size of the frame", &frame},
    {"the arms of the platform's anchors", [](const Robot& r) { return characteristic_length_m(r) / kPlatform_m; }},
    {"the radius of the pulleys", [](const Robot& r) {
       const double radius_m = largest_radius_m(r);
       return radius_m > 0.0 ? radius_m / kPulley_m : frame(r);
     }},
    {"the mass of the platform by the size of the frame", [](const Robot& r) { return mass(r) / frame(r); }},
    {"the weight of the platform", [](const Robot& r) { return 1.0 / weight(r); }},
    {"the inverse of the size of the frame", [](const Robot& r) { return 1.0 / frame(r); }},
    {"the weight of the platform by the size of the frame", [](const Robot& r) { return weight(r) / frame(r); }},
}};
// clang-format on
static_assert(static_cast<std::size_t>(Yardstick::stiffness) + 1 ==
              std::tuple_size_v<decltype(kTable)>);

const Row& row_of(Yardstick yardstick) { return kTable[static_cast<std::size_t>(yardstick)]; }

}  // namespace

const char* in_words(Yardstick yardstick) { return row_of(yardstick).in_words; }

double times_reference(Yardstick yardstick, const Robot& robot) {
  return row_of(yardstick).times_reference(robot);
}

}  // namespace cdprcal
