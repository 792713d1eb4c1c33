// The one numeric check of derivatives of the whole test suite.
//
//   const auto numeric = numeric_pose_jacobian(
//       [&](const Pose& p) { return platform_state(robot, p).length_m(); }, pose);
//   EXPECT_TRUE(jacobian_matches(length_jacobian(state), numeric));
//
// Central differences at steps h, h/2, h/4 … are extrapolated to h → 0 (Richardson's tableau, the
// entry of least estimated error, after Ridders 1982). That gives 10 to 12 digits for a smooth
// function, and an error estimate. A numeric derivative that does not know itself to the tolerance
// asked for fails the check instead of widening it, so a check cannot pass by being vague.
//
// Angles: differentiate wrap_angle(angle − angle_at_the_point), since an angle itself may jump.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <sstream>

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal::test {

/// A numeric derivative: rows are outputs, columns inputs.
struct NumericJacobian {
  Eigen::MatrixXd value;
  Eigen::MatrixXd error;      ///< estimated, entry by entry
  Eigen::VectorXd magnitude;  ///< |f| at the point: what rounding errors are relative to
};

/// Extrapolates `difference(h)` (even in h, Eigen vector) to h → 0; returns value and error.
template <class Difference>
std::pair<Eigen::VectorXd, Eigen::VectorXd> extrapolate(const Difference& difference, double step) {
  constexpr int kLevels = 7;
  std::array<std::array<Eigen::VectorXd, kLevels>, kLevels> table;
  Eigen::VectorXd best, error;
  for (int i = 0; i < kLevels; ++i, step *= 0.5) {
    table[i][0] = difference(step);
    if (i == 0) {
      best = table[0][0];
      error = Eigen::VectorXd::Constant(best.size(), std::numeric_limits<double>::infinity());
      continue;
    }
    double factor = 1.0;
    for (int j = 1; j <= i; ++j) {
      factor *= 4.0;
      table[i][j] = (factor * table[i][j - 1] - table[i - 1][j - 1]) / (factor - 1.0);
      for (Eigen::Index k = 0; k < best.size(); ++k) {
        const double e = std::max(std::abs(table[i][j][k] - table[i][j - 1][k]),
                                  std::abs(table[i][j][k] - table[i - 1][j - 1][k]));
        if (!(e < error[k])) continue;
        error[k] = e;
        best[k] = table[i][j][k];
      }
    }
  }
  return {best, error};
}

/// Derivative at 0 of f(δ), δ of `dimension` numbers. f returns a double or an Eigen vector and
/// must be smooth within `step` of 0.
template <class Function>
NumericJacobian numeric_tangent_jacobian(const Function& f, Eigen::Index dimension,
                                         double step = 4e-3) {
  const auto call = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
    if constexpr (std::is_convertible_v<decltype(f(delta)), double>) {
      return Eigen::VectorXd::Constant(1, f(delta));
    } else {
      return f(delta);
    }
  };
  NumericJacobian result;
  result.magnitude = call(Eigen::VectorXd::Zero(dimension)).cwiseAbs();
  result.value.resize(result.magnitude.size(), dimension);
  result.error.resize(result.magnitude.size(), dimension);
  for (Eigen::Index column = 0; column < dimension; ++column) {
    const auto difference = [&](double h) -> Eigen::VectorXd {
      const Eigen::VectorXd delta = h * Eigen::VectorXd::Unit(dimension, column);
      return (call(delta) - call(-delta)) / (2.0 * h);
    };
    const auto [value, error] = extrapolate(difference, step);
    result.value.col(column) = value;
    result.error.col(column) = error;
  }
  return result;
}

/// ∂f/∂x of f(x), x a plain vector.
template <class Function>
NumericJacobian numeric_jacobian(const Function& f, const Eigen::VectorXd& x, double step = 4e-3) {
  return numeric_tangent_jacobian([&](const Eigen::VectorXd& delta) { return f(x + delta); },
                                  x.size(), step);
}

