// All equations of one pose as one Ceres cost function.
#pragma once

#include <ceres/cost_function.h>

#include "cdprcal/calibration/residuals/absolute_yaw.hpp"
#include "cdprcal/calibration/residuals/attitude.hpp"
#include "cdprcal/calibration/residuals/direct_length.hpp"
#include "cdprcal/calibration/residuals/length.hpp"
#include "cdprcal/calibration/residuals/position.hpp"
#include "cdprcal/calibration/residuals/reference_error.hpp"
#include "cdprcal/calibration/residuals/swivel.hpp"
#include "cdprcal/calibration/residuals/tension.hpp"
#include "cdprcal/calibration/residuals/wrench.hpp"

namespace cdprcal {

/// Most rows one pose can have: lengths, swivels, attitude, statics or reference errors, and what
/// absolute sensors read.
inline constexpr int kMostRows = 5 * kMaxCables + 4 + 6 + 4;

/// Calls `visit.operator()<Term>()` for every equation, in the order of its rows. A new equation is
/// a file beside the others and a line here.
template <typename Visit>
void for_each_term(const Visit& visit) {
  visit.template operator()<LengthTerm>();
  visit.template operator()<SwivelTerm>();
  visit.template operator()<YawTerm>();
  visit.template operator()<RollPitchTerm>();
  visit.template operator()<TensionTerm>();
  visit.template operator()<WrenchTerm>();
  visit.template operator()<AbsoluteYawTerm>();
  visit.template operator()<DirectLengthTerm>();
  visit.template operator()<PositionTerm>();
  visit.template operator()<ReferenceErrorTerm>();
}

/// F_i of eq. 13. One block a pose, not one an equation: Ceres' own work a block is several times
/// that of the equations in it. Parameter blocks: ζi, ζ0, reference errors; at the reference
/// itself: ζ0, reference errors. Values come from the cache, which Ceres keeps at its state.
class PoseCost final : public ceres::CostFunction {
 public:
  PoseCost(const CalibrationProblem& problem, const PoseCache& cache,
           const ReferenceReadings& reference, std::size_t pose)
      : input_{problem, cache, reference, pose} {
    int rows = 0;
    for_each_term([&]<typename Term>() { rows += Term::rows(input_); });
    set_num_residuals(rows);
    *mutable_parameter_block_sizes() = {kPoseBlockSize};
    if (pose > 0) mutable_parameter_block_sizes()->push_back(kPoseBlockSize);
    mutable_parameter_block_sizes()->push_back(reference.size());
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const bool at_reference = input_.index == 0;
    if (!input_.pose().valid || !input_.initial().valid) return false;
    double* const own = jacobians != nullptr ? jacobians[0] : nullptr;
    double* const initial = jacobians != nullptr && !at_reference ? jacobians[1] : nullptr;
    double* const error = jacobians != nullptr ? jacobians[at_reference ? 1 : 2] : nullptr;
    RowWriter rows(residuals, own, initial, error, num_residuals(), input_.reference.size());
    for_each_term([&]<typename Term>() { Term::write(input_, rows); });
    return true;
  }

  /// Which reading each row is, in the order of the rows. Needs an evaluated, valid state.
  [[nodiscard]] std::vector<RowLabel> labels() const {
    std::array<double, kMostRows> residuals;
    std::vector<RowLabel> out(static_cast<std::size_t>(num_residuals()));
    RowWriter rows(residuals.data(), nullptr, nullptr, nullptr, num_residuals(), 0);
    rows.label_rows(out.data());
    for_each_term([&]<typename Term>() { Term::write(input_, rows); });
    return out;
  }

 private:
  const TermInput input_;
};

}  // namespace cdprcal
