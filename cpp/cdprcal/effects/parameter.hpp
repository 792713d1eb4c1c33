// One parameter of an effect: how many numbers it has, and which they can be. No physics.
#pragma once

#include <string>
#include <vector>

namespace cdprcal {

/// How many numbers a parameter has: 1, n, 3, n·3 (cable by cable) or 2.
enum class ParameterShape { scalar, per_cable, vector3, per_cable_vector3, pair };
/// How they are nested: {} one number, {n} a list, {n, 3} a list of n lists of three.
std::vector<int> extents(ParameterShape shape, int cables);
int entries(ParameterShape shape, int cables);

/// What no machine's numbers go beyond. An estimate may: it says then that the effect is not there.
enum class ValueRange {
  any,
  positive,
  not_negative,
  above_minus_one,  ///< a relative error
  sign,             ///< 1 or −1
  order,            ///< the cables' numbers from 1, each once
  cable,            ///< one cable's number from 1
  euler_convention  ///< the number of an EulerConvention
};
/// What is wrong with finite values ("must be …"); empty when nothing is.
std::string range_problem(ValueRange range, const std::vector<double>& values, int cables);

struct ParameterLayout {
  std::string name;  ///< key in files, with the unit as suffix: "bias_N"
  ParameterShape shape;
  ValueRange range = ValueRange::any;
  bool optional = false;
};

}  // namespace cdprcal
