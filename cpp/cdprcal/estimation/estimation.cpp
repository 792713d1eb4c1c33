#include "cdprcal/estimation/estimation.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/estimation/symmetric_inverse.hpp"

namespace cdprcal {

using lanes::kLanes;

Estimation::Estimation(std::vector<EstimatedRun> runs, Eigen::VectorXd values,
                       ValuePrecision precision)
    : runs_(std::move(runs)),
      values_(std::move(values)),
      trial_values_(values_),
      precision_(std::move(precision)) {}

bool Estimation::prepare(std::size_t, const PoseLanes&, const Eigen::VectorXd&) { return true; }

std::size_t Estimation::batches_of(const EstimatedRun& run) {
  return lanes::batches(run.poses.size() - (run.is_reference_silent() ? 1 : 0));
}

Eigen::Index Estimation::size_of(const EstimatedRun& run) const {
  return static_cast<Eigen::Index>(run.free_offsets.size()) +
         (run.tied && !run.hold_reference ? 6 : 0);
}

Eigen::Index Estimation::common_size() const {
  Eigen::Index size = values_.size();
  for (const EstimatedRun& run : runs_) size += size_of(run);
  return size;
}

Estimation::OffsetsByUnknowns Estimation::by_unknowns(const EstimatedRun& run) const {
  OffsetsByUnknowns out = OffsetsByUnknowns::Zero(run.offsets.size(), size_of(run));
  Eigen::Index column = 0;
  if (run.tied && !run.hold_reference) {
    out.leftCols<6>() = run.by_reference;
    column = 6;
  }
  for (const int offset : run.free_offsets) out(offset, column++) = 1.0;
  return out;
}

template <typename Visit>
bool Estimation::sweep(std::size_t index, bool on_trial, double damping, const Visit& visit) {
  EstimatedRun& run = runs_[index];
  const PoseLanes& poses = on_trial ? run.trial : run.poses;
  if (!prepare(index, poses, on_trial ? trial_values_ : values_)) return false;
  const std::size_t reference = run.reference;
  if (run.tied) {
    const PoseEvaluation& initial = run.rows->evaluate_alone(reference, poses[reference]);
    if (!initial.valid) return false;
    run.by_reference = run.rows->offsets_by_twist(initial);
    OffsetVector& offsets = on_trial ? run.trial_offsets : run.offsets;
    offsets = offsets_of(initial) + (on_trial ? run.trial_errors : run.errors);
  }
  run.rows->set_offsets((on_trial ? run.trial_offsets : run.offsets).data());
  run.elimination.begin(damping, run.slots);
  const bool silent = run.is_reference_silent();
  reference_rows_.count = 0;
  for (std::size_t b = 0; b < batches_of(run); ++b) {
    if (!run.rows->evaluate(b, poses)) return false;
    if (!silent && b == reference / kLanes) {
      if (run.tied) {
        run.rows->take(reference, reference_rows_);
        run.rows->forget(reference % kLanes);
      } else if (run.hold_reference) {
        run.rows->hold(reference % kLanes);
      }
    }
    run.elimination.add(run.rows->rows(), run.rows->by_offset(), run.rows->by_effect());
    visit(b);
  }
  return true;
}

bool Estimation::add_run(std::size_t index, bool on_trial, double damping, Eigen::Index begin,
                         CommonSystem& out) {
  if (!sweep(index, on_trial, damping, [](std::size_t) {})) return false;
  EstimatedRun& run = runs_[index];
  const EliminatedSums& sums = run.elimination.finish();
  out.cost += sums.cost;
  out.decrease += sums.decrease;
  out.largest_gradient = std::max(out.largest_gradient, sums.largest_gradient);

  const Eigen::Index size = size_of(run), values = values_.size(), offsets = run.offsets.size(),
                     last = out.gradient.size() - values;
  const auto steepen = [&out](double slope) {
    out.largest_gradient = std::max(out.largest_gradient, std::abs(slope));
  };
  if (run.tied) {
    Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6 + kMostOffsets, 1> raw;
    const auto reduce = [&](const auto& to_unknowns) {
      constexpr int kRows = std::decay_t<decltype(to_unknowns)>::RowsAtCompileTime;
      const Eigen::Matrix<double, kRows, Eigen::Dynamic> half =
          to_unknowns.lazyProduct(sums.information.topLeftCorner(offsets, offsets));
      out.information.block<kRows, kRows>(begin, begin, size, size) +=
          half.lazyProduct(to_unknowns.transpose());
      out.gradient.segment(begin, size) += to_unknowns.lazyProduct(sums.gradient.head(offsets));
      out.diagonal.segment(begin, size) +=
          to_unknowns.cwiseAbs2().lazyProduct(sums.raw_diagonal.head(offsets));
      raw = to_unknowns.lazyProduct(sums.raw_gradient.head(offsets));
    };
    if (run.free_offsets.empty() && !run.hold_reference) {
      reduce(run.by_reference.transpose());  // of fixed height, and all there is in the paper
    } else {
      reduce(by_unknowns(run).transpose());
    }
    for (std::size_t r = 0; r < static_cast<std::size_t>(reference_rows_.count); ++r) {
      const Eigen::Map<const Vector6> row(reference_rows_.own[r].data());
      const double residual = reference_rows_.residual[r];
      out.cost += 0.5 * residual * residual;
      if (run.hold_reference) continue;
      out.information.block<6, 6>(begin, begin) += row * row.transpose();
      out.gradient.segment<6>(begin) += residual * row;
      out.diagonal.segment<6>(begin) += row.cwiseAbs2();
      raw.head<6>() += residual * row;
    }
    if (!run.hold_reference) {
      out.information.block<6, 6>(begin, begin) += run.rows->free_motion().across();
    }
    for (const double slope : raw) steepen(slope);
    return true;
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    const int u = run.free_offsets[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double value = sums.information(u, run.free_offsets[static_cast<std::size_t>(j)]);
      out.information(begin + i, begin + j) = value;
      out.information(begin + j, begin + i) = value;
    }
    out.gradient[begin + i] = sums.gradient[u];
    out.diagonal[begin + i] = sums.raw_diagonal[u];
    steepen(sums.raw_gradient[u]);
    for (Eigen::Index k = 0; k < values; ++k) {
      out.information(begin + i, last + k) = out.information(last + k, begin + i) =
          sums.information(u, offsets + k);
    }
  }
  if (values == 0) return true;
  out.information.bottomRightCorner(values, values) +=
      sums.information.bottomRightCorner(values, values);
  out.gradient.tail(values) += sums.gradient.tail(values);
  out.diagonal.tail(values) += sums.raw_diagonal.tail(values);
  return true;
}

bool Estimation::linearise(bool on_trial, double damping, CommonSystem& out) {
  out.clear(common_size());
  Eigen::Index begin = 0;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (!add_run(r, on_trial, damping, begin, out)) return false;
    begin += size_of(runs_[r]);
  }
  if (const Eigen::Index values = values_.size(); values > 0) {
    const Eigen::VectorXd& at = on_trial ? trial_values_ : values_;
    const Eigen::VectorXd pull = precision_.cwiseProduct(at);
    out.information.diagonal().tail(values) += precision_;
    out.gradient.tail(values) += pull;
    out.diagonal.tail(values) += precision_;
    out.cost += 0.5 * pull.dot(at);
    // Values have no raw gradient: they count by the reduced one.
    out.largest_gradient =
        std::max(out.largest_gradient, out.gradient.tail(values).cwiseAbs().maxCoeff());
  }
  out.diagonal = out.diagonal.cwiseMax(kLeastDiagonal);
  return std::isfinite(out.cost);
}

