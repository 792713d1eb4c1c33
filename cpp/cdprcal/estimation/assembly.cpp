#include "cdprcal/estimation/assembly.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/inverse_along.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {
namespace {

using lanes::kLanes;

/// Of rows or offsets, by ζ0 and the reference errors.
using CommonByRow = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  std::max(kMostRows, kMostOffsets), 6 + kMostOffsets>;

/// ∂F/∂(ζ0, e) of rows. At the reference ζ0 is the rows' own pose.
CommonByRow by_common(const PoseRows& rows, bool at_reference, const OffsetJacobian& by_initial) {
  CommonByRow out = CommonByRow::Zero(rows.count, 6 + by_initial.rows());
  for (Eigen::Index i = 0; i < rows.count; ++i) {
    const auto r = static_cast<std::size_t>(i);
    if (const int offset = rows.offset[r]; offset >= 0) {
      out(i, 6 + offset) = rows.by_offset[r];
      // The reference's own m(ζ0) − o is −e: ζ0 drops out.
      if (!at_reference) out.row(i).head<6>() = rows.by_offset[r] * by_initial.row(offset);
    } else if (at_reference) {
      out.row(i).head<6>() = Eigen::Map<const Vector6>(rows.own[r].data()).transpose();
    }
  }
  return out;
}

/// The rows of all channels but one.
PoseRows others(const PoseRows& all, std::optional<Channel> channel) {
  PoseRows out;
  for (std::size_t r = 0; r < static_cast<std::size_t>(all.count); ++r) {
    if (all.label[r].channel == channel) continue;
    const auto kept = static_cast<std::size_t>(out.count++);
    out.own[kept] = all.own[r];
    out.residual[kept] = all.residual[r];
    out.offset[kept] = all.offset[r];
    out.by_offset[kept] = all.by_offset[r];
    out.label[kept] = all.label[r];
  }
  return out;
}

}  // namespace

Assembly::Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess)
    : problem_(problem),
      poses_(problem, guess),
      reference_(problem),
      rows_(poses_.robot(), run_readings(), problem.left_inverse_rows) {
  if (!problem.effects.empty()) rows_.set_effects(poses_.robot(), problem.effects);
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    rows_.set_weights(lane_of(i), poses_.weights(i));
  }
}

RunReadings Assembly::run_readings() const {
  RunReadings out;
  for (std::size_t lane = 0; lane < poses_.size(); ++lane) {
    out.measurements.push_back(&problem_.measurements[measurement_of(lane)]);
    out.statics.push_back(poses_.statics_of(measurement_of(lane)));
  }
  out.base = reference_.base();
  out.reference = lane_of(0);
  out.reference_offsets = 0;
  for (int e = 0; e < reference_.size(); ++e) {
    if (reference_.is_known(e)) out.reference_offsets |= 1U << e;
  }
  out.reference_roll_pitch = problem_.reference_attitude;
  return out;
}

int Assembly::parameter_count() const {
  return freedoms(problem_.robot) * static_cast<int>(poses_.size()) + reference_.free_errors();
}

bool Assembly::may_be_determined() const {
  const int own = freedoms(problem_.robot);
  int spare = rows_at(0) - own - reference_.free_errors();
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    spare += std::max(0, spare_rows(problem_.measurements[i], rows_at(i), own));
  }
  return spare >= 0;
}

void Assembly::set_reference_errors(const Eigen::Ref<const Eigen::VectorXd>& errors) {
  if (errors.size() != reference_.size()) {
    throw InputError("reference errors: " + std::to_string(errors.size()) + " values given, " +
                     std::to_string(reference_.size()) + " expected; give lengths, swivels, yaw");
  }
  reference_.errors() = errors;
}

std::optional<OffsetVector> Assembly::hand_over(PoseLanes& poses) {
  for (std::size_t i = 0; i < poses_.size(); ++i) poses.set(lane_of(i), poses_.pose(i));
  if (weights_version_ != poses_.weights_version()) {
    weights_version_ = poses_.weights_version();
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      rows_.set_tension_weight(lane_of(i), poses_.tension_weight(i));
      if (poses_.statics_of(i) == StaticsModel::wrench) {
        const bool silent = rows_.silent_rows(lane_of(i)) > 0;
        if (silent || (problem_.measurements[i].moves() && !holds_weights_)) {
          rows_.set_balance_sigma(lane_of(i), poses_.balance_sigma(i));
        }
        if (!silent) {
          rows_.set_whitening(lane_of(i), poses_.wrench_whitening(i));
        }
      }
    }
  }
  const PoseEvaluation& initial = rows_.evaluate_alone(lane_of(0), poses_.pose(0));
  if (!initial.valid) return std::nullopt;
  const OffsetVector offsets = offsets_of(initial) + reference_.errors();
  rows_.set_offsets(offsets.data());
  return offsets;
}

