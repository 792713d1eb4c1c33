#include "cdprcal/estimation/assembly.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/estimation/elimination.hpp"
#include "cdprcal/estimation/residuals/pose_rows.hpp"

namespace cdprcal {
namespace {

/// Wide enough for the common unknowns and for a pose's rows.
using PoseByCommon =
    Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, std::max(kMostCommon, kMostRows)>;
using RowsByCommon =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMostRows, kMostCommon>;
using RowsByPose = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMostRows, 6>;

/// A⁺B for a symmetric A ≥ 0: Cholesky, or the pseudo-inverse when a pose is not fully determined.
PoseByCommon solve_psd(const Matrix6& a, const PoseByCommon& b) {
  const Eigen::LDLT<Matrix6> ldlt(a);
  const Vector6 pivots = ldlt.vectorD();
  if (pivots.minCoeff() > 1e-10 * pivots.maxCoeff()) return ldlt.solve(b);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(a);
  const Vector6& values = eigen.eigenvalues();
  const double floor = 1e-13 * std::max(values.maxCoeff(), 1e-300);
  const Vector6 inverse = values.unaryExpr([floor](double v) { return v > floor ? 1.0 / v : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * (eigen.eigenvectors().transpose() * b);
}

/// ∂F/∂(ζ0, e) of rows; at the reference ζ0 is the rows' own pose.
RowsByCommon by_common(const PoseRows& rows, bool at_reference, const OffsetJacobian& by_initial) {
  RowsByCommon out = RowsByCommon::Zero(rows.count, 6 + by_initial.rows());
  for (Eigen::Index i = 0; i < rows.count; ++i) {
    const auto r = static_cast<std::size_t>(i);
    if (const int offset = rows.offset[r]; offset >= 0) {
      out(i, 6 + offset) = rows.by_offset[r];
      if (!at_reference) out.row(i).head<6>() = rows.by_offset[r] * by_initial.row(offset);
    } else if (at_reference) {
      out.row(i).head<6>() = Eigen::Map<const Vector6>(rows.own[r].data()).transpose();
    }
  }
  return out;
}

RowsByPose by_own(const PoseRows& rows) {
  return Eigen::Map<const RowsByPose>(rows.own.front().data(), rows.count, 6);
}

/// The rows of all channels but one.
void keep_others(Channel channel, const PoseRows& all, PoseRows& out) {
  std::size_t kept = 0;
  for (std::size_t r = 0; r < static_cast<std::size_t>(all.count); ++r) {
    if (all.label[r].channel == channel) continue;
    out.own[kept] = all.own[r];
    out.residual[kept] = all.residual[r];
    out.offset[kept] = all.offset[r];
    out.by_offset[kept] = all.by_offset[r];
    ++kept;
  }
  out.count = static_cast<int>(kept);
}

}  // namespace

Assembly::Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess)
    : problem_(problem), cache_(problem, guess), reference_(problem) {
  for (std::size_t i = 0; i < cache_.size(); ++i) residual_count_ += rows_at(i);
  parameter_count_ = 6 * static_cast<int>(cache_.size()) + reference_.free_errors();
}

int Assembly::rows_at(std::size_t index) const {
  static const PoseEvaluation none;
  return row_count({problem_, cache_, reference_, index, none, none, none.roll_pitch_yaw_rad});
}

void Assembly::set_reference_errors(const Eigen::Ref<const Eigen::VectorXd>& errors) {
  if (errors.size() != reference_.size()) {
    throw InputError("reference errors: " + std::to_string(errors.size()) + " values given, " +
                     std::to_string(reference_.size()) + " expected; give lengths, swivels, yaw");
  }
  Eigen::Map<Eigen::VectorXd>(reference_.block(), reference_.size()) = errors;
}

bool Assembly::evaluate_rows(std::size_t index, const Pose& at, const PoseEvaluation& initial,
                             PoseEvaluation& evaluation, PoseRows& rows) const {
  cache_.evaluate(index, at, evaluation);
  return write(index, at, initial, evaluation, rows);
}

bool Assembly::cached_rows(std::size_t index, PoseRows& rows) const {
  return write(index, cache_.pose(index), cache_[0], cache_[index], rows);
}

bool Assembly::write(std::size_t index, const Pose& at, const PoseEvaluation& initial,
                     const PoseEvaluation& evaluation, PoseRows& rows) const {
  rows.count = 0;
  if (!evaluation.valid || !initial.valid) return false;
  write_rows({problem_, cache_, reference_, index, evaluation, initial, at.position_m}, rows);
  return true;
}

RowLanes* Assembly::row_lanes() {
  if (!row_lanes_tried_ && RowLanes::serve(problem_)) {
    row_lanes_.emplace(problem_, cache_, reference_);
    // An equation that they do not know yet: then one pose after the other, which knows all.
    if (row_lanes_->row_count() != residual_count_ - rows_at(0)) row_lanes_.reset();
  }
  row_lanes_tried_ = true;
  return row_lanes_ ? &*row_lanes_ : nullptr;
}

template <typename Single, typename Batch>
bool Assembly::visit(const Single& at, const Batch& batch) {
  RowLanes* const side_by_side = row_lanes();
  if (side_by_side == nullptr) {
    cache_.update();
    PoseRows rows;
    for (std::size_t i = 1; i < cache_.size(); ++i) {
      if (!cached_rows(i, rows)) return false;
      at(i, rows);
    }
    return true;
  }
  cache_.update_initial();
  if (!cache_[0].valid) return false;
  side_by_side->update_weights();
  side_by_side->set_offsets(cache_[0]);
  PoseLanes poses(cache_.size() - 1);
  for (std::size_t i = 1; i < cache_.size(); ++i) poses.set(i - 1, cache_.pose(i));
  for (std::size_t b = 0; b < side_by_side->batches(); ++b) {
    if (!side_by_side->evaluate(b, poses)) return false;
    batch(b);
  }
  return true;
}

double Assembly::cost() {
  const auto squares_of = [](const PoseRows& rows) {
    return Eigen::Map<const Eigen::VectorXd>(rows.residual.data(), rows.count).squaredNorm();
  };
  double squares = 0.0;
  const bool valid = visit([&](std::size_t, const PoseRows& rows) { squares += squares_of(rows); },
                           [&](std::size_t) { squares += row_lanes_->squared_residuals(); });
  PoseRows rows;
  if (!valid || !cached_rows(0, rows)) return kNaN;
  return 0.5 * (squares + squares_of(rows));
}

double Assembly::statics_rms() {
  int count = 0;
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    const StaticsModel statics = cache_.statics_of(i);
    count += statics == StaticsModel::wrench         ? 6
             : statics == StaticsModel::left_inverse ? problem_.robot.cable_count()
                                                     : 0;
  }
  if (count == 0) return 0.0;
  double squares = 0.0;
  const auto add = [&](std::size_t, const PoseRows& rows) {
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
      if (rows.label[r].channel == Channel::balance) squares += rows.residual[r] * rows.residual[r];
    }
  };
  const bool valid =
      visit(add, [&](std::size_t) { squares += row_lanes_->squared_residuals(Channel::balance); });
  PoseRows rows;
  if (!valid || !cached_rows(0, rows)) return kNaN;
  add(0, rows);
  return std::sqrt(squares / count);
}

