// The course of a transition: smooth, with zero speed and acceleration at both ends.
#pragma once

namespace cdprcal {

/// s of τ = τ_a + s (τ_b − τ_a) after a fraction x of the duration (paper footnote 2), its
/// derivatives by x, and the x at which s is reached. s and x in [0, 1].
struct FifthDegree {
  static constexpr double value(double x) { return x * x * x * (10.0 + x * (-15.0 + 6.0 * x)); }
  /// At most 15/8.
  static constexpr double velocity(double x) { return 30.0 * x * x * (1.0 - x) * (1.0 - x); }
  static constexpr double acceleration(double x) { return 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x); }
  static constexpr double inverse(double s) {
    if (s <= 0.0) return 0.0;
    if (s >= 1.0) return 1.0;
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (value(middle) < s ? low : high) = middle;
    }
    return high;
  }
};

/// FifthDegree::value, 0 before and 1 after.
constexpr double fifth_degree(double fraction) {
  return FifthDegree::value(fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction);
}

}  // namespace cdprcal
