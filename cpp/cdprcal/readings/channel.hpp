// Groups of readings that share one noise level.
#pragma once

namespace cdprcal {

enum class Channel {
  length,
  swivel,
  roll_pitch,
  yaw,
  balance,
  absolute_yaw,
  direct_length,
  position
};
inline constexpr int kChannels = 8;
/// The first five are those of the paper's sensors, which effects/ and diagnosis/ know.
inline constexpr int kPaperChannels = 5;
/// "length", "swivel", "roll_pitch", "yaw", "balance", "absolute_yaw", "direct_length", "position".
const char* to_string(Channel channel);

/// Which row of a residual is which reading.
struct RowLabel {
  Channel channel = Channel::length;
  int component = 0;          ///< cable, angle (0 roll, 1 pitch, 2 yaw), axis or wrench row
  bool of_reference = false;  ///< the error of a reading at the reference, not a reading
};

}  // namespace cdprcal
