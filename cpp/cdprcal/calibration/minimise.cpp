#include "cdprcal/calibration/minimise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/calibration/assembly.hpp"

namespace cdprcal {
namespace {

constexpr double kFirstDamping = 1e-4;
constexpr double kLeastDamping = 1e-14, kMostDamping = 1e32;
constexpr double kLeastGain = 1e-3;  // of the promised decrease, for a step to be accepted

/// Nielsen's factor on the damping after a step that gained `ratio` of what was promised.
double after_success(double ratio) {
  return std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
}

}  // namespace

Minimiser::Minimiser(Assembly& assembly)
    : assembly_(assembly),
      elimination_(assembly.cache().size(), assembly.reference().size(), true) {}

bool Minimiser::sweep(const std::vector<Pose>& poses, double damping) {
  cost_ = kNaN;
  const int offsets = assembly_.reference().size();
  if (!assembly_.evaluate_rows(0, poses[0], initial_, initial_, rows_)) return false;
  by_initial_ = offset_jacobian(initial_);
  Matrix6 own = Matrix6::Zero();
  Vector6 own_gradient = Vector6::Zero();
  CommonVector error_diagonal = CommonVector::Zero(offsets);
  CommonVector error_gradient = CommonVector::Zero(offsets);
  double cost = 0.0;
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows_.count); ++r) {
    const Eigen::Map<const Vector6> row(rows_.own[r].data());
    const double residual = rows_.residual[r];
    cost += 0.5 * residual * residual;
    if (const int e = rows_.offset[r]; e >= 0) {
      error_diagonal[e] += rows_.by_offset[r] * rows_.by_offset[r];
      error_gradient[e] += rows_.by_offset[r] * residual;
    } else {
      own += row * row.transpose();
      own_gradient += row * residual;
    }
  }
  elimination_.begin(damping);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (!assembly_.evaluate_rows(i, poses[i], initial_, evaluation_, rows_)) return false;
    elimination_.add(rows_);
  }
  const EliminatedSums& sums = elimination_.finish();
  cost += sums.cost;
  if (!std::isfinite(cost)) return false;

  information_ = through_offsets(sums.information, by_initial_);
  information_.topLeftCorner<6, 6>() += own;
  information_.diagonal().tail(offsets) += error_diagonal;
  gradient_.resize(6 + offsets);
  gradient_.head<6>() = own_gradient + by_initial_.transpose() * sums.gradient;
  gradient_.tail(offsets) = sums.gradient + error_gradient;
  diagonal_.resize(6 + offsets);
  diagonal_.head<6>() = own.diagonal() + by_initial_.cwiseAbs2().transpose() * sums.raw_diagonal;
  diagonal_.tail(offsets) = sums.raw_diagonal + error_diagonal;
  diagonal_ = diagonal_.cwiseMax(kLeastDiagonal);

  largest_gradient_ = sums.largest_gradient;
  const Vector6 raw = own_gradient + by_initial_.transpose() * sums.raw_gradient;
  for (const int u : free_) {
    const double slope = u < 6 ? raw[u] : sums.raw_gradient[u - 6] + error_gradient[u - 6];
    largest_gradient_ = std::max(largest_gradient_, std::abs(slope));
  }
  pose_decrease_ = sums.decrease;
  cost_ = cost;
  return true;
}

bool Minimiser::solve_common(double damping) {
  step_.setZero(gradient_.size());
  if (!free_.empty()) {
    CommonMatrix system = information_(free_, free_);
    system.diagonal() += damping * diagonal_(free_);
    const Eigen::LLT<CommonMatrix> factor(system);
    if (factor.info() != Eigen::Success) return false;
    const CommonVector slope = gradient_(free_);
    const CommonVector moves = -factor.solve(slope);
    step_(free_) = moves;
  }
  if (!step_.allFinite() || !std::isfinite(pose_decrease_)) return false;
  const CommonVector offset_step = by_initial_ * step_.head<6>() + step_.tail(by_initial_.rows());
  const PoseSteps poses = elimination_.back_substitute(offset_step);
  decrease_ = pose_decrease_ - 0.5 * gradient_.dot(step_) +
              0.5 * damping * (poses.damping + step_.cwiseAbs2().dot(diagonal_));
  step_norm_ = std::sqrt(poses.squared_norm + step_.squaredNorm());
  return std::isfinite(step_norm_);
}

