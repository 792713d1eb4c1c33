#include "cdprcal/calibration/assembly.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

ceres::Problem::Options problem_options(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;  // every block is added here, once
  options.evaluation_callback = callback;
  return options;
}

/// The common unknowns are ζ0 and 2n + 1 reference errors.
constexpr int kMostCommon = 6 + 2 * kMaxCables + 1;
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

}  // namespace

struct Assembly::EvaluatedBlock {
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostRows, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, kPoseBlockSize, Eigen::RowMajor, kMostRows, kPoseBlockSize>
      own, initial;  ///< at the reference itself only `own` is filled
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMostRows,
                2 * kMaxCables + 1>
      error;
  void drop(Eigen::Index row) {
    own.row(row).setZero();
    if (initial.rows() > 0) initial.row(row).setZero();
    error.row(row).setZero();
  }
  /// Derivatives by ζ0 and the reference errors. `own` is that by ζ0 at the reference.
  [[nodiscard]] RowsByCommon by_common() const {
    RowsByCommon out(residual.size(), 6 + error.cols());
    out.leftCols<6>() = (initial.rows() == residual.size() ? initial : own).leftCols<6>();
    out.rightCols(error.cols()) = error;
    return out;
  }
};

Assembly::Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess)
    : problem_(problem), cache_(problem, guess), reference_(problem) {
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    costs_.emplace_back(problem_, cache_, reference_, i);
    residual_count_ += costs_.back().num_residuals();
  }
  parameter_count_ = 6 * static_cast<int>(cache_.size()) + reference_.free_errors();

  ceres_problem_ = std::make_unique<ceres::Problem>(problem_options(&cache_));
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    ceres_problem_->AddParameterBlock(cache_.block(i), kPoseBlockSize, &manifold_);
  }
  hold_reference_errors();
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    if (costs_[i].num_residuals() == 0) continue;
    if (i == 0) {
      ceres_problem_->AddResidualBlock(&costs_[i], nullptr, cache_.block(0), reference_.block());
    } else {
      ceres_problem_->AddResidualBlock(&costs_[i], nullptr, cache_.block(i), cache_.block(0),
                                       reference_.block());
    }
  }
}

void Assembly::hold_reference_errors() {
  ceres_problem_->AddParameterBlock(reference_.block(), reference_.size());
  std::vector<int> held;
  for (int e = 0; e < reference_.size(); ++e) {
    if (!reference_.is_free(e)) held.push_back(e);
  }
  if (held.empty()) return;
  if (static_cast<int>(held.size()) == reference_.size()) {
    ceres_problem_->SetParameterBlockConstant(reference_.block());
    return;
  }
  free_errors_ = std::make_unique<ceres::SubsetManifold>(reference_.size(), held);
  ceres_problem_->SetManifold(reference_.block(), free_errors_.get());
}

std::shared_ptr<ceres::OrderedGroups<double*>> Assembly::elimination_order() {
  auto order = std::make_shared<ceres::OrderedGroups<double*>>();
  for (std::size_t i = 1; i < cache_.size(); ++i) order->AddElementToGroup(cache_.block(i), 0);
  order->AddElementToGroup(cache_.block(0), 1);
  // A group of its own: within a group the order is that of addresses, and rounding with it.
  order->AddElementToGroup(reference_.block(), 2);
  return order;
}

void Assembly::set_reference_errors(const Eigen::VectorXd& errors) {
  if (errors.size() != reference_.size()) {
    throw InputError("reference errors: " + std::to_string(errors.size()) + " values given, " +
                     std::to_string(reference_.size()) + " expected (lengths, swivels, yaw)");
  }
  Eigen::Map<Eigen::VectorXd>(reference_.block(), reference_.size()) = errors;
}

double Assembly::cost() {
  double cost = kNaN;
  if (!ceres_problem_->Evaluate({}, &cost, nullptr, nullptr, nullptr)) return kNaN;
  return cost;
}

Assembly::EvaluatedBlock Assembly::evaluate(std::size_t pose) const {
  const PoseCost& cost = costs_[pose];
  const int rows = cost.num_residuals();
  EvaluatedBlock out;
  out.residual.resize(rows);
  out.own.resize(rows, kPoseBlockSize);
  out.initial.resize(pose == 0 ? 0 : rows, kPoseBlockSize);
  out.error.resize(rows, reference_.size());
  double* const at_reference[] = {out.own.data(), out.error.data()};
  double* const elsewhere[] = {out.own.data(), out.initial.data(), out.error.data()};
  if (!cost.Evaluate(nullptr, out.residual.data(),
                     const_cast<double**>(pose == 0 ? at_reference : elsewhere))) {
    out.residual.setConstant(kNaN);
    out.own.setConstant(kNaN);
    out.initial.setConstant(kNaN);
    out.error.setConstant(kNaN);
  }
  for (int e = 0; e < reference_.size(); ++e) {
    if (!reference_.is_free(e)) out.error.col(e).setZero();
  }
  return out;
}

Eigen::MatrixXd Assembly::common_information(std::optional<Channel> without) const {
  const int size = 6 + reference_.size();
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    EvaluatedBlock block = evaluate(i);
    if (without && block.residual.allFinite()) {
      const std::vector<RowLabel> labels = costs_[i].labels();
      for (Eigen::Index r = 0; r < block.residual.size(); ++r) {
        if (labels[static_cast<std::size_t>(r)].channel == *without) block.drop(r);
      }
    }
    const RowsByCommon by_common = block.by_common();
    // lazyProduct: these are too small for blocking to pay.
    common.noalias() += by_common.transpose().lazyProduct(by_common);
    if (!block.residual.allFinite()) common.setConstant(kNaN);
    if (i == 0 || !common.allFinite()) continue;
    const RowsByPose by_own = block.own.leftCols<6>();
    const Matrix6 own = by_own.transpose().lazyProduct(by_own);
    const PoseByCommon cross = by_own.transpose().lazyProduct(by_common);
    common.noalias() -= cross.transpose().lazyProduct(solve_psd(own, cross));
  }
  return common;
}

