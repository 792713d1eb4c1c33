// The rows of one pose: whitened residuals of eq. 13 and their derivatives.
#pragma once

#include <algorithm>
#include <array>

#include "cdprcal/readings/channel.hpp"
#include "cdprcal/types.hpp"

namespace cdprcal {

/// Most offsets a run can have: one a length, one a swivel, one for yaw.
inline constexpr int kMostOffsets = 2 * kMaxCables + 1;
using OffsetVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostOffsets, 1>;
/// ∂m/∂ζ of what has an offset (2n+1 × 6): lengths, swivels, yaw.
using OffsetJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMostOffsets, 6>;

/// Most rows one pose can have: lengths, swivels, attitude, balance (of six equations, or a tension
/// a cable), and what absolute sensors read.
inline constexpr int kMostRows =
    2 * kMaxCables + 3 + std::max(6, kMaxCables) + kMostAbsoluteReadings;

/// The whitened rows of one pose. Readings with an offset o see it directly:
/// F = (m(ζ) − reading − o_k) / σ, so ∂F/∂o_k is one number.
struct PoseRows {
  int count = 0;
  std::array<double, kMostRows> residual;
  std::array<std::array<double, 6>, kMostRows> own;  ///< along a world-frame twist of ζ
  std::array<int, kMostRows> slot;                   ///< RowLayout's
  std::array<int, kMostRows> offset;                 ///< which; −1: none
  std::array<double, kMostRows> by_offset;
  std::array<RowLabel, kMostRows> label;
};

}  // namespace cdprcal