std::vector<CommonMatrix> Assembly::common_informations(
    const std::vector<std::optional<Channel>>& without) {
  // Just enough for a factor of poses with directions that no reading sees; what those say of the
  // offsets is zero, and stays so.
  constexpr double kBarely = 1e-14;
  const Eigen::Index errors = reference_.size();
  std::vector<CommonMatrix> out(without.size(),
                                CommonMatrix::Constant(6 + errors, 6 + errors, kNaN));
  std::vector<RowSlots> slots;
  std::vector<PoseElimination> eliminations;
  slots.reserve(without.size());
  eliminations.reserve(without.size());
  for (const std::optional<Channel>& channel : without) {
    PoseElimination& elimination =
        eliminations.emplace_back(cache_.size(), reference_.size(), false);
    if (const RowLanes* const side_by_side = row_lanes()) {
      elimination.begin(kBarely, slots.emplace_back(side_by_side->slots(channel)));
    } else {
      elimination.begin(kBarely);
    }
  }
  PoseRows fewer;
  const auto rows_for = [&](std::size_t w, const PoseRows& rows) -> const PoseRows* {
    if (!without[w]) return &rows;
    keep_others(*without[w], rows, fewer);
    return &fewer;
  };
  const auto single = [&](std::size_t, const PoseRows& rows) {
    for (std::size_t w = 0; w < without.size(); ++w) eliminations[w].add(*rows_for(w, rows));
  };
  const auto batch = [&](std::size_t) {
    for (PoseElimination& elimination : eliminations) {
      elimination.add_batch(row_lanes_->rows(), row_lanes_->by_offset());
    }
  };
  PoseRows rows;
  if (!visit(single, batch) || !cached_rows(0, rows)) return out;
  const OffsetJacobian by_initial = offsets_by_initial();
  for (std::size_t w = 0; w < without.size(); ++w) {
    CommonMatrix& common = out[w];
    common = through_offsets(eliminations[w].finish().information, by_initial, true);
    if (const PoseRows& own = *rows_for(w, rows); own.count > 0) {  // the paper's has none at ζ0
      const RowsByCommon first = by_common(own, true, by_initial);
      common.noalias() += first.transpose().lazyProduct(first);
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
  cache_.update();
  const CommonMatrix common = common_informations({std::nullopt}).front();
  if (!common.allFinite()) return {};
  const Eigen::MatrixXd covariance = common.completeOrthogonalDecomposition().pseudoInverse();
  const OffsetJacobian by_initial = offsets_by_initial();
  std::vector<FittedRow> out;
  out.reserve(static_cast<std::size_t>(residual_count_));
  PoseRows rows;
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    cached_rows(i, rows);
    RowsByCommon lifted = by_common(rows, i == 0, by_initial);  // off the pose's own unknowns
    for (int e = 0; e < reference_.size(); ++e) {
      if (!reference_.is_free(e)) lifted.col(6 + e).setZero();
    }
    Eigen::VectorXd leverage = Eigen::VectorXd::Zero(rows.count);
    if (i > 0) {
      const RowsByPose own = by_own(rows);
      const PoseByCommon by_rows = solve_psd(own.transpose() * own, own.transpose());
      leverage = own.cwiseProduct(by_rows.transpose()).rowwise().sum();
      lifted -= own * (by_rows * lifted).eval();
    }
    leverage += (lifted * covariance).cwiseProduct(lifted).rowwise().sum();
    for (Eigen::Index r = 0; r < rows.count; ++r) {
      const auto row = static_cast<std::size_t>(r);
      const RowLabel& label = rows.label[row];
      const double gain =
          label.channel == Channel::balance && cache_.statics_of(i) == StaticsModel::wrench
              ? cache_.tension_gain(i, label.component)
              : 0.0;
      out.push_back({label, i, rows.residual[row], std::clamp(1.0 - leverage[r], 0.0, 1.0), gain});
    }
  }
  return out;
}

ReferenceInformation Assembly::reference_information() {
  return reference_informations({std::nullopt}).front();
}

std::vector<ReferenceInformation> Assembly::reference_informations(
    const std::vector<std::optional<Channel>>& without) {
  std::vector<ReferenceInformation> out;
  out.reserve(without.size());
  for (const CommonMatrix& common : common_informations(without)) {
    out.push_back(of_reference(common, out.empty()));
  }
  return out;
}

ReferenceInformation Assembly::of_reference(const CommonMatrix& common,
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
    const OffsetMatrix errors = common(free, free);
    const OffsetJacobian coupling = common(free, Eigen::seqN(0, 6));
    const Eigen::CompleteOrthogonalDecomposition<OffsetMatrix> decomposition(errors);
    const OffsetJacobian solved = decomposition.solve(coupling);
    out.information -= coupling.transpose().lazyProduct(solved);
  }
  out.information = 0.5 * (out.information + out.information.transpose()).eval();
  if (!with_covariance) return out;
  if (const Eigen::LLT<Matrix6> factor(out.information); is_regular(factor)) {
    out.covariance = factor.solve(Matrix6::Identity());
    return out;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(out.information);
  if (eigen.eigenvalues().minCoeff() > 1e-12 * eigen.eigenvalues().maxCoeff()) {
    out.covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                     eigen.eigenvectors().transpose();
  }
  return out;
}

void Assembly::linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian) {
  cache_.update();
  const auto poses = static_cast<Eigen::Index>(cache_.size());
  residuals.resize(residual_count_);
  jacobian.setZero(residual_count_, 6 * poses + reference_.size());
  PoseRows rows;
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < poses; ++i) {
    const auto index = static_cast<std::size_t>(i);
    if (!cached_rows(index, rows)) {
      const int missing = rows_at(index);
      residuals.segment(row, missing).setConstant(kNaN);
      jacobian.middleRows(row, missing).setConstant(kNaN);
      row += missing;
      continue;
    }
    const RowsByCommon common = by_common(rows, i == 0, offsets_by_initial());
    residuals.segment(row, rows.count) =
        Eigen::Map<const Eigen::VectorXd>(rows.residual.data(), rows.count);
    jacobian.block(row, 0, rows.count, 6) = common.leftCols<6>();
    if (i > 0) jacobian.block(row, 6 * i, rows.count, 6) = by_own(rows);
    for (int e = 0; e < reference_.size(); ++e) {
      if (!reference_.is_free(e)) continue;
      jacobian.block(row, 6 * poses + e, rows.count, 1) = common.col(6 + e);
    }
    row += rows.count;
  }
}

