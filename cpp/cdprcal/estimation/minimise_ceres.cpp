#include "cdprcal/estimation/minimise_ceres.hpp"

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/manifold.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <deque>
#include <memory>

#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal {
namespace {

/// Ceres' parameter block of a pose: p, then the quaternion as (x, y, z, w).
constexpr int kBlockSize = 7;
using PoseBlock = Eigen::Matrix<double, kBlockSize, 1>;

PoseBlock to_block(const Pose& pose) {
  PoseBlock block;
  block << pose.position_m, pose.rotation.coeffs();
  return block;
}

Pose from_block(const double* block) {
  Pose pose;
  pose.position_m = Eigen::Map<const Vector3>(block);
  pose.rotation = Eigen::Map<const Eigen::Quaterniond>(block + 3);
  return pose;
}

/// SE(3): seven numbers, six degrees of freedom. x ⊕ δ is geometry's `plus`. The cost functions
/// hand over derivatives along δ directly, in the first six columns of their seven-column blocks,
/// so ∂plus/∂δ is [I₆; 0] by construction: the exact derivative of F(x ⊕ δ) at δ = 0 without the
/// detour through quaternion derivatives. Where guides hold the platform, δ is what they leave of
/// it.
class PoseManifold final : public ceres::Manifold {
 public:
  explicit PoseManifold(const FreeMotion& free) : free_(free) {}
  [[nodiscard]] int AmbientSize() const override { return kBlockSize; }
  [[nodiscard]] int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Vector6 twist = free_.of(Vector6(Eigen::Map<const Vector6>(delta)));
    const PoseBlock block = to_block(plus(from_block(x), twist));
    Eigen::Map<PoseBlock>{x_plus_delta} = block;
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kBlockSize, 6, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6>{y_minus_x} = minus(from_block(y), from_block(x));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kBlockSize, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }

 private:
  const FreeMotion& free_;
};

/// The parameter blocks. Ceres moves them; the assembly follows before costs are asked for.
class State final : public ceres::EvaluationCallback {
 public:
  explicit State(Assembly& assembly) : assembly_(assembly), errors_(assembly.reference_errors()) {
    for (std::size_t i = 0; i < assembly.poses().size(); ++i) {
      poses_.push_back(to_block(assembly.poses().pose(i)));
    }
  }
  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (new_evaluation_point) hand_over();
  }
  void hand_over() {
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      assembly_.poses().set_pose(i, from_block(poses_[i].data()));
    }
    assembly_.set_reference_errors(errors_);
    rows_ = assembly_.rows();
    by_initial_ = assembly_.offsets_by_initial();
  }
  /// Empty where a pose is invalid.
  [[nodiscard]] const std::vector<PoseRows>& rows() const { return rows_; }
  [[nodiscard]] const OffsetJacobian& by_initial() const { return by_initial_; }
  double* pose(std::size_t i) { return poses_[i].data(); }
  double* errors() { return errors_.data(); }

 private:
  Assembly& assembly_;
  std::vector<PoseBlock> poses_;
  Eigen::VectorXd errors_;
  std::vector<PoseRows> rows_;
  OffsetJacobian by_initial_;
};

/// F_i of eq. 13. Parameter blocks: ζi, ζ0, reference errors; at the reference: ζ0, errors.
class PoseCost final : public ceres::CostFunction {
 public:
  PoseCost(const State& state, const Assembly& assembly, std::size_t pose)
      : state_(state), pose_(pose), errors_(assembly.reference().size()) {
    set_num_residuals(assembly.rows_at(pose));
    mutable_parameter_block_sizes()->assign(pose > 0 ? 2 : 1, kBlockSize);
    mutable_parameter_block_sizes()->push_back(errors_);
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    if (state_.rows().empty()) return false;
    const PoseRows& rows = state_.rows()[pose_];
    std::copy_n(rows.residual.data(), rows.count, residuals);
    if (jacobians == nullptr) return true;
    double* const own = jacobians[0];
    double* const initial = pose_ > 0 ? jacobians[1] : jacobians[0];
    double* const errors = jacobians[pose_ > 0 ? 2 : 1];
    if (errors != nullptr) std::fill_n(errors, rows.count * errors_, 0.0);
    for (int i = 0; i < rows.count; ++i) {
      const auto r = static_cast<std::size_t>(i);
      if (own != nullptr) block(own, i).setZero();
      if (initial != nullptr) block(initial, i).setZero();
      if (own != nullptr) block(own, i).head<6>() = Eigen::Map<const Vector6>(rows.own[r].data());
      const int offset = rows.offset[r];
      if (offset < 0) continue;
      if (initial != nullptr) {
        block(initial, i).head<6>() +=
            rows.by_offset[r] * state_.by_initial().row(offset).transpose();
      }
      if (errors != nullptr) errors[i * errors_ + offset] = rows.by_offset[r];
    }
    return true;
  }