std::vector<FittedRow> Assembly::fitted_rows() {
  cache_.PrepareForEvaluation(true, true);
  const Eigen::MatrixXd common = common_information();
  if (!common.allFinite()) return {};
  const Eigen::MatrixXd covariance = common.completeOrthogonalDecomposition().pseudoInverse();
  std::vector<FittedRow> rows;
  rows.reserve(static_cast<std::size_t>(residual_count_));
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    const EvaluatedBlock block = evaluate(i);
    const std::vector<RowLabel> labels = costs_[i].labels();
    RowsByCommon lifted = block.by_common();  // off the pose's own unknowns
    Eigen::VectorXd leverage = Eigen::VectorXd::Zero(block.residual.size());
    if (i > 0) {
      const RowsByPose own = block.own.leftCols<6>();
      const PoseByCommon by_rows = solve_psd(own.transpose() * own, own.transpose());
      leverage = own.cwiseProduct(by_rows.transpose()).rowwise().sum();
      lifted -= own * (by_rows * lifted).eval();
    }
    leverage += (lifted * covariance).cwiseProduct(lifted).rowwise().sum();
    for (Eigen::Index r = 0; r < block.residual.size(); ++r) {
      const RowLabel& label = labels[static_cast<std::size_t>(r)];
      const double gain =
          label.channel == Channel::balance && cache_.statics_of(i) == StaticsModel::wrench
              ? cache_.tension_gain(i, label.component)
              : 0.0;
      rows.push_back({label, i, block.residual[r], std::clamp(1.0 - leverage[r], 0.0, 1.0), gain});
    }
  }
  return rows;
}

ReferenceInformation Assembly::reference_information(std::optional<Channel> without) {
  cache_.PrepareForEvaluation(true, true);
  const Eigen::MatrixXd common = common_information(without);
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
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition(errors);
    out.information -= coupling.transpose() * decomposition.solve(coupling);
  }
  out.information = 0.5 * (out.information + out.information.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(out.information);
  if (eigen.eigenvalues().minCoeff() > 1e-12 * eigen.eigenvalues().maxCoeff()) {
    out.covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                     eigen.eigenvectors().transpose();
  }
  return out;
}

void Assembly::linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian) {
  cache_.PrepareForEvaluation(true, true);
  const auto poses = static_cast<Eigen::Index>(cache_.size());
  residuals.resize(residual_count_);
  jacobian.setZero(residual_count_, 6 * poses + reference_.size());
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < poses; ++i) {
    const EvaluatedBlock block = evaluate(static_cast<std::size_t>(i));
    const Eigen::Index rows = block.residual.size();
    residuals.segment(row, rows) = block.residual;
    jacobian.block(row, 6 * i, rows, 6) = block.own.leftCols<6>();
    if (i > 0) jacobian.block(row, 0, rows, 6) = block.initial.leftCols<6>();
    jacobian.block(row, 6 * poses, rows, reference_.size()) = block.error;
    row += rows;
  }
}

std::vector<PoseResidual> Assembly::residuals() const {
  std::vector<PoseResidual> out(cache_.size());
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    const PoseEvaluation& pose = cache_[i];
    const Measurement& measured = problem_.measurements[i];
    PoseResidual& r = out[i];
    // At the reference the change is 0: what is left there is its own reading's error.
    r.length_m = pose.length_m - cache_[0].length_m - (measured.length_m - reference_.length_m) -
                 reference_.length_error_m();
    r.swivel_rad = (pose.swivel_rad - cache_[0].swivel_rad -
                    (measured.swivel_rad - reference_.swivel_rad) - reference_.swivel_error_rad())
                       .unaryExpr([](double a) { return wrap_angle(a); });
    r.roll_pitch_yaw_rad =
        (pose.roll_pitch_yaw_rad - measured.roll_pitch_yaw_rad).unaryExpr([](double a) {
          return wrap_angle(a);
        });
    r.roll_pitch_yaw_rad[2] = wrap_angle(
        pose.roll_pitch_yaw_rad[2] - cache_[0].roll_pitch_yaw_rad[2] -
        (measured.roll_pitch_yaw_rad[2] - reference_.yaw_rad) - reference_.yaw_error_rad());
    if (std::isfinite(measured.absolute_yaw_rad)) {
      r.absolute_yaw_rad = wrap_angle(pose.roll_pitch_yaw_rad[2] - measured.absolute_yaw_rad);
    }
    r.direct_length_m = CableVector::Constant(pose.length_m.size(), kNaN);
    if (measured.direct_length_m.size() == pose.length_m.size()) {
      r.direct_length_m = pose.length_m - measured.direct_length_m;
    }
    r.position_m = cache_.pose(i).position_m - measured.position_m;
    r.tension_N = CableVector::Constant(problem_.robot.cable_count(), kNaN);
    if (cache_.statics_of(i) == StaticsModel::left_inverse) {
      r.tension_N = pose.tension_N - measured.tension_N;
    } else if (cache_.statics_of(i) == StaticsModel::wrench) {
      r.wrench = pose.wrench;
    }
  }
  return out;
}

}  // namespace cdprcal