TrialStep Estimation::try_step(const Eigen::VectorXd& common_step) {
  TrialStep out;
  const Eigen::Index values = values_.size();
  trial_values_ = values_ + common_step.tail(values);
  out.state_squared_norm = values_.squaredNorm();
  Eigen::Index begin = 0;
  for (EstimatedRun& run : runs_) {
    const Eigen::Index size = size_of(run);
    const auto step = common_step.segment(begin, size);
    begin += size;
    run_step_.setZero(run.offsets.size() + values);
    run_step_.tail(values) = common_step.tail(values);
    if (run.tied) {
      run_step_.head(run.offsets.size()) = by_unknowns(run).lazyProduct(step);
      run.trial_errors = run.errors;
    }
    const Eigen::Index own = size - static_cast<Eigen::Index>(run.free_offsets.size());
    for (std::size_t i = 0; i < run.free_offsets.size(); ++i) {
      const int offset = run.free_offsets[i];
      const double change = step[own + static_cast<Eigen::Index>(i)];
      if (run.tied) {
        run.trial_errors[offset] += change;
      } else {
        run_step_[offset] = change;
      }
    }
    const PoseSteps steps = run.elimination.back_substitute(run_step_);
    out.squared_norm += steps.squared_norm;
    out.damping += steps.damping;
    out.state_squared_norm += (run.tied ? run.errors : run.offsets).squaredNorm();
    for (std::size_t b = 0; b < batches_of(run); ++b) {
      out.state_squared_norm += run.trial.move(b, run.poses, run.elimination.steps(b));
    }
    if (run.tied) {
      const Pose reference = run.poses[run.reference];
      const auto moved = [&] {
        return plus(reference, run.rows->free_motion().of(Vector6(step.head<6>())));
      };
      run.trial.set(run.reference, own > 0 ? moved() : reference);
    } else {
      run.trial_offsets = run.offsets + run_step_.head(run.offsets.size());
    }
  }
  return out;
}

