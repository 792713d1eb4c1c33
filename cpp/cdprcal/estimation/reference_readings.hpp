// What changes are measured from, and the errors of those readings.
#pragma once

#include "cdprcal/estimation/pose_rows.hpp"
#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Readings at the reference, one for each length, each swivel and the yaw, and one unknown a
/// reading: its error e, in that order. e is free where the formulation estimates it, and where
/// the reference has no reading of a channel that is measured elsewhere (then changes count from
/// the first reading there is, and e is an offset nobody knows).
class ReferenceReadings {
 public:
  explicit ReferenceReadings(const CalibrationProblem& problem);

  CableVector length_m;  ///< NaN: measured nowhere
  CableVector swivel_rad;
  double yaw_rad = kNaN;

  /// Number of unknowns, 2n + 1, and where each is.
  [[nodiscard]] int size() const { return 2 * cables_ + 1; }
  [[nodiscard]] int length_error(int cable) const { return cable; }
  [[nodiscard]] int swivel_error(int cable) const { return cables_ + cable; }
  [[nodiscard]] int yaw_error() const { return 2 * cables_; }

  /// The present errors.
  OffsetVector& errors() { return error_; }
  [[nodiscard]] const OffsetVector& errors() const { return error_; }
  /// What changes count from, in that order.
  [[nodiscard]] OffsetVector base() const;

  /// Whether e is estimated, and whether (then) a reading at the reference says how large it is.
  [[nodiscard]] bool is_free(int index) const { return free_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] bool is_known(int index) const { return known_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] int free_errors() const;

 private:
  /// Decides about the channel read by `reading`; returns what its changes count from.
  template <typename Reading>
  double prepare(const CalibrationProblem& problem, int index, const Reading& reading);

  int cables_;
  OffsetVector error_;
  std::vector<char> free_, known_;
};

}  // namespace cdprcal
