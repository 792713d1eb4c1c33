// Private to estimation/: the rows of eight poses side by side, where every residual is written.
#pragma once

#include <array>
#include <vector>

#include "cdprcal/estimation/pose_rows.hpp"
#include "cdprcal/lanes/vectors.hpp"
#include "cdprcal/model/robot.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {

/// Numbers of a row: six derivatives and the residual.
inline constexpr int kRow = 7;

/// What a row is made from. Slots are numbered alike in all poses of a run; where a pose lacks the
/// reading, its row is zero. The first 2n + 1 are those with offsets: lengths, swivels, yaw.
struct RowSlot {
  Channel channel = Channel::length;
  int component = 0;  ///< cable, angle, axis or wrench row
  bool read = false;  ///< by any pose
  bool angle = false;
  int reading = 0, weight = 0;  ///< where they are in a batch's numbers
};

/// Where things stand in the arrays of a batch.
struct RowLayout {
  int cables = 0;
  StaticsModel statics = StaticsModel::none;  ///< of the poses at rest
  int numbers = 0;                            ///< readings and weights of a batch
  int columns = 0;                            ///< derivatives by values of effects, a row
  std::vector<RowSlot> slots;
  std::array<int, kChannels> first{};  ///< a channel's first slot; −1: nothing reads it

  [[nodiscard]] int offsets() const { return 2 * cables + 1; }
  [[nodiscard]] int size() const { return static_cast<int>(slots.size()); }
  [[nodiscard]] int slot(Channel channel) const { return first[static_cast<std::size_t>(channel)]; }
};

/// What effects look at, of each cable and of the platform: [number][lane].
struct StateNumbers {
  static constexpr int kCable = 23;
  static constexpr int length = 0, swivel = 1, tangency = 2, free = 3, radial_distance = 4,
                       sin_tangency = 5, radial = 6, groove_normal = 9, contact = 12,
                       direction = 15, arm = 18;  // of a cable, vectors x y z
  [[nodiscard]] static constexpr int cable(int index) { return kCable * index; }
  [[nodiscard]] static constexpr int rotation(int cables) { return kCable * cables; }  // 9, by rows
  [[nodiscard]] static constexpr int mass_arm(int cables) { return rotation(cables) + 9; }
  [[nodiscard]] static constexpr int size(int cables) { return mass_arm(cables) + 3; }
};

/// One batch and all it is made from; all arrays [index][lane].
struct RowBatch {
  const RowLayout& layout;
  const Robot& robot;
  const std::vector<WrenchRow>& left_inverse_rows;
  const double* offsets;    ///< one number each, alike in all lanes
  const double* poses;      ///< PoseLanes
  const double* readings;   ///< and weights; NaN: not read
  const double* tension;    ///< at the platform, where the balance is written at tensions [cable]
  const double* whitening;  ///< of the balance [36]
  double* rows;             ///< [slot][6 derivatives, residual]
  double* by_offset;        ///< [offset]
  double* values;           ///< residuals before whitening [slot]; NaN where a pose has none
  double* state;            ///< StateNumbers
  double* columns;          ///< [slot][layout.columns]
  bool& valid;              ///< becomes false where a pose is not
};

/// All of it, where no effect acts on readings or tensions.
void write_rows(const RowBatch& in);

/// The same in three steps, between which effects act. Kinematics: what the model predicts, with
/// derivatives, for every slot but the balance's, and the state.
void predict_geometry(const RowBatch& in);
/// Then the balance at `tension`, or the tensions of the left inverse.
void predict_balance(const RowBatch& in);
/// Then predictions become whitened residuals, in place; so do the columns.
void finish_rows(const RowBatch& in);

}  // namespace cdprcal
