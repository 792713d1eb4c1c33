#include "cdprcal/estimation/least_observed.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cstdio>
#include <limits>

#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
std::string quantity(bool rotation, double value) {
  if (!std::isfinite(value)) return "not at all";
  char text[48];
  std::snprintf(text, sizeof text, rotation ? "%.3g deg" : "%.3g mm",
                rotation ? value / kDegree : 1e3 * value);
  return text;
}

/// "rotation about z", "position along x", or the two largest parts of a mixture.
std::string axis_name(const Vector6& unit) {
  constexpr std::array<const char*, 6> kAxes{"position along x", "position along y",
                                             "position along z", "rotation about x",
                                             "rotation about y", "rotation about z"};
  Eigen::Index first = 0, second = 0;
  const Vector6 size = unit.cwiseAbs();
  const double largest = size.maxCoeff(&first);
  Vector6 rest = size;
  rest[first] = 0.0;
  rest.maxCoeff(&second);
  const char* const name = kAxes[static_cast<std::size_t>(first)];
  if (largest * largest > 0.8) return name;
  return std::string(name) + " together with " + kAxes[static_cast<std::size_t>(second)];
}

/// Standard deviation along a direction (unit in scaled units) for a given information matrix.
double sigma_along(const Matrix6& information, const Vector6& direction) {
  const Eigen::LLT<Matrix6> factor(information);
  if (is_regular(factor)) return factor.matrixL().solve(direction).norm();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(information);
  const double floor = 1e-12 * eigen.eigenvalues().maxCoeff();
  double variance = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double part = eigen.eigenvectors().col(i).dot(direction);
    if (eigen.eigenvalues()[i] > floor) {
      variance += part * part / eigen.eigenvalues()[i];
    } else if (part * part > 1e-6) {
      return kInfinite;
    }
  }
  return std::sqrt(variance);
}

}  // namespace

LeastObserved least_observed(const CalibrationProblem& problem, Assembly& assembly) {
  LeastObserved out;
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(1.0 / characteristic_length_m(problem.robot));
  // δ = S x with x all in metres.
  std::vector<std::optional<Channel>> without{std::nullopt};
  for (int c = 0; c < kChannels; ++c) {
    if (is_read(problem, static_cast<Channel>(c))) without.emplace_back(static_cast<Channel>(c));
  }
  const std::vector<ReferenceInformation> informations = assembly.reference_informations(without);
  out.information = informations.front();
  const TwistBasis guided = guided_basis(problem.robot);
  const auto scaled = [&](std::size_t w) {
    Matrix6 own = scale.asDiagonal() * informations[w].information * scale.asDiagonal();
    // What guides hold is never the least certain.
    if (guided.cols() > 0) own += own.trace() * guided * guided.transpose();
    return own;
  };
  const Matrix6 all = scaled(0);
  if (!all.allFinite()) return out;
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(all);
  const Vector6 weakest = eigen.eigenvectors().col(0);
  const double most = eigen.eigenvalues()[5], least = eigen.eigenvalues()[0];
  out.condition = least > 0.0 ? std::sqrt(most / least) : kInfinite;
  out.is_rotation = weakest.tail<3>().norm() > weakest.head<3>().norm();
  const Vector6 twist = scale.cwiseProduct(weakest);
  const double unit = out.is_rotation ? twist.tail<3>().norm() : twist.head<3>().norm();
  out.direction = twist / unit;
  out.sigma = unit * sigma_along(all, weakest);

  double grows = 0.0;
  for (std::size_t w = 1; w < without.size(); ++w) {
    const Matrix6 others = scaled(w);
    const double sigma = others.isZero(0.0) ? kInfinite : unit * sigma_along(others, weakest);
    if (!(sigma > grows)) continue;
    grows = sigma;
    out.seen_by = *without[w];
    out.sigma_without = sigma;
  }
  const std::string name = axis_name(weakest);
  if (!std::isfinite(out.sigma)) {
    out.sentence = "nothing measured determines the " + name;
    return out;
  }
  const std::string seen = kChannelTable[static_cast<std::size_t>(out.seen_by)].in_words;
  out.sentence = "least certain: " + name + ", " + quantity(out.is_rotation, out.sigma) + "; ";
  if (!std::isfinite(out.sigma_without)) {
    out.sentence += "only " + seen + " can see it";
  } else if (out.sigma_without > 2.0 * out.sigma) {
    out.sentence += "mostly " + seen + " see" + (out.seen_by == Channel::balance ? "s" : "") +
                    " it (" + quantity(out.is_rotation, out.sigma_without) + " without)";
  } else {
    out.sentence += "several kinds of readings see it";
  }
  return out;
}

}  // namespace cdprcal