void Assembly::weigh_motion(const PoseLanes& poses) {
  if (holds_weights_ || !rows_.any_moves() || problem_.statics != StaticsModel::wrench) return;
  std::vector<std::size_t> lanes;
  std::vector<Pose> at;
  std::vector<BalanceSigma> sigma;
  for (std::size_t lane = 0; lane < poses_.size(); ++lane) {
    const std::size_t i = measurement_of(lane);
    if (!problem_.measurements[i].moves() || poses_.statics_of(i) != StaticsModel::wrench ||
        rows_.silent_rows(lane) > 0) {
      continue;
    }
    lanes.push_back(lane);
    at.push_back(poses[lane]);
    sigma.push_back(poses_.balance_sigma(i));
  }
  const std::vector<Matrix6> roots = inverse_balance_roots(rows_.robot(), at, sigma);
  for (std::size_t k = 0; k < lanes.size(); ++k) {
    if (roots[k].allFinite()) rows_.set_whitening(lanes[k], roots[k]);  // else no row is asked for
  }
}

/// The weights of moments in motion follow their poses.
class Assembly::Weighed : public Estimation {
 public:
  Weighed(Assembly& assembly, std::vector<EstimatedRun> runs)
      : Estimation(std::move(runs), Eigen::VectorXd(0), Eigen::VectorXd(0)), assembly_(assembly) {}

 protected:
  bool prepare(std::size_t, const PoseLanes& poses, const Eigen::VectorXd&) override {
    assembly_.weigh_motion(poses);
    return true;
  }

 private:
  Assembly& assembly_;
};

template <typename Visit>
bool Assembly::visit(const Visit& visit) {
  PoseLanes poses(poses_.size());
  if (!hand_over(poses)) return false;
  for (std::size_t b = 0; b < rows_.batches(); ++b) {
    if (!rows_.evaluate(b, poses)) return false;
    visit(b);
  }
  return true;
}

Estimation& Assembly::estimation(bool hold_initial_pose) {
  if (!estimation_) {
    std::vector<EstimatedRun> runs;
    runs.emplace_back(rows_, 0);
    estimation_ = std::make_unique<Weighed>(*this, std::move(runs));
  }
  EstimatedRun& run = estimation_->runs().front();
  const std::optional<OffsetVector> offsets = hand_over(run.poses);
  if (offsets) run.offsets = *offsets;
  run.free_offsets.clear();
  run.reference = lane_of(0);
  run.hold_reference = hold_initial_pose;
  run.tied = is_tied();
  run.errors = reference_.errors();
  for (int e = 0; e < reference_.size(); ++e) {
    if (reference_.is_free(e)) run.free_offsets.push_back(e);
  }
  return *estimation_;
}

MinimiserSummary Assembly::minimise(const MinimiserOptions& options, bool hold_initial_pose) {
  Estimation& estimation = this->estimation(hold_initial_pose);
  const MinimiserSummary out = cdprcal::minimise(estimation, options);
  if (rows_.any_moves()) weights_version_ = -1;  // what is in the rows may be of a step not taken
  if (!out.usable) return out;
  const EstimatedRun& run = estimation.runs().front();
  for (std::size_t i = 0; i < poses_.size(); ++i) poses_.set_pose(i, run.poses[lane_of(i)]);
  if (run.tied) {
    reference_.errors() = run.errors;
    return out;
  }
  const OffsetVector modelled = offsets_of(rows_.evaluate_alone(lane_of(0), poses_.pose(0)));
  for (const int e : run.free_offsets) {
    reference_.errors()[e] = run.offsets[e] - modelled[e];
    // Angles: an offset found a turn away is the same.
    if (e >= reference_.swivel_error(0)) {
      reference_.errors()[e] = wrap_angle(reference_.errors()[e]);
    }
  }
  return out;
}

double Assembly::cost() {
  double squares = 0.0;
  const bool valid = visit([&](std::size_t) { squares += rows_.squared_residuals(); });
  return valid ? 0.5 * squares : kNaN;
}

