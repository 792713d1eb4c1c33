#include "cdprcal/calibration/assembly.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "cdprcal/calibration/residuals/attitude.hpp"
#include "cdprcal/calibration/residuals/length.hpp"
#include "cdprcal/calibration/residuals/reference_error.hpp"
#include "cdprcal/calibration/residuals/swivel.hpp"
#include "cdprcal/calibration/residuals/tension.hpp"
#include "cdprcal/calibration/residuals/wrench.hpp"

namespace cdprcal {
namespace {

using BlockJacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                    kMaxCables, kMaxCables>;

bool any_finite(const CableVector& values) { return values.array().isFinite().any(); }

int count_finite(const CableVector& values) {
  return static_cast<int>(values.array().isFinite().count());
}

ceres::Problem::Options problem_options(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;  // every block is added here, once
  options.evaluation_callback = callback;
  return options;
}

/// The common unknowns are ζ0 and at most 2n + 1 reference errors.
constexpr int kMostCommon = 6 + 2 * kMaxCables + 1;
using PoseByCommon = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMostCommon>;

using RowsByCommon = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                   kMaxCables, kMostCommon>;

/// A⁺B for a symmetric A ≥ 0: Cholesky, or the pseudo-inverse when a pose is not fully determined.
PoseByCommon solve_psd(const Matrix6& a, const PoseByCommon& b) {
  const Eigen::LDLT<Matrix6> ldlt(a);
  const Vector6 pivots = ldlt.vectorD();
  if (pivots.minCoeff() > 1e-10 * pivots.maxCoeff()) return ldlt.solve(b);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(a);
  const Vector6 values = eigen.eigenvalues();
  const double floor = 1e-13 * std::max(values.maxCoeff(), 1e-300);
  const Vector6 inverse =
      values.unaryExpr([floor](double v) { return v > floor ? 1.0 / v : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * (eigen.eigenvectors().transpose() * b);
}

}  // namespace

Assembly::Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess)
    : problem_(problem), cache_(problem, guess) {
  ceres_problem_ = std::make_unique<ceres::Problem>(problem_options(&cache_));
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    ceres_problem_->AddParameterBlock(cache_.block(i), kPoseBlockSize, &manifold_);
  }
  parameter_count_ = 6 * static_cast<int>(cache_.size());
  prepare_reference();

  const SensorSigma& sigma = problem_.robot.sigma;
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    const Measurement& measured = problem_.measurements[i];
    if (i > 0) {
      if (const CableVector m = reading(i, lengths) - base_[lengths]; any_finite(m)) {
        residual_count_ += count_finite(m);
        add(std::make_unique<LengthResidual>(cache_, i, m, sigma.length_m), i, lengths, true);
      }
      if (const CableVector m = reading(i, swivels) - base_[swivels]; any_finite(m)) {
        residual_count_ += count_finite(m);
        add(std::make_unique<SwivelResidual>(cache_, i, m, sigma.swivel_rad), i, swivels, true);
      }
      if (const CableVector m = reading(i, yaw) - base_[yaw]; any_finite(m)) {
        residual_count_ += 1;
        add(std::make_unique<YawResidual>(cache_, i, m, sigma.attitude_rad), i, yaw, true);
      }
    }
    const int absolute_angles =
        static_cast<int>(measured.roll_pitch_yaw_rad.head<2>().array().isFinite().count());
    if (absolute_angles > 0 && (i > 0 || problem_.reference_attitude)) {
      residual_count_ += absolute_angles;
      add(std::make_unique<RollPitchResidual>(cache_, i, measured.roll_pitch_yaw_rad,
                                              sigma.attitude_rad),
          i, kNoGroup, false);
    }
    if (cache_.statics_of(i) == StaticsModel::left_inverse) {
      residual_count_ += problem_.robot.cable_count();
      add(std::make_unique<TensionResidual>(cache_, i, measured.tension_N), i, kNoGroup, false);
    } else if (cache_.statics_of(i) == StaticsModel::wrench) {
      residual_count_ += 6;
      add(std::make_unique<WrenchResidual>(cache_, i), i, kNoGroup, false);
    }
  }
}

CableVector Assembly::reading(std::size_t pose, int group) const {
  const Measurement& m = problem_.measurements[pose];
  if (group == lengths) return m.length_m;
  if (group == swivels) return m.swivel_rad;
  return CableVector::Constant(1, m.roll_pitch_yaw_rad[2]);
}

