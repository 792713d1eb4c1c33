// The equations of residuals/ for eight poses side by side: what they need, and where they go.
#pragma once

#include <array>
#include <vector>

#include "cdprcal/calibration/channel.hpp"
#include "cdprcal/calibration/pose_evaluation.hpp"

namespace cdprcal {

/// Numbers of a row: six derivatives and the residual.
inline constexpr int kRow = 7;

/// Where things stand; −1 for what no pose has.
struct RowLayout {
  int cables = 0;
  StaticsModel statics = StaticsModel::none;
  bool lengths = false, swivels = false, yaw = false;  ///< read anywhere
  // Slots.
  int roll_pitch = -1, balance = -1, absolute_yaw = -1, direct_length = -1, position = -1;
  // Readings, [index][lane]: NaN where a pose has none. Weights are 1/σ.
  std::array<int, kChannels> reading{}, weight{};
  int tension = -1;
  int numbers = 0;  ///< a batch
};

/// One batch and all it is made from.
struct RowBatch {
  const RowLayout& layout;
  const Robot& robot;
  const std::vector<WrenchRow>& left_inverse_rows;
  const double* offsets;  ///< m(ζ0) + e, one number each
  const double* poses;
  const double* readings;
  const double* whitening;
  double* rows;
  double* by_offset;
  double* values;
  bool& valid;  ///< becomes false where a pose is not
};

/// Evaluates the poses and writes their rows (RowLanes).
void write_batch(const RowBatch& in);

}  // namespace cdprcal