 private:
  static Eigen::Map<PoseBlock> block(double* jacobian, int row) {
    return Eigen::Map<PoseBlock>(jacobian + kBlockSize * row);
  }
  const State& state_;
  std::size_t pose_;
  int errors_;
};

/// Ceres says through glog, on stderr, what our status says in words; a program that has set its
/// own level keeps it.
void silence() {
  if (FLAGS_minloglevel == google::GLOG_INFO) FLAGS_minloglevel = google::GLOG_FATAL;
}

}  // namespace

MinimiserSummary minimise_with_ceres(Assembly& assembly, const MinimiserOptions& options) {
  silence();
  const std::size_t poses = assembly.poses().size();
  const ReferenceReadings& reference = assembly.reference();
  State state(assembly);
  PoseManifold manifold(assembly.free_motion());
  std::unique_ptr<ceres::Manifold> free_errors;  // when some errors are held and some are not
  std::deque<PoseCost> costs;                    // never moved: the problem keeps their addresses

  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;  // every block is added here, once
  problem_options.evaluation_callback = &state;
  ceres::Problem problem(problem_options);

  for (std::size_t i = 0; i < poses; ++i) {
    problem.AddParameterBlock(state.pose(i), kBlockSize, &manifold);
  }
  problem.AddParameterBlock(state.errors(), reference.size());
  std::vector<int> held;
  for (int e = 0; e < reference.size(); ++e) {
    if (!reference.is_free(e)) held.push_back(e);
  }
  if (static_cast<int>(held.size()) == reference.size()) {
    problem.SetParameterBlockConstant(state.errors());
  } else if (!held.empty()) {
    free_errors = std::make_unique<ceres::SubsetManifold>(reference.size(), held);
    problem.SetManifold(state.errors(), free_errors.get());
  }
  for (std::size_t i = 0; i < poses; ++i) {
    if (assembly.rows_at(i) == 0) continue;
    costs.emplace_back(state, assembly, i);
    std::vector<double*> blocks{state.pose(i)};
    if (i > 0) blocks.push_back(state.pose(0));
    blocks.push_back(state.errors());
    problem.AddResidualBlock(&costs.back(), nullptr, blocks);
  }

  ceres::Solver::Options solver;
  solver.linear_solver_type = poses > 1 ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  if (poses > 1) {  // poses first, ζ0 and the reference errors last
    solver.linear_solver_ordering = std::make_shared<ceres::OrderedGroups<double*>>();
    for (std::size_t i = 1; i < poses; ++i) {
      solver.linear_solver_ordering->AddElementToGroup(state.pose(i), 0);
    }
    solver.linear_solver_ordering->AddElementToGroup(state.pose(0), 1);
    // A group of its own: within a group the order is that of addresses, and rounding with it.
    solver.linear_solver_ordering->AddElementToGroup(state.errors(), 2);
  }
  solver.logging_type = ceres::SILENT;
  solver.num_threads = 1;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.parameter_tolerance = options.parameter_tolerance;
  solver.gradient_tolerance = options.gradient_tolerance;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  state.hand_over();
  MinimiserSummary out;
  out.usable = summary.IsSolutionUsable();
  out.converged = summary.termination_type == ceres::CONVERGENCE;
  out.evaluations = static_cast<int>(summary.iterations.size());
  if (out.usable) out.cost = summary.final_cost;
  return out;
}

}  // namespace cdprcal