void Assembly::prepare_reference() {
  const SensorSigma& sigma = problem_.robot.sigma;
  const std::array<double, 3> sigmas{sigma.length_m, sigma.swivel_rad, sigma.attitude_rad};
  for (int group = lengths; group <= yaw; ++group) {
    base_[group] = reading(0, group);
    const Eigen::Index size = base_[group].size();
    reference_error_[group] = CableVector::Zero(size);
    error_is_free_[group] = CableVector::Zero(size);
    CableVector present = CableVector::Zero(size);
    for (Eigen::Index c = 0; c < size; ++c) {
      bool measured_elsewhere = false;
      const bool at_reference = std::isfinite(base_[group][c]);
      for (std::size_t i = 1; i < cache_.size() && !measured_elsewhere; ++i) {
        const double value = reading(i, group)[c];
        measured_elsewhere = std::isfinite(value);
        // Without a reading at the reference, count from the first there is: the offset is free.
        if (measured_elsewhere && !at_reference) base_[group][c] = value;
      }
      present[c] = at_reference ? 1.0 : 0.0;
      const bool estimated = measured_elsewhere && (problem_.reference_noise || !at_reference);
      error_is_free_[group][c] = estimated ? 1.0 : 0.0;
    }
    double* block = reference_error_[group].data();
    ceres_problem_->AddParameterBlock(block, static_cast<int>(size));
    std::vector<int> held;
    for (Eigen::Index c = 0; c < size; ++c) {
      if (error_is_free_[group][c] == 0.0) held.push_back(static_cast<int>(c));
    }
    if (static_cast<Eigen::Index>(held.size()) == size) {
      ceres_problem_->SetParameterBlockConstant(block);
      continue;
    }
    if (!held.empty()) {
      subset_manifolds_.push_back(
          std::make_unique<ceres::SubsetManifold>(static_cast<int>(size), held));
      ceres_problem_->SetManifold(block, subset_manifolds_.back().get());
    }
    parameter_count_ += static_cast<int>(error_is_free_[group].sum());
    if (const CableVector known = present.cwiseProduct(error_is_free_[group]); known.sum() > 0) {
      residual_count_ += static_cast<int>(known.sum());
      add(std::make_unique<ReferenceErrorResidual>(known, sigmas[group]), 0, group, false);
    }
  }
}

void Assembly::add(std::unique_ptr<ceres::CostFunction> cost, std::size_t pose, int group,
                   bool relative) {
  const ceres::CostFunction* kept = cost.get();
  if (relative) {
    ceres_problem_->AddResidualBlock(cost.release(), nullptr, cache_.block(0), cache_.block(pose),
                                     reference_error_[group].data());
  } else if (group != kNoGroup) {
    ceres_problem_->AddResidualBlock(cost.release(), nullptr, reference_error_[group].data());
  } else {
    ceres_problem_->AddResidualBlock(cost.release(), nullptr, cache_.block(pose));
  }
  entries_.push_back({kept, pose, group, relative});
}

std::shared_ptr<ceres::OrderedGroups<double*>> Assembly::elimination_order() {
  auto order = std::make_shared<ceres::OrderedGroups<double*>>();
  for (std::size_t i = 1; i < cache_.size(); ++i) order->AddElementToGroup(cache_.block(i), 0);
  order->AddElementToGroup(cache_.block(0), 1);
  for (auto& error : reference_error_) order->AddElementToGroup(error.data(), 1);
  return order;
}

double Assembly::cost() {
  double cost = kNaN;
  if (!ceres_problem_->Evaluate({}, &cost, nullptr, nullptr, nullptr)) return kNaN;
  return cost;
}

int Assembly::group_offset(int group) const {
  int offset = 6;
  for (int g = lengths; g < group; ++g) offset += static_cast<int>(reference_error_[g].size());
  return offset;
}

int Assembly::common_size() const { return group_offset(yaw + 1); }

namespace {

/// One residual block with its Jacobians with respect to (ζ0 | ζi | e), evaluated from the cache.
/// Of fixed capacity: there are several of these for each of perhaps 100,000 poses.
struct EvaluatedBlock {
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxCables, 1> residual;
  std::array<BlockJacobian, 3> by_block;
  [[nodiscard]] const BlockJacobian& by_error() const { return by_block[blocks - 1]; }
  std::size_t blocks = 0;
};

EvaluatedBlock evaluate_block(const ceres::CostFunction& cost, const double* reference_error) {
  EvaluatedBlock out;
  out.residual.resize(cost.num_residuals());
  const std::array<const double*, 3> parameters{reference_error, reference_error, reference_error};
  std::array<double*, 3> jacobians{};
  for (const int size : cost.parameter_block_sizes()) {
    out.by_block[out.blocks].resize(cost.num_residuals(), size);
    jacobians[out.blocks] = out.by_block[out.blocks].data();
    ++out.blocks;
  }
  if (!cost.Evaluate(parameters.data(), out.residual.data(), jacobians.data())) {
    out.residual.setConstant(kNaN);
  }
  return out;
}

}  // namespace

