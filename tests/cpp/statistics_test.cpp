// Chi-square far from its mean.
#include "cdprcal/statistics.hpp"

#include <gtest/gtest.h>

namespace cdprcal {
namespace {

TEST(ChiSquareSurvival, FarBelowTheMeanIsCertainWhateverTheFreedom) {
  // Boost 1.74 overflows here from 342 degrees of freedom on.
  for (const double freedom : {2.0, 100.0, 201.0, 342.0, 353.0, 576.0, 1e4, 1e6}) {
    for (const double share : {0.0, 1e-12, 1e-6, 1e-3, 0.09}) {
      const double survival = chi_square_survival(share * freedom, freedom);
      EXPECT_LE(survival, 1.0);
      EXPECT_GE(survival, freedom > 100.0 ? 1.0 - 1e-12 : 0.8) << freedom << " " << share;
    }
  }
}

TEST(ChiSquareSurvival, IsContinuousWhereTheTailIsCutOff) {
  for (const double freedom : {201.0, 353.0, 1e4}) {
    EXPECT_NEAR(chi_square_survival(0.0999 * freedom, freedom),
                chi_square_survival(0.1001 * freedom, freedom), 1e-12);
    EXPECT_NEAR(chi_square_survival(freedom, freedom), 0.5, 0.03);
  }
}

}  // namespace
}  // namespace cdprcal
