#include "cdprcal/planning/plan_file.hpp"

#include <algorithm>
#include <array>

#include "cdprcal/error.hpp"
#include "cdprcal/planning/plan_columns.hpp"
#include "cdprcal/readings/log_columns.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {
namespace {

using detail::constant_tension_column;
using detail::kPoseColumns;
using detail::natural_column;
using detail::tension_column;

std::string list_text(const Eigen::Ref<const Eigen::VectorXd>& values) {
  std::string text;
  for (const double v : values) add_item(text, shortest(v));
  return text;
}

Eigen::Vector4d wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

void check(const Plan& plan) {
  if (plan.poses.empty()) throw InputError("plan: must have at least one stop");
  const std::string& name = plan.robot_name;
  const auto control = [](unsigned char c) { return c < ' '; };
  if (name.empty() || name.front() == ' ' || name.back() == ' ' ||
      std::any_of(name.begin(), name.end(), control)) {
    throw InputError(
        "plan: the robot's name cannot be written: it must not be empty, begin or end with a "
        "space, or hold control characters");
  }
  const PlannedPose& first = plan.poses.front();
  for (const PlannedPose& stop : plan.poses) {
    if (stop.tension_N.size() != plan.start_tension_N.size() ||
        stop.natural_frequencies_hz.size() != first.natural_frequencies_hz.size() ||
        stop.constant_tension_frequencies_hz.size() !=
            first.constant_tension_frequencies_hz.size()) {
      throw InputError(
          "plan: the stops' tensions or frequencies differ in number; give each stop as many");
    }
  }
}

}  // namespace

std::string format_plan(const Plan& plan) {
  check(plan);
  std::string text =
      "# cdprcal plan\n# robot: " + plan.robot_name +
      "\n# start_tension_N: " + list_text(plan.start_tension_N) +
      "\n# start_position_m: " + list_text(plan.start_pose.position_m) +
      "\n# start_quaternion_wxyz: " + list_text(wxyz(plan.start_pose.rotation)) +
      "\n# start_dwell_s: " + shortest(plan.start_dwell_s) +
      "\n# stops: " + std::to_string(plan.poses.size()) +
      "\n# predicted_standard_deviation_m_rad: " + list_text(plan.predicted_standard_deviation) +
      "\npurpose";
  const PlannedPose& first = plan.poses.front();
  for (const char* name : kPoseColumns) text += std::string(",") + name;
  for (Eigen::Index i = 0; i < first.tension_N.size(); ++i) text += "," + tension_column(i);
  text += ",transition_s,dwell_s";
  for (Eigen::Index i = 0; i < first.natural_frequencies_hz.size(); ++i) {
    text += "," + natural_column(i);
  }
  for (Eigen::Index i = 0; i < first.constant_tension_frequencies_hz.size(); ++i) {
    text += "," + constant_tension_column(i);
  }
  for (const PlannedPose& stop : plan.poses) {
    text += stop.measured ? "\nmeasure" : "\nvia";
    const auto add = [&text](const auto& values) {
      for (const double v : values) text += "," + shortest(v);
    };
    add(stop.pose.position_m);
    add(wxyz(stop.pose.rotation));
    add(stop.tension_N);
    add(Eigen::Vector2d(stop.transition_s, stop.dwell_s));
    add(stop.natural_frequencies_hz);
    add(stop.constant_tension_frequencies_hz);
  }
  return text + "\n";
}

void write_plan(const Plan& plan, const std::string& path) {
  write_text_file(path, format_plan(plan));  // complete before the file is touched
}

Plan read_plan(const std::string& path) {
  return parse_plan(read_text_file(path, kMostPlanBytes + 1), path);
}

}  // namespace cdprcal
