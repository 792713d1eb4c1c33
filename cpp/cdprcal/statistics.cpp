#include "cdprcal/statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <map>
#include <utility>

#include "cdprcal/types.hpp"

namespace cdprcal {

double chi_square_survival(double chi_square, double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0.0) || !(chi_square >= 0.0)) return kNaN;
  // Not in long double, which is ten times as slow for digits that nobody reads.
  using InDouble = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  const double shape = 0.5 * degrees_of_freedom;
  // Boost (1.74) overflows far below the mean. Less than 1e-60 lies there: the Chernoff bound
  // (z e^(1 - z))^shape of a tenth of the mean.
  if (shape > 100.0 && chi_square < 0.1 * degrees_of_freedom) return 1.0;
  return boost::math::gamma_q(shape, 0.5 * chi_square, InDouble());
}

double chi_square_quantile(double probability, double degrees_of_freedom) {
  // Sliding windows ask for the same few thresholds thousands of times.
  constexpr std::size_t kMost = 4096;
  thread_local std::map<std::pair<double, double>, double> known;
  if (known.size() >= kMost) known.clear();
  const auto [entry, is_new] = known.try_emplace({probability, degrees_of_freedom}, kNaN);
  if (is_new) {
    entry->second = 2.0 * boost::math::gamma_p_inv(0.5 * degrees_of_freedom, probability);
  }
  return entry->second;
}

double normal_survival(double value) { return 0.5 * std::erfc(value / std::sqrt(2.0)); }

double normal_quantile(double probability) {
  return -std::sqrt(2.0) * boost::math::erfc_inv(2.0 * probability);
}

double student_quantile(double probability, double degrees_of_freedom) {
  return boost::math::quantile(boost::math::students_t(degrees_of_freedom), probability);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace cdprcal
