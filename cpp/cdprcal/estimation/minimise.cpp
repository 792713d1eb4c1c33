#include "cdprcal/estimation/minimise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal {
namespace {

constexpr double kFirstDamping = 1e-4;
constexpr double kLeastDamping = 1e-14, kMostDamping = 1e32;
constexpr double kLeastGain = 1e-3;  // of the promised decrease, for a step to be accepted

/// Nielsen's factor on the damping after a step that gained `ratio` of what was promised.
double after_success(double ratio) {
  const double excess = 2.0 * ratio - 1.0;
  return std::max(1.0 / 3.0, 1.0 - excess * excess * excess);
}

}  // namespace

Minimiser::Minimiser(Assembly& assembly)
    : assembly_(assembly),
      current_{{}, PoseLanes(assembly.cache().size() - 1)},
      candidate_{{}, PoseLanes(assembly.cache().size() - 1)},
      elimination_(assembly.cache().size(), assembly.reference().size(), true),
      row_lanes_(assembly.row_lanes()),
      slots_(row_lanes_ != nullptr ? row_lanes_->slots(std::nullopt) : RowSlots{}) {}

bool Minimiser::eliminate(const PoseLanes& poses, double damping) {
  if (row_lanes_ != nullptr) {
    elimination_.begin(damping, slots_);
    row_lanes_->set_offsets(initial_);
    for (std::size_t b = 0; b < row_lanes_->batches(); ++b) {
      if (!row_lanes_->evaluate(b, poses)) return false;
      elimination_.add_batch(row_lanes_->rows(), row_lanes_->by_offset());
    }
    return true;
  }
  elimination_.begin(damping);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!assembly_.evaluate_rows(i + 1, poses[i], initial_, evaluation_, rows_)) return false;
    elimination_.add(rows_);
  }
  return true;
}

bool Minimiser::sweep(const State& state, double damping) {
  cost_ = kNaN;
  const int offsets = assembly_.reference().size();
  if (!assembly_.evaluate_rows(0, state.initial, initial_, initial_, rows_)) return false;
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
  if (!eliminate(state.others, damping)) return false;
  const EliminatedSums& sums = elimination_.finish();
  cost += sums.cost;
  if (!std::isfinite(cost)) return false;

  const bool errors_too = !free_.empty() && free_.back() >= 6;
  information_ = through_offsets(sums.information, by_initial_, errors_too);
  information_.topLeftCorner<6, 6>() += own;
  if (errors_too) information_.diagonal().tail(offsets) += error_diagonal;
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
    const auto size = static_cast<Eigen::Index>(free_.size());
    CommonMatrix system(size, size);
    CommonVector moves(size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const int u = free_[static_cast<std::size_t>(i)];
      for (Eigen::Index j = 0; j < size; ++j) {
        system(j, i) = information_(free_[static_cast<std::size_t>(j)], u);
      }
      system(i, i) += damping * diagonal_[u];
      moves[i] = -gradient_[u];
    }
    const Eigen::LLT<CommonMatrix> factor(system);
    if (factor.info() != Eigen::Success) return false;
    factor.solveInPlace(moves);
    for (Eigen::Index i = 0; i < size; ++i) step_[free_[static_cast<std::size_t>(i)]] = moves[i];
  }
  if (!step_.allFinite() || !std::isfinite(pose_decrease_)) return false;
  const OffsetVector offset_step = by_initial_ * step_.head<6>() + step_.tail(by_initial_.rows());
  const PoseSteps poses = elimination_.back_substitute(offset_step);
  decrease_ = pose_decrease_ - 0.5 * gradient_.dot(step_) +
              0.5 * damping * (poses.damping + step_.cwiseAbs2().dot(diagonal_));
  step_norm_ = std::sqrt(poses.squared_norm + step_.squaredNorm());
  return std::isfinite(step_norm_);
}

void Minimiser::move() {
  const Pose& initial = current_.initial;
  candidate_.initial = hold_initial_pose_ ? initial : plus(initial, step_.head<6>());
  double squares =
      assembly_.reference_errors().squaredNorm() + initial.position_m.squaredNorm() + 1.0;
  const std::size_t batches = lanes::batches(current_.others.size());
  for (std::size_t b = 0; b < batches; ++b) {
    squares += candidate_.others.move(b, current_.others, elimination_.steps(b));
  }
  state_norm_ = std::sqrt(squares);
}

MinimiserSummary Minimiser::minimise(const MinimiserOptions& options) {
  MinimiserSummary out;
  hold_initial_pose_ = options.hold_initial_pose;
  free_.clear();
  for (int u = hold_initial_pose_ ? 6 : 0; u < 6; ++u) free_.push_back(u);
  for (int e = 0; e < assembly_.reference().size(); ++e) {
    if (assembly_.reference().is_free(e)) free_.push_back(6 + e);
  }
  current_.initial = assembly_.cache().pose(0);
  const std::size_t others = current_.others.size();
  for (std::size_t i = 0; i < others; ++i) current_.others.set(i, assembly_.cache().pose(i + 1));
  if (row_lanes_ != nullptr) row_lanes_->update_weights();
  OffsetVector errors = assembly_.reference_errors();

  double damping = kFirstDamping, growth = 2.0;
  const auto evaluate = [&](const State& state) {
    ++out.evaluations;
    return sweep(state, damping);
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
    assembly_.set_reference_errors(OffsetVector(errors + step_.tail(errors.size())));
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
  out.cost = cost;
  assembly_.set_reference_errors(errors);
  assembly_.cache().set_pose(0, current_.initial);
  for (std::size_t i = 0; i < others; ++i) assembly_.cache().set_pose(i + 1, current_.others[i]);
  return out;
}

}  // namespace cdprcal