PoseResidual Assembly::residual(std::size_t index) const {
  const PoseEvaluation& pose = cache_[index];
  const PoseEvaluation& initial = cache_[0];
  const Measurement& measured = problem_.measurements[index];
  PoseResidual r;
  // At the reference the change is 0: what is left there is its own reading's error.
  r.length_m = pose.length_m - initial.length_m - (measured.length_m - reference_.length_m) -
               reference_.length_error_m();
  r.swivel_rad = (pose.swivel_rad - initial.swivel_rad -
                  (measured.swivel_rad - reference_.swivel_rad) - reference_.swivel_error_rad())
                     .unaryExpr([](double a) { return wrap_angle(a); });
  r.roll_pitch_yaw_rad =
      (pose.roll_pitch_yaw_rad - measured.roll_pitch_yaw_rad).unaryExpr([](double a) {
        return wrap_angle(a);
      });
  r.roll_pitch_yaw_rad[2] = wrap_angle(pose.roll_pitch_yaw_rad[2] - initial.roll_pitch_yaw_rad[2] -
                                       (measured.roll_pitch_yaw_rad[2] - reference_.yaw_rad) -
                                       reference_.yaw_error_rad());
  if (std::isfinite(measured.absolute_yaw_rad)) {
    r.absolute_yaw_rad = wrap_angle(pose.absolute_yaw_rad - measured.absolute_yaw_rad);
  }
  r.direct_length_m = CableVector::Constant(pose.length_m.size(), kNaN);
  if (measured.direct_length_m.size() == pose.length_m.size()) {
    r.direct_length_m = pose.direct_length_m - measured.direct_length_m;
  }
  r.position_m = cache_.pose(index).position_m - measured.position_m;
  r.tension_N = CableVector::Constant(problem_.robot.cable_count(), kNaN);
  if (cache_.statics_of(index) == StaticsModel::left_inverse) {
    r.tension_N = pose.tension_N - measured.tension_N;
  } else if (cache_.statics_of(index) == StaticsModel::wrench) {
    r.wrench = pose.wrench;
  }
  return r;
}

std::vector<PoseResidual> Assembly::residuals() {
  std::vector<PoseResidual> out(cache_.size());
  visit([&](std::size_t i, const PoseRows&) { out[i] = residual(i); },
        [&](std::size_t b) { row_lanes_->residuals(b, out); });
  cache_.update_initial();
  out[0] = residual(0);
  return out;
}

}  // namespace cdprcal
