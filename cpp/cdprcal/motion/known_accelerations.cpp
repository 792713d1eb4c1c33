#include "cdprcal/motion/known_accelerations.hpp"

#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

void shrink_accelerations(const Robot& robot, const std::vector<Pose>& poses,
                          const std::vector<Matrix6>& noise, double worth,
                          std::span<Measurement> moments) {
  constexpr double kNone = 1e-12;  // of the largest variance: where the platform is guided
  constexpr double kLeast = 1e-300;
  if (moments.empty()) return;
  const auto count = static_cast<double>(moments.size());
  std::vector<Matrix6> mass;
  std::vector<Vector6> taken;
  Matrix6 all = Matrix6::Zero(), of_noise = all;
  for (std::size_t k = 0; k < moments.size(); ++k) {
    mass.push_back(mass_matrix(robot, platform_state(robot, poses[k])));
    taken.emplace_back(mass.back() * moments[k].acceleration);
    all += taken.back() * taken.back().transpose() / count;
    of_noise += noise[k] / count;
  }
  if (!all.allFinite() || !of_noise.allFinite()) return;
  const SymmetricEigen<Matrix6> own(of_noise);
  const auto free = (own.eigenvalues().array() > kNone * own.eigenvalues().maxCoeff()).count();
  const Eigen::MatrixXd root =
      own.eigenvectors().rightCols(free) * own.eigenvalues().tail(free).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd whitening =
      own.eigenvalues().tail(free).cwiseSqrt().cwiseInverse().asDiagonal() *
      own.eigenvectors().rightCols(free).transpose();
  // Of noise alone the largest variance is no more than that, in 99 of 100 (Johnstone 2001).
  const double moments_worth = std::max(2.0, count / std::max(1.0, worth));
  const double n = std::sqrt(moments_worth), p = std::sqrt(static_cast<double>(free));
  const double of_chance =
      ((n + p) * (n + p) + 2.02 * (n + p) * std::cbrt(1.0 / n + 1.0 / p)) / moments_worth;
  const SymmetricEigen<Eigen::MatrixXd> seen(whitening * all * whitening.transpose());
  const Eigen::VectorXd kept = seen.eigenvalues().unaryExpr(
      [&](double variance) { return variance > of_chance ? 1.0 - 1.0 / variance : 0.0; });
  // A motion that hides in the noise is no larger than that.
  const Eigen::VectorXd open = kept.cwiseMax(std::min(1.0, of_chance - 1.0));
  const Eigen::MatrixXd directions = root * seen.eigenvectors();
  const Matrix6 noisy = directions * (1.0 - kept.array()).matrix().asDiagonal() *
                        seen.eigenvectors().transpose() * whitening;
  const Vector6 share = (directions * open.asDiagonal() * directions.transpose())
                            .diagonal()
                            .cwiseQuotient(of_noise.diagonal().cwiseMax(kLeast))
                            .cwiseMax(0.0)
                            .cwiseSqrt();
  for (std::size_t k = 0; k < moments.size(); ++k) {
    moments[k].acceleration -= solve_symmetric(mass[k], Vector6(noisy * taken[k]));
    moments[k].inertial_sigma = moments[k].inertial_sigma.cwiseProduct(share);
  }
}

}  // namespace cdprcal
