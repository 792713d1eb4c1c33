#include "cdprcal/frame/contradicted.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/symmetric_inverse.hpp"
#include "cdprcal/frame/gauge.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal::detail {
namespace {

/// By which the file's σ are larger where the lengths are to say alone how well they fit.
constexpr double kLoose = 100.0;

}  // namespace

std::vector<Contradiction> contradicted(const Solved& solved, int max_iterations) {
  std::vector<Contradiction> out;
  const auto& cables = solved.problem.robot.cables;
  const bool said = std::any_of(cables.begin(), cables.end(), [](const Cable& cable) {
    return !cable.pulley.position_sigma_m.hasNaN();
  });
  if (!said || solved.problem.unknowns.by_convention()) return out;
  Solved loose = solved;
  FrameUnknowns& u = loose.problem.unknowns;
  u.precision.head(u.axis_count * u.cables) /= kLoose * kLoose;
  solve(loose, max_iterations);
  if (!loose.known.valid || !to_spare(loose)) return out;
  Solved s = solved;
  s.problem.sigma = loose.problem.sigma;
  s.problem.untold_stretch = loose.problem.untold_stretch;
  // Residuals that hang together are worth fewer readings.
  for (double& sigma : s.problem.sigma) sigma *= loose.known.lack_of_fit;
  minimise(s.problem, s.state, max_iterations);
  const FrameInformation told = information(s.problem, s.state);
  if (!told.valid) return out;
  FrameUnknowns& left = s.problem.unknowns;
  Eigen::VectorXd values = s.state.values;
  for (;;) {
    Contradiction worst;
    double least = kFalseAlarm / static_cast<double>(left.cables);
    Eigen::VectorXd worst_values;
    FrameUnknowns worst_left;
    for (int i = 0; i < left.cables; ++i) {
      const int at = left.anchor(i, 0), size = left.axis_count;
      const Eigen::VectorXd own = left.precision.segment(at, size);
      FrameUnknowns without = left;
      without.precision.segment(at, size).setZero();
      if (!(own.minCoeff() > 0.0) || !fixes_place(without, s.problem.robot)) continue;
      // Without its prior, whose pull at the minimum was own · values.
      Eigen::MatrixXd information = told.normal;
      information.diagonal() += without.precision;
      const Eigen::MatrixXd covariance = symmetric_inverse(information);
      const Eigen::VectorXd there =
          values + covariance.middleCols(at, size) * own.cwiseProduct(values.segment(at, size));
      Eigen::MatrixXd spread = covariance.block(at, at, size, size);
      spread.diagonal() += own.cwiseInverse();
      const Eigen::VectorXd off = there.segment(at, size);
      const double chi_square = off.dot(solve_symmetric(spread, off));
      const double chance = chi_square_survival(chi_square, size);
      if (!(chance <= least) || std::sqrt(chi_square) <= worst.sigmas) continue;
      least = chance;
      worst = {i, off.norm(), std::sqrt(chi_square)};
      worst_values = there;
      worst_left = without;
    }
    if (worst.sigmas == 0.0) return out;
    out.push_back(worst);
    values = worst_values;
    left = worst_left;
  }
}

std::string in_words(const std::vector<Contradiction>& contradictions, double size_m) {
  if (std::ranges::max(contradictions, {}, &Contradiction::distance_m).distance_m > size_m) {
    return "the lengths fit no frame of this robot's size: check the unit of each column, and their "
           "order";
  }
  std::string text;
  for (const Contradiction& c : contradictions) {
    add_item(text, std::string("pulley ") + std::to_string(c.cable + 1) + " is " +
                       std::to_string(std::lround(1e3 * c.distance_m)) + " mm (" +
                       std::to_string(std::lround(c.sigmas)) +
                       " σ) from where the robot file has it");
  }
  return text +
         ", by the lengths and the other pulleys: correct its position_m, or say by "
         "position_sigma_m how far off it may be";
}

}  // namespace cdprcal::detail
