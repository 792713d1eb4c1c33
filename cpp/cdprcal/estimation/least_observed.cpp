#include "cdprcal/estimation/least_observed.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
std::string quantity(bool rotation, double value) {
  if (!std::isfinite(value)) return "not at all";
  return rotation ? printed("%.3g deg", value / kDegree) : printed("%.3g mm", 1e3 * value);
}

/// A direction as people see it: the axis that most of it is along, or its larger half.
struct NamedDirection {
  std::string name;  ///< "rotation about z", or the two largest parts of a mixture
  Vector6 twist;     ///< a unit vector, of position or of rotation
  [[nodiscard]] bool is_rotation() const { return twist.head<3>().isZero(0.0); }
};

/// `unit`: in scaled units.
NamedDirection named_direction(const Vector6& unit, const Vector6& scale) {
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
  if (largest * largest > 0.8) return {name, Vector6::Unit(first)};
  Vector6 half = scale.cwiseProduct(unit);
  if (unit.tail<3>().norm() > unit.head<3>().norm()) {
    half.head<3>().setZero();
  } else {
    half.tail<3>().setZero();
  }
  return {std::string(name) + " together with " + kAxes[static_cast<std::size_t>(second)],
          half.normalized()};
}

/// Standard deviation along a direction (unit in scaled units) for a given information matrix.
double sigma_along(const Matrix6& information, const Vector6& direction) {
  const Eigen::LLT<Matrix6> factor(information);
  if (is_regular(factor)) return factor.matrixL().solve(direction).norm();
  const SymmetricEigen<Matrix6> eigen(information);
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

LeastObserved least_observed(const CalibrationProblem& problem, Assembly& assembly,
                             const Matrix6* shown) {
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
  const auto largest_of = [&]() -> Vector6 {
    if (shown == nullptr) return SymmetricEigen<Matrix6>(all).eigenvectors().col(0);
    const Vector6 back = scale.cwiseInverse();
    const Matrix6 covariance = back.asDiagonal() * *shown * back.asDiagonal();
    return SymmetricEigen<Matrix6>(covariance).eigenvectors().col(5);
  };
  const NamedDirection weakest = named_direction(largest_of(), scale);
  const Vector6 along = weakest.twist.cwiseProduct(scale);  // twist·δ = along·x
  const double by_information = along.norm() * sigma_along(all, along.normalized());
  const double sigma =
      shown == nullptr ? by_information : std::sqrt(weakest.twist.dot(*shown * weakest.twist));
  if (!std::isfinite(sigma)) {
    out.sentence = "nothing measured determines the " + weakest.name;
    return out;
  }
  Channel seen_by = Channel::length;  // without which sigma grows most: so many times
  double grows = 0.0;
  for (std::size_t w = 1; w < without.size(); ++w) {
    const Matrix6 others = scaled(w);
    const double times =
        others.isZero(0.0)
            ? kInfinite
            : along.norm() * sigma_along(others, along.normalized()) / by_information;
    if (!(times > grows)) continue;
    grows = times;
    seen_by = *without[w];
  }
  const std::string seen = kChannelTable[static_cast<std::size_t>(seen_by)].in_words;
  const bool is_rotation = weakest.is_rotation();
  out.sentence = "least certain: " + weakest.name + ", " + quantity(is_rotation, sigma) + "; ";
  if (!std::isfinite(grows)) {
    out.sentence += "only " + seen + " can see it";
  } else if (grows > 2.0) {
    out.sentence += "mostly " + seen + " see" + (seen_by == Channel::balance ? "s" : "") + " it (" +
                    quantity(is_rotation, grows * sigma) + " without)";
  } else {
    out.sentence += "several kinds of readings see it";
  }
  return out;
}

}  // namespace cdprcal
