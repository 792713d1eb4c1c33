#include "cdprcal/effects/parameter.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace cdprcal {

std::vector<int> extents(ParameterShape shape, int cables) {
  switch (shape) {
    case ParameterShape::scalar:
      return {};
    case ParameterShape::per_cable:
      return {cables};
    case ParameterShape::vector3:
      return {3};
    case ParameterShape::per_cable_vector3:
      return {cables, 3};
    case ParameterShape::pair:
      return {2};
  }
  return {};
}

int entries(ParameterShape shape, int cables) {
  int count = 1;
  for (const int extent : extents(shape, cables)) count *= extent;
  return count;
}

std::string range_problem(ValueRange range, const std::vector<double>& values, int cables) {
  const auto unless_all = [&](auto fine, const std::string& problem) {
    return std::all_of(values.begin(), values.end(), fine) ? "" : problem;
  };
  const auto whole = [](double lowest, double highest) {
    return [=](double v) { return v >= lowest && v <= highest && v == std::floor(v); };
  };
  switch (range) {
    case ValueRange::any:
      return "";
    case ValueRange::positive:
      return unless_all([](double v) { return v > 0.0; }, "must be positive");
    case ValueRange::not_negative:
      return unless_all([](double v) { return v >= 0.0; }, "must not be negative");
    case ValueRange::above_minus_one:
      return unless_all([](double v) { return v > -1.0; }, "must be above -1");
    case ValueRange::sign:
      return unless_all([](double v) { return std::abs(v) == 1.0; }, "must be 1 or -1 each");
    case ValueRange::order: {
      std::vector<double> wanted(values.size());
      std::iota(wanted.begin(), wanted.end(), 1.0);
      return std::is_permutation(values.begin(), values.end(), wanted.begin())
                 ? ""
                 : "must hold every cable once, counted from 1";
    }
    case ValueRange::cable:
      return unless_all(whole(1.0, cables),
                        "must be the number of a cable, 1 to " + std::to_string(cables));
    case ValueRange::euler_convention:
      return unless_all(whole(0.0, 5.0), "must be an order such as ZYX, or its number 0 to 5");
  }
  return "";
}

}  // namespace cdprcal