double Assembly::statics_rms() {
  int count = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const StaticsModel statics = poses_.statics_of(i);
    count += statics == StaticsModel::wrench         ? 6 - rows_.silent_rows(lane_of(i))
             : statics == StaticsModel::left_inverse ? problem_.robot.cable_count()
                                                     : 0;
  }
  if (count == 0) return 0.0;
  double squares = 0.0;
  const bool valid =
      visit([&](std::size_t) { squares += rows_.squared_residuals(Channel::balance); });
  return valid ? std::sqrt(squares / count) : kNaN;
}

OffsetJacobian Assembly::offsets_by_initial() const {
  const PoseEvaluation& initial = rows_.evaluate_alone(lane_of(0), poses_.pose(0));
  if (!initial.valid) return OffsetJacobian::Constant(reference_.size(), 6, kNaN);
  return rows_.offsets_by_twist(initial);
}

const PartialBalance* Assembly::partial_balance(std::size_t measurement) const {
  const std::size_t lane = lane_of(measurement);
  const bool partial =
      poses_.statics_of(measurement) == StaticsModel::wrench && rows_.silent_rows(lane) > 0;
  return partial ? &rows_.partial_balance_of(lane) : nullptr;
}

namespace {

/// Covariance of a pose by its own rows, that of what they count from included.
Matrix6 covariance_of(const PoseRows& rows, const Eigen::MatrixXd& offsets) {
  Matrix6 information = Matrix6::Zero();
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(6, offsets.rows());
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
    const Eigen::Map<const Vector6> own(rows.own[r].data());
    information += own * own.transpose();
    if (rows.offset[r] >= 0) coupling.col(rows.offset[r]) += rows.by_offset[r] * own;
  }
  const Matrix6 inverse = pseudo_inverse(information);
  const Eigen::MatrixXd passed = inverse * coupling;
  return inverse + passed * offsets * passed.transpose();
}

}  // namespace

std::optional<Assembly::Push> Assembly::hardest_push() {
  constexpr double kBelieved = 4.0;  // σ: once in thirty thousand tensions by chance
  std::optional<Push> out;
  if (!rows_.any_silent()) return out;
  const std::vector<PoseRows> all = rows();
  const Eigen::MatrixXd free = estimation(false).covariance();
  if (all.empty() || !free.allFinite()) return out;
  Eigen::MatrixXd offsets = Eigen::MatrixXd::Zero(reference_.size(), reference_.size());
  const std::vector<int>& which = estimation_->runs().front().free_offsets;
  const Eigen::Index first = free.rows() - static_cast<Eigen::Index>(which.size());
  for (std::size_t i = 0; i < which.size(); ++i) {
    for (std::size_t j = 0; j < which.size(); ++j) {
      offsets(which[i], which[j]) =
          free(first + static_cast<Eigen::Index>(i), first + static_cast<Eigen::Index>(j));
    }
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const PartialBalance* const at = partial_balance(i);
    if (at == nullptr) continue;
    const PlatformState state = platform_state(poses_.robot(), poses_.pose(i));
    const BalanceSigma sigma = poses_.balance_sigma(i);
    const Matrix6 k = stiffness(poses_.robot(), state, at->tension_N);
    Matrix6 wrench = k * covariance_of(all[i], offsets) * k.transpose();
    wrench.diagonal() += sigma.wrench.cwiseAbs2();
    for (int c = 0; c < problem_.robot.cable_count(); ++c) {
      const Vector6 by_wrench = at->tension_by_wrench.row(c);
      const double sigma_N = std::sqrt(by_wrench.dot(wrench * by_wrench));
      const double force_N = -at->tension_N[c] - kBelieved * sigma_N;
      if (!std::isfinite(problem_.measurements[i].tension_N[c]) && force_N > 0.0 &&
          (!out || force_N > out->force_N)) {
        out = Push{i, c, force_N};
      }
    }
  }
  return out;
}

std::vector<PoseRows> Assembly::rows() {
  std::vector<PoseRows> out(poses_.size());
  const bool valid = visit([&](std::size_t b) {
    for (const std::size_t i : poses_of(b, poses_.size())) {
      rows_.take(i, out[measurement_of(i)]);
    }
  });
  if (!valid) out.clear();
  return out;
}

