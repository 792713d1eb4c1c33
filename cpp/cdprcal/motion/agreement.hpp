// Whether readings of one moment belong to any pose, however the platform moves; and which do not.
#pragma once

#include <vector>

#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/motion/known_offsets.hpp"

namespace cdprcal {

/// What readings say against one another.
struct Disagreement {
  bool contradicts = false;        ///< beyond chance, and the pose is wrong for it
  std::vector<Eigen::Index> rows;  ///< those that must be wrong; empty: it cannot be told
};

/// Of `misfits` (one a row of the offsets, NaN: not read) near a pose, the derivatives by it
/// (GeometricReadings), and what each is wrong by from sample to sample beside what is considered.
/// What no pose explains of them is χ²; a reading, or all of one sensor, is told where leaving it
/// out makes the others agree and leaving out another does so far worse (data snooping: Baarda
/// 1968). What moves the pose by no more than twice its σ does no harm.
class Agreement {
 public:
  Agreement(const KnownOffsets& offsets, const FreeMotion& free, double size_m);
  [[nodiscard]] Disagreement of(const ReadingVector& misfits, const ReadingsByPose& by_pose,
                                const ReadingVector& sample_variance,
                                const Vector6& pose_sigma) const;

 private:
  std::vector<KnownOffsets::Row> rows_;
  FreeMotion free_;
  ReadingMatrix covariance_;
  std::vector<std::vector<Eigen::Index>> suspects_;  ///< rows, each alone, and those of each sensor
  Matrix6 anywhere_;  ///< information of what is known of a pose beforehand
  Matrix6 across_;    ///< 1 where the platform may not go
};

}  // namespace cdprcal
