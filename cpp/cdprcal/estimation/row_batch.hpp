// The equations of residuals/ for eight poses side by side: what they need, and where they go.
#pragma once

#include <array>
#include <vector>

#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/readings/channel.hpp"

namespace cdprcal {

/// Numbers of a row: six derivatives and the residual.
inline constexpr int kRow = 7;

/// Where things stand.
struct RowLayout {
  int cables = 0;
  StaticsModel statics = StaticsModel::none;
  int numbers = 0;  ///< of the readings of a batch

  /// One channel's: the first of its slots (−1: no pose reads it); its readings, [index][lane], NaN
  /// where a pose has none (tensions: 0); its weight 1/σ.
  struct Place {
    int slot = -1;
    int reading = 0, weight = 0;
  };
  std::array<Place, kChannels> places;

  [[nodiscard]] Place& operator[](Channel channel) {
    return places[static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] const Place& operator[](Channel channel) const {
    return places[static_cast<std::size_t>(channel)];
  }
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