std::vector<Eigen::MatrixXd> Assembly::common_informations(
    const std::vector<std::optional<Channel>>& without) {
  const Eigen::Index errors = reference_.size();
  std::vector<Eigen::MatrixXd> out(without.size(),
                                   Eigen::MatrixXd::Constant(6 + errors, 6 + errors, kNaN));
  std::vector<std::vector<int>> slots;
  std::vector<PoseElimination> eliminations;
  slots.reserve(without.size());
  eliminations.reserve(without.size());
  for (const std::optional<Channel>& channel : without) {
    slots.push_back(rows_.slots(channel));
    eliminations.emplace_back(poses_.size(), reference_.size(), 0, false,
                              rows_.free_motion().across());
    eliminations.back().begin(kBarely, slots.back());
  }
  PoseRows own;
  const bool valid = visit([&](std::size_t b) {
    if (b == lane_of(0) / kLanes) {
      rows_.take(lane_of(0), own);
      rows_.forget(lane_of(0) % kLanes);
    }
    for (PoseElimination& elimination : eliminations) {
      elimination.add(rows_.rows(), rows_.by_offset(), rows_.by_effect());
    }
  });
  if (!valid) return out;
  const OffsetJacobian by_initial = offsets_by_initial();
  for (std::size_t w = 0; w < without.size(); ++w) {
    Eigen::MatrixXd& common = out[w];
    // Offsets are those of ζ0 plus the errors e: ∂o/∂(ζ0, e) = [by_initial, 1].
    const Eigen::MatrixXd& information = eliminations[w].finish().information;
    const Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMostOffsets> half =
        by_initial.transpose().lazyProduct(information);
    common.topLeftCorner<6, 6>() = half.lazyProduct(by_initial);
    common.topRightCorner(6, errors) = half;
    common.bottomLeftCorner(errors, 6) = half.transpose();
    common.bottomRightCorner(errors, errors) = information;
    if (own.count > 0) {  // the paper's has none at ζ0
      const CommonByRow first = by_common(others(own, without[w]), true, by_initial);
      common += first.transpose().lazyProduct(first);
    }
    for (int e = 0; e < reference_.size(); ++e) {
      if (reference_.is_free(e)) continue;
      common.row(6 + e).setZero();
      common.col(6 + e).setZero();
    }
  }
  return out;
}

std::vector<FittedRow> Assembly::fitted_rows() {
  Estimation& estimation = this->estimation(false);
  const Eigen::MatrixXd covariance = estimation.covariance();
  if (!covariance.allFinite()) return {};
  const std::size_t reference = lane_of(0);
  std::vector<std::vector<FittedRow>> by_measurement(poses_.size());
  const auto add = [&](std::size_t lane, const PoseRows& rows, const auto& freedom) {
    const std::size_t i = measurement_of(lane);
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
      RowLabel label = rows.label[r];
      label.of_reference = i == 0 && rows.offset[r] >= 0;
      double gain = 0.0, inertial = 0.0;
      if (label.channel == Channel::balance && poses_.statics_of(i) == StaticsModel::wrench) {
        const PartialBalance* const partial = partial_balance(i);
        gain = partial != nullptr ? partial->tension_gain[label.component]
                                  : poses_.tension_gain(i, label.component);
        const Matrix6& whitening =
            partial != nullptr ? partial->whitening : poses_.wrench_whitening(i);
        inertial = poses_.inertial_share(i, whitening.row(label.component));
      }
      by_measurement[i].push_back(
          {label, i, rows.residual[r], std::clamp(freedom(r), 0.0, 1.0), gain, inertial});
    }
  };
  PoseRows rows;
  const bool valid =
      estimation.left_over(covariance, [&](std::size_t, std::size_t b, const double* left) {
        for (const std::size_t i : poses_of(b, poses_.size())) {
          if (is_tied() && i == reference) continue;
          rows_.take(i, rows);
          add(i, rows, [&](std::size_t r) {
            return left[(2 * static_cast<std::size_t>(rows.slot[r]) + 1) * kLanes + i % kLanes];
          });
        }
      });
  if (!valid) return {};
  if (is_tied()) {  // there ζ0 is no block: its own rows see it directly
    rows = estimation.reference_rows();
    add(reference, rows, [&](std::size_t r) {
      const Eigen::Map<const Vector6> row(rows.own[r].data());
      return 1.0 - row.dot(covariance.topLeftCorner<6, 6>() * row);
    });
  }
  std::vector<FittedRow> out;
  for (const auto& some : by_measurement) out.insert(out.end(), some.begin(), some.end());
  return out;
}

ReferenceInformation Assembly::reference_information() {
  return reference_informations({std::nullopt}).front();
}

