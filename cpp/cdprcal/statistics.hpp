// The few distributions that tests and thresholds come from (Boost.Math behind one door).
#pragma once

#include <vector>

namespace cdprcal {

/// P(X ≥ chi_square) for X ~ χ²(degrees_of_freedom); NaN without degrees of freedom.
double chi_square_survival(double chi_square, double degrees_of_freedom);
/// The value that χ²(degrees_of_freedom) stays below with this probability.
double chi_square_quantile(double probability, double degrees_of_freedom);
/// P(X ≥ value) for a standard normal X.
double normal_survival(double value);
/// The value that a standard normal stays below with this probability.
double normal_quantile(double probability);
/// The value that Student's t(degrees_of_freedom) stays below with this probability.
double student_quantile(double probability, double degrees_of_freedom);

/// The middle one of some values, the upper of two; there must be one.
double median(std::vector<double> values);

}  // namespace cdprcal