ReferenceInformation Assembly::reference_information() {
  cache_.PrepareForEvaluation(true, true);
  const int size = common_size();
  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(size, size);
  Matrix6 own = Matrix6::Zero();
  PoseByCommon cross = PoseByCommon::Zero(6, size);
  std::size_t pose = 0;
  ReferenceInformation out;

  const auto eliminate = [&] {
    if (pose != 0) common -= cross.transpose() * solve_psd(own, cross);
    own.setZero();
    cross.setZero();
  };
  for (const Entry& entry : entries_) {  // in the order of poses, as added
    if (entry.pose != pose) {
      eliminate();
      pose = entry.pose;
    }
    const double* error =
        entry.group == kNoGroup ? nullptr : reference_error_[entry.group].data();
    const EvaluatedBlock block = evaluate_block(*entry.cost, error);
    if (!block.residual.allFinite()) return out;
    RowsByCommon by_common = RowsByCommon::Zero(block.residual.size(), size);
    if (entry.group != kNoGroup) {
      by_common.middleCols(group_offset(entry.group), reference_error_[entry.group].size()) =
          block.by_error() * error_is_free_[entry.group].asDiagonal();
    }
    if (entry.relative) by_common.leftCols<6>() = block.by_block[0].leftCols<6>();
    if (entry.group == kNoGroup && entry.pose == 0) {
      by_common.leftCols<6>() = block.by_block[0].leftCols<6>();
    }
    common.noalias() += by_common.transpose() * by_common;
    if (entry.pose != 0) {
      const CableJacobian by_own = block.by_block[entry.relative ? 1 : 0].leftCols<6>();
      own.noalias() += by_own.transpose() * by_own;
      cross.noalias() += by_own.transpose() * by_common;
    }
  }
  eliminate();

  // Reference errors that are held have no columns: keep the free ones only.
  std::vector<int> free;
  for (int group = lengths; group <= yaw; ++group) {
    for (Eigen::Index c = 0; c < error_is_free_[group].size(); ++c) {
      if (error_is_free_[group][c] != 0.0) free.push_back(group_offset(group) + static_cast<int>(c));
    }
  }
  out.information = common.topLeftCorner<6, 6>();
  if (!free.empty()) {
    const auto m = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd errors(m, m), coupling(m, 6);
    for (Eigen::Index i = 0; i < m; ++i) {
      coupling.row(i) = common.row(free[i]).head<6>();
      for (Eigen::Index j = 0; j < m; ++j) errors(i, j) = common(free[i], free[j]);
    }
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
  int rows = 0;
  for (const Entry& entry : entries_) rows += entry.cost->num_residuals();
  const auto poses = static_cast<Eigen::Index>(cache_.size());
  residuals.resize(rows);
  jacobian.setZero(rows, 6 * poses + common_size() - 6);
  Eigen::Index row = 0;
  for (const Entry& entry : entries_) {
    const double* error =
        entry.group == kNoGroup ? nullptr : reference_error_[entry.group].data();
    const EvaluatedBlock block = evaluate_block(*entry.cost, error);
    const Eigen::Index m = block.residual.size();
    residuals.segment(row, m) = block.residual;
    const auto own = 6 * static_cast<Eigen::Index>(entry.pose);
    if (entry.relative) {
      jacobian.block(row, 0, m, 6) = block.by_block[0].leftCols<6>();
      jacobian.block(row, own, m, 6) = block.by_block[1].leftCols<6>();
    } else if (entry.group == kNoGroup) {
      jacobian.block(row, own, m, 6) = block.by_block[0].leftCols<6>();
    }
    if (entry.group != kNoGroup) {
      jacobian.block(row, 6 * poses + group_offset(entry.group) - 6, m,
                     reference_error_[entry.group].size()) =
          block.by_error() * error_is_free_[entry.group].asDiagonal();
    }
    row += m;
  }
}

std::vector<PoseResidual> Assembly::residuals() const {
  std::vector<PoseResidual> out(cache_.size());
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    const PoseEvaluation& pose = cache_[i];
    const Measurement& measured = problem_.measurements[i];
    PoseResidual& r = out[i];
    // At the reference the change is 0: what is left there is its own reading's error.
    r.length_m = pose.length_m - cache_[0].length_m - (measured.length_m - base_[lengths]) -
                 reference_error_[lengths];
    r.swivel_rad = (pose.swivel_rad - cache_[0].swivel_rad -
                    (measured.swivel_rad - base_[swivels]) - reference_error_[swivels])
                       .unaryExpr([](double a) { return wrap_angle(a); });
    r.roll_pitch_yaw_rad =
        (pose.roll_pitch_yaw_rad - measured.roll_pitch_yaw_rad).unaryExpr([](double a) {
          return wrap_angle(a);
        });
    r.roll_pitch_yaw_rad[2] =
        wrap_angle(pose.roll_pitch_yaw_rad[2] - cache_[0].roll_pitch_yaw_rad[2] -
                   (measured.roll_pitch_yaw_rad[2] - base_[yaw][0]) - reference_error_[yaw][0]);
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