std::vector<ReferenceInformation> Assembly::reference_informations(
    const std::vector<std::optional<Channel>>& without) {
  std::vector<ReferenceInformation> out;
  out.reserve(without.size());
  for (const Eigen::MatrixXd& common : common_informations(without)) {
    out.push_back(of_reference(common, out.empty()));
  }
  return out;
}

ReferenceInformation Assembly::of_reference(const Eigen::MatrixXd& common,
                                            bool with_covariance) const {
  ReferenceInformation out;
  if (!common.allFinite()) return out;

  // Reference errors that are held have no columns: keep the free ones only.
  std::vector<int> free;
  for (int e = 0; e < reference_.size(); ++e) {
    if (reference_.is_free(e)) free.push_back(6 + e);
  }
  out.information = common.topLeftCorner<6, 6>();
  if (!free.empty()) {
    const Eigen::MatrixXd errors = common(free, free);
    const Eigen::MatrixXd coupling = common(free, Eigen::seqN(0, 6));
    out.information -= coupling.transpose().lazyProduct(least_norm(errors, coupling));
  }
  out.information = 0.5 * (out.information + out.information.transpose()).eval();
  if (!with_covariance) return out;
  if (!is_guided(problem_.robot)) {
    if (const Eigen::LLT<Matrix6> factor(out.information); is_regular(factor)) {
      out.covariance = factor.solve(Matrix6::Identity());
      return out;
    }
  }
  out.covariance = inverse_along(motion_basis(problem_.robot), out.information);
  return out;
}

void Assembly::linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian) {
  const auto poses = static_cast<Eigen::Index>(poses_.size());
  residuals.setConstant(residual_count(), kNaN);
  jacobian.setConstant(residual_count(), 6 * poses + reference_.size(), kNaN);
  const std::vector<PoseRows> all = rows();
  if (all.empty()) return;
  jacobian.setZero();
  const OffsetJacobian by_initial = offsets_by_initial();
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < poses; ++i) {
    const PoseRows& rows = all[static_cast<std::size_t>(i)];
    const Eigen::MatrixXd common = by_common(rows, i == 0, by_initial);
    jacobian.block(row, 0, rows.count, 6) = common.leftCols<6>();
    for (Eigen::Index k = 0; k < rows.count; ++k) {
      const auto r = static_cast<std::size_t>(k);
      // At the reference m(ζ0) − o is −e, whatever ζ0.
      const bool of_error = i == 0 && rows.offset[r] >= 0;
      residuals[row + k] =
          of_error ? rows.by_offset[r] * reference_.errors()[rows.offset[r]] : rows.residual[r];
      if (i > 0) {
        jacobian.block<1, 6>(row + k, 6 * i) =
            Eigen::Map<const Vector6>(rows.own[r].data()).transpose();
      }
    }
    for (int e = 0; e < reference_.size(); ++e) {
      if (!reference_.is_free(e)) continue;
      jacobian.block(row, 6 * poses + e, rows.count, 1) = common.col(6 + e);
    }
    row += rows.count;
  }
}

void Assembly::complete_reference(PoseResidual& r) const {
  const PoseEvaluation& pose = rows_.evaluate_alone(lane_of(0), poses_.pose(0));
  const Measurement& measured = problem_.measurements[0];
  const int n = problem_.robot.cable_count();
  if (!pose.valid) return;
  // The change is 0: what is left is its own reading's error.
  const OffsetVector& error = reference_.errors();
  r.length_m = -(measured.length_m - reference_.length_m) - error.head(n);
  r.swivel_rad = (-(measured.swivel_rad - reference_.swivel_rad) - error.segment(n, n))
                     .unaryExpr([](double a) { return wrap_angle(a); });
  r.roll_pitch_yaw_rad =
      (pose.roll_pitch_yaw_rad - measured.roll_pitch_yaw_rad).unaryExpr([](double a) {
        return wrap_angle(a);
      });
  r.roll_pitch_yaw_rad[2] =
      wrap_angle(-(measured.roll_pitch_yaw_rad[2] - reference_.yaw_rad) - error[2 * n]);
}

std::vector<PoseResidual> Assembly::residuals() {
  std::vector<PoseResidual> out(poses_.size());
  visit([&](std::size_t b) {
    for (const std::size_t i : poses_of(b, poses_.size())) {
      rows_.write_residual(i, out[measurement_of(i)]);
    }
  });
  complete_reference(out.front());
  return out;
}

}  // namespace cdprcal