void Minimiser::move() {
  candidate_.resize(current_.size());
  candidate_[0] = hold_initial_pose_ ? current_[0] : plus(current_[0], step_.head<6>());
  state_norm_ = assembly_.reference_errors().squaredNorm();
  for (std::size_t i = 1; i < current_.size(); ++i) {
    candidate_[i] = plus(current_[i], elimination_.step(i - 1));
    state_norm_ += current_[i].position_m.squaredNorm() + 1.0;
  }
  state_norm_ = std::sqrt(state_norm_ + current_[0].position_m.squaredNorm() + 1.0);
}

MinimiserSummary Minimiser::minimise(const MinimiserOptions& options) {
  MinimiserSummary out;
  hold_initial_pose_ = options.hold_initial_pose;
  free_.clear();
  for (int u = hold_initial_pose_ ? 6 : 0; u < 6; ++u) free_.push_back(u);
  for (int e = 0; e < assembly_.reference().size(); ++e) {
    if (assembly_.reference().is_free(e)) free_.push_back(6 + e);
  }
  current_.resize(assembly_.cache().size());
  for (std::size_t i = 0; i < current_.size(); ++i) current_[i] = assembly_.cache().pose(i);
  Eigen::VectorXd errors = assembly_.reference_errors();

  double damping = kFirstDamping, growth = 2.0;
  const auto evaluate = [&](const std::vector<Pose>& poses) {
    ++out.evaluations;
    return sweep(poses, damping);
  };
  const auto reject = [&] {
    damping *= growth;
    growth *= 2.0;
  };
  if (!evaluate(current_)) return out;
  out.usable = true;
  double cost = cost_;
  bool fresh = true;  // the sweep's sums are those of current_ at this damping
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (!fresh) {
      assembly_.set_reference_errors(errors);
      evaluate(current_);
      fresh = true;
    }
    if (largest_gradient_ <= options.gradient_tolerance) {
      out.converged = true;
      break;
    }
    const bool solved = solve_common(damping);
    if (solved) {
      move();
      if (step_norm_ <= options.parameter_tolerance * (state_norm_ + options.parameter_tolerance)) {
        out.converged = true;
        break;
      }
    }
    if (!solved || !(decrease_ > 0.0)) {
      if (damping >= kMostDamping) break;
      reject();
      fresh = false;
      continue;
    }
    const double promised = decrease_;
    assembly_.set_reference_errors(errors + step_.tail(errors.size()));
    const double before = damping;
    damping = std::max(kLeastDamping, damping / 3.0);
    const bool valid = evaluate(candidate_);
    const double gain = valid ? cost - cost_ : -std::numeric_limits<double>::infinity();
    const bool settled = std::abs(gain) <= options.function_tolerance * cost;
    if (gain > 0.0 && (settled || gain > kLeastGain * promised)) {
      std::swap(current_, candidate_);
      errors = assembly_.reference_errors();
      cost = cost_;
      growth = 2.0;
      const double wanted = before * after_success(std::min(gain / promised, 1.0));
      fresh = wanted <= 2.0 * damping;  // near enough to what the sweep supposed
      if (!fresh) damping = wanted;
    } else {
      damping = before;
      if (damping >= kMostDamping) break;
      reject();
      fresh = false;
    }
    if (settled) {
      out.converged = true;
      break;
    }
  }
  assembly_.set_reference_errors(errors);
  for (std::size_t i = 0; i < current_.size(); ++i) assembly_.cache().set_pose(i, current_[i]);
  return out;
}

}  // namespace cdprcal