void Estimation::accept() {
  values_.swap(trial_values_);
  for (EstimatedRun& run : runs_) {
    std::swap(run.poses, run.trial);
    run.offsets.swap(run.trial_offsets);
    if (run.tied) run.errors.swap(run.trial_errors);
  }
}

Eigen::MatrixXd Estimation::covariance() {
  CommonSystem system;
  if (!linearise(false, kBarely, system)) {
    return Eigen::MatrixXd::Constant(common_size(), common_size(), kNaN);
  }
  return covariance(system);
}

Eigen::MatrixXd Estimation::covariance(const CommonSystem& system) {
  return symmetric_inverse(system.information);
}

bool Estimation::left_over(const Eigen::MatrixXd& covariance, const VisitLeftOver& visit) {
  const Eigen::Index values = values_.size();
  Eigen::Index begin = 0;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    EstimatedRun& run = runs_[r];
    const Eigen::Index offsets = run.offsets.size(), size = size_of(run);
    const lanes::Buffer left =
        lanes::buffer(2 * static_cast<std::size_t>(run.rows->layout().size()));
    // A tied run's poses see ζ0 through the offsets: theirs is the covariance that counts.
    Eigen::MatrixXd own;
    const auto covariance_of_own = [&] {
      Eigen::MatrixXd t = Eigen::MatrixXd::Zero(offsets + values, covariance.cols());
      t.block(0, begin, offsets, size) = by_unknowns(run);
      t.bottomRightCorner(values, values).setIdentity();
      own = t * covariance * t.transpose();
    };
    const bool valid = sweep(r, false, kBarely, [&](std::size_t b) {
      if (own.size() == 0) covariance_of_own();
      run.elimination.left_over(run.rows->rows(), run.rows->by_offset(), run.rows->by_effect(), own,
                                left.get());
      visit(r, b, left.get());
    });
    if (!valid) return false;
    begin += size;
  }
  return true;
}

}  // namespace cdprcal
