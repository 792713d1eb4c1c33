#include "cdprcal/startup/tension_controller.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"

namespace cdprcal {
namespace {

/// The symmetric matrix with eigenvalues changed by f (≥ 0 before).
template <class Function>
CableMatrix with_eigenvalues(const CableMatrix& matrix, const Function& f) {
  const SymmetricEigen<CableMatrix> eigen(matrix);
  CableVector values = eigen.eigenvalues();
  for (double& v : values) v = f(std::max(0.0, v));
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

TensionController::TensionController(int cable_count, const TensionControlOptions& options,
                                     double velocity_limit_m_s)
    : options_(options),
      slow_m_s_N_(CableMatrix::Zero(cable_count, cable_count)),
      fast_m_s_N_(CableMatrix::Zero(cable_count, cable_count)),
      once_N_(CableVector::Zero(cable_count)),
      twice_N_(CableVector::Zero(cable_count)),
      ramp_(cable_count, velocity_limit_m_s) {}

void TensionController::reset(const CableVector& velocity_m_s) {
  ramp_.reset(velocity_m_s);
  once_N_.setZero();
  twice_N_.setZero();
}

void TensionController::tune(const PathLeg& leg, double fraction) {
  const double slowest_rad_s = leg.slowest_rad_s();
  filter_s_ = options_.filter / slowest_rad_s;
  const double rate_1_s = options_.bandwidth * slowest_rad_s;
  const CableMatrix flexibility = leg.flexibility_m_N(fraction);
  const double largest = flexibility.trace();
  slow_m_s_N_ = with_eigenvalues(flexibility, [&](double f) {
    const double root = std::sqrt(f) - options_.direction_error * std::sqrt(std::max(0.0, largest));
    return rate_1_s * std::pow(std::max(0.0, root), 2);
  });
  const double k = options_.axial_stiffness_N / leg.mean_length_m();
  const double r = options_.locked_bandwidth_1_s;
  fast_m_s_N_ = with_eigenvalues(leg.mobility_1_kg(fraction),
                                 [&](double a) { return r / k / (1.0 + k * a / (4.0 * r * r)); });
}

const CableVector& TensionController::step(const CableVector& error_N,
                                           const CableVector& feed_forward_m_s, double dt_s) {
  const double share = -std::expm1(-dt_s / filter_s_);
  once_N_ += share * (error_N - once_N_);
  twice_N_ += share * (once_N_ - twice_N_);
  // Too little tension hauls in: error > 0 gives v < 0.
  return ramp_.command(feed_forward_m_s - slow_m_s_N_ * twice_N_ - fast_m_s_N_ * error_N, dt_s);
}

const CableVector& TensionController::coast(double dt_s) {
  return ramp_.command(CableVector::Zero(once_N_.size()), dt_s);
}

}  // namespace cdprcal
