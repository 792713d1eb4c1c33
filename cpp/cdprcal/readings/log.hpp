// The canonical log: what a robot's own sensors read, sample by sample.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "cdprcal/model/sensors.hpp"
#include "cdprcal/types.hpp"

namespace cdprcal {

using LogMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <int width>
using ColumnsOf = LogMatrix;  ///< [N, width]

/// One row a sample. A matrix without columns, or NaN in a cell: that sensor is absent (there).
/// Lengths, swivels and yaw carry unknown constant offsets; all others are absolute.
struct Log : AbsoluteFields<ColumnsOf> {
  std::string source;            ///< what messages call it
  Eigen::VectorXd time_s;        ///< [N], strictly increasing
  LogMatrix length_m;            ///< [N, n] or [N, 0]
  LogMatrix swivel_rad;          ///< [N, n] or [N, 0]
  LogMatrix tension_N;           ///< [N, n] or [N, 0]
  LogMatrix tension_setpoint_N;  ///< [N, n] or [N, 0]
  LogMatrix roll_pitch_yaw_rad;  ///< [N, 3], NaN columns where absent; or [N, 0]

  [[nodiscard]] Eigen::Index sample_count() const { return time_s.size(); }
  /// Number of cables: the width of the widest per-cable group.
  [[nodiscard]] int cable_count() const;
  /// Its matrices, in the order of kSensorTable, which is that of the file's columns.
  [[nodiscard]] std::array<const LogMatrix*, kLogGroups> groups() const;
  std::array<LogMatrix*, kLogGroups> groups();
};

/// More than 11 hours of eight cables at 100 Hz. The readers refuse more, at once.
inline constexpr std::size_t kMostLogBytes = std::size_t{1} << 30;
inline constexpr std::ptrdiff_t kMostLogLines = 5'000'000;

/// Reads a canonical CSV log. Columns in any order, cells may be empty (absent); lines that start
/// with # are comments.
/// Throws InputError "file:line: column: …" for a missing time column, unknown or duplicate
/// columns, a group with a gap in its cable numbers, text or infinities in a number, a ragged row,
/// time that does not increase, an empty, binary or too large file.
Log read_log(const std::string& path);
Log parse_log(const std::string& text, const std::string& source);

/// Writes the canonical CSV; read_log gives back the same numbers.
std::string format_log(const Log& log);
void write_log(const Log& log, const std::string& path);

/// Checks the shapes and the time of a log built by hand; throws InputError.
void validate(const Log& log);

/// Half-open range of samples.
struct SampleRange {
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
  [[nodiscard]] Eigen::Index size() const { return end - begin; }
};

/// Segments of a log: a gap longer than `gap_s` starts a new one. The last is the run.
std::vector<SampleRange> segments(const Log& log, double gap_s = 2.0);

}  // namespace cdprcal