/// ∂f/∂δ of f(pose ⊕ δ): six columns, world-frame twist (δp, δθ).
template <class Function>
NumericJacobian numeric_pose_jacobian(const Function& f, const Pose& pose, double step = 4e-3) {
  return numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& delta) { return f(plus(pose, Vector6(delta))); }, 6, step);
}

/// Hessian at 0 of the scalar f(δ), from second differences along eᵢ ± eⱼ. Good to about 1e-7.
template <class Function>
NumericJacobian numeric_tangent_hessian(const Function& f, Eigen::Index dimension,
                                        double step = 4e-2) {
  const double here = f(Eigen::VectorXd(Eigen::VectorXd::Zero(dimension)));
  const auto second = [&](const Eigen::VectorXd& direction) {
    return extrapolate(
        [&](double h) -> Eigen::VectorXd {
          const Eigen::VectorXd delta = h * direction;
          return Eigen::VectorXd::Constant(
              1, (f(delta) - 2.0 * here + f(Eigen::VectorXd(-delta))) / (h * h));
        },
        step);
  };
  NumericJacobian result;
  result.value.resize(dimension, dimension);
  result.error.resize(dimension, dimension);
  result.magnitude = Eigen::VectorXd::Constant(dimension, std::abs(here));
  for (Eigen::Index i = 0; i < dimension; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::VectorXd a = Eigen::VectorXd::Unit(dimension, i);
      const Eigen::VectorXd b = Eigen::VectorXd::Unit(dimension, j);
      const auto sum = second(a + b);
      const auto difference = second(a - b);  // 0 on the diagonal: f'' along 2a over 4 is f''(a)
      result.value(i, j) = result.value(j, i) = 0.25 * (sum.first[0] - difference.first[0]);
      result.error(i, j) = result.error(j, i) = 0.25 * (sum.second[0] + difference.second[0]);
    }
  }
  return result;
}

/// Hessian of f(pose ⊕ δ) at δ = 0, 6×6.
template <class Function>
NumericJacobian numeric_pose_hessian(const Function& f, const Pose& pose, double step = 4e-2) {
  return numeric_tangent_hessian(
      [&](const Eigen::VectorXd& delta) { return f(plus(pose, Vector6(delta))); }, 6, step);
}

/// |analytic − numeric| ≤ tolerance · scale, entry by entry; the scale of a row is the largest of
/// its derivatives and of |f| itself (per metre or radian).
template <class Derived>
::testing::AssertionResult jacobian_matches(const Eigen::MatrixBase<Derived>& analytic,
                                            const NumericJacobian& numeric,
                                            double tolerance = 1e-8) {
  if (analytic.rows() != numeric.value.rows() || analytic.cols() != numeric.value.cols()) {
    return ::testing::AssertionFailure()
           << "analytic is " << analytic.rows() << "x" << analytic.cols() << ", numeric "
           << numeric.value.rows() << "x" << numeric.value.cols();
  }
  for (Eigen::Index i = 0; i < analytic.rows(); ++i) {
    const double scale =
        std::max({numeric.value.row(i).cwiseAbs().maxCoeff(), numeric.magnitude[i], 1e-12});
    for (Eigen::Index j = 0; j < analytic.cols(); ++j) {
      const double a = analytic(i, j);
      const double n = numeric.value(i, j);
      const bool known = numeric.error(i, j) <= tolerance * scale;  // false for NaN
      if (known && std::abs(a - n) <= tolerance * scale) continue;
      std::ostringstream text;
      text.precision(12);
      text << (known ? "derivative" : "the numeric derivative is too vague: entry") << " (" << i
           << ", " << j << "): analytic " << a << ", numeric " << n << " ± " << numeric.error(i, j)
           << ", allowed difference " << tolerance * scale << "\nanalytic:\n"
           << analytic << "\nnumeric:\n"
           << numeric.value;
      return ::testing::AssertionFailure() << text.str();
    }
  }
  return ::testing::AssertionSuccess();
}

}  // namespace cdprcal::test
