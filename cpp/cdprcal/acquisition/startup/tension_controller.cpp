#include "cdprcal/acquisition/startup/tension_controller.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace cdprcal {
namespace {

constexpr double kFullSpeed_s = 0.2;  ///< from rest to the velocity limit: the drives' ramp

}  // namespace

TensionController::TensionController(int cable_count, const TensionControlOptions& options,
                                     double velocity_limit_m_s)
    : options_(options),
      limit_m_s_(velocity_limit_m_s),
      gain_m_s_N_(CableMatrix::Zero(cable_count, cable_count)),
      once_N_(CableVector::Zero(cable_count)),
      twice_N_(CableVector::Zero(cable_count)),
      commanded_m_s_(CableVector::Zero(cable_count)) {}

void TensionController::reset(const CableVector& velocity_m_s) {
  commanded_m_s_ = velocity_m_s;
  once_N_.setZero();
  twice_N_.setZero();
}

void TensionController::tune(const PathLeg& leg, double fraction) {
  const double slowest_rad_s = leg.slowest_rad_s();
  filter_s_ = options_.filter / slowest_rad_s;
  const Eigen::SelfAdjointEigenSolver<CableMatrix> eigen(leg.flexibility_m_N(fraction));
  CableVector values = eigen.eigenvalues();
  const double uncertain = options_.direction_error * std::sqrt(std::max(0.0, values.maxCoeff()));
  const double stretch = leg.mean_length_m() / options_.axial_stiffness_N;
  for (double& f : values) {
    const double root = std::max(0.0, std::sqrt(std::max(0.0, f)) - uncertain);
    f = options_.bandwidth * slowest_rad_s * (root * root + stretch);
  }
  gain_m_s_N_ = eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

void TensionController::command(const CableVector& wanted_m_s, double dt_s) {
  const double change = limit_m_s_ * dt_s / kFullSpeed_s;
  for (Eigen::Index i = 0; i < wanted_m_s.size(); ++i) {
    const double now = commanded_m_s_[i];
    commanded_m_s_[i] =
        std::clamp(std::clamp(wanted_m_s[i], now - change, now + change), -limit_m_s_, limit_m_s_);
  }
}

const CableVector& TensionController::step(const CableVector& error_N,
                                           const CableVector& feed_forward_m_s, double dt_s) {
  const double share = -std::expm1(-dt_s / filter_s_);
  once_N_ += share * (error_N - once_N_);
  twice_N_ += share * (once_N_ - twice_N_);
  // Too little tension hauls in: error > 0 gives v < 0.
  command(feed_forward_m_s - gain_m_s_N_ * twice_N_, dt_s);
  return commanded_m_s_;
}

const CableVector& TensionController::stop(double dt_s) {
  command(CableVector::Zero(commanded_m_s_.size()), dt_s);
  return commanded_m_s_;
}

}  // namespace cdprcal
