// What a calibration knows of every reading: where it counts from, how well, and its noise.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/motion/geometric_readings.hpp"

namespace cdprcal {

/// Of each geometric reading that a calibration has, and behind them of an inertial unit's: reading
/// = model + offset + what is wrong with it at this place + noise from sample to sample.
struct KnownOffsets {
  struct Row {
    RowLabel label;
    Eigen::Index reading = 0;  ///< its place in geometric_rows() or inertial_rows()
    bool angle = false;
    bool inertial = false;
  };
  std::vector<Row> rows;
  ReadingVector offset;                     ///< one a row; 0 for what is absolute
  ReadingMatrix covariance;                 ///< of the offset and of what is wrong at a place
  ReadingVector sample_variance;            ///< white, of one fresh reading
  ReadingVector rounding_variance;          ///< what rounding leaves in a mean while nothing moves
  std::array<bool, kChannels> is_held{};    ///< logged faster than it reads
  std::array<double, kChannels> repeats{};  ///< share of readings that say the last one again
  double run_start_s = 0.0;
};

/// Of a calibration that converged. An offset is what the reference reads less what the model says
/// at ζ0: as uncertain as ζ0, and by the noise of the reference, which the other poses average
/// out. Readings do not change it any more: those of the run are in it already. An absolute reading
/// may be off by what ζ0 is known worse than its noise says.
/// Throws InputError where the calibration has no pose that can be trusted.
KnownOffsets known_offsets(const Calibration& calibration);

}  // namespace cdprcal
