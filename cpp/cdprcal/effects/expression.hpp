// Private to effects/: a formula written as text, made ready to be evaluated with derivatives.
#pragma once

#include <ceres/jet.h>

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace cdprcal {

/// Derivatives that come with a value: by the six components of a twist, and by the parameters.
inline constexpr int kMostParameters = 6;
inline constexpr int kSlopes = 6 + kMostParameters;
using Slope = ceres::Jet<double, kSlopes>;

/// What is wrong with a formula, and at which of its characters, from 0.
struct ExpressionError : std::runtime_error {
  ExpressionError(const std::string& problem, std::size_t place)
      : std::runtime_error(problem), offset(place) {}
  std::size_t offset;
};

/// + - * / ^, parentheses, numbers, pi, names and the functions of function_names().
class Expression {
 public:
  /// `names` are what it may name besides; evaluate takes their values in this order. Throws
  /// ExpressionError.
  Expression(const std::string& text, const std::vector<std::string>& names);

  [[nodiscard]] double operator()(std::span<const double> values) const;
  [[nodiscard]] Slope operator()(std::span<const Slope> values) const;

  /// Where the name of that index first stands in the text; npos where it does not.
  [[nodiscard]] std::size_t place_of(std::size_t name) const;
  static std::vector<std::string> function_names();

 private:
  friend struct ExpressionWriter;
  /// One step of a stack machine.
  struct Step {
    enum class Kind { constant, name, function } kind;
    std::size_t index = 0;  ///< of the name, or the function
    double constant = 0.0;
    std::size_t place = 0;  ///< in the text
  };
  template <class T>
  T run(std::span<const T> values) const;

  std::vector<Step> steps_;
};

}  // namespace cdprcal
