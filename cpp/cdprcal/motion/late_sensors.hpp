// Which sensor reads what was a while ago, found from how the platform moves.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/motion/known_offsets.hpp"

namespace cdprcal {

/// A sensor whose readings come later than those of the others; earlier where negative.
struct LateSensor {
  int sensor = 0;  ///< row of kSensorTable
  double delay_s = 0.0;
};

/// The delay of each geometric sensor: what it makes of the readings at a pose is their rate times
/// the delay, and what of that no other pose explains is compared with what they miss. Told from
/// chance by how alike stretches of the run say it, since what is wrong with readings at a place
/// lasts longer than a sample.
class LateSensors {
 public:
  LateSensors(const KnownOffsets& offsets, const FreeMotion& free);

  /// The platform's pose at the next sample and what readings miss there: model − reading, a number
  /// for each row of the offsets, NaN where nothing was read.
  void add(double time_s, const Pose& pose, const ReadingVector& misfit,
           const GeometricReadings& readings);
  /// What comes next does not follow from what was.
  void interrupt();

  /// The one of which stretches tell most alike, where that is no chance.
  [[nodiscard]] const std::optional<LateSensor>& found() const { return found_; }
  /// By what it makes the pose at the latest sample wrong: position [m], world-frame rotation
  /// vector [rad].
  [[nodiscard]] Vector6 pose_error(const LateSensor& late) const;

 private:
  struct Moment {
    double time_s = 0.0;
    Pose pose;
    ReadingVector misfit;
    ReadingsByPose by_pose;
  };
  struct Delay {
    int sensor = 0;
    double said = 0.0, known = 0.0;  ///< of this stretch
    /// Of all stretches: sums of what each said and knew, and of their products.
    double sum_said = 0.0, sum_known = 0.0;
    double said_said = 0.0, said_known = 0.0, known_known = 0.0;
  };
  [[nodiscard]] bool is_of(Eigen::Index row, int sensor) const;
  [[nodiscard]] Eigen::LDLT<Matrix6> information(const Moment& at) const;
  [[nodiscard]] Vector6 pulled(const Moment& at, const Eigen::LDLT<Matrix6>& information,
                               const Vector6& twist, int sensor) const;
  void look_at(const Moment& at, const Vector6& twist);
  void end_stretch();

  std::vector<KnownOffsets::Row> rows_;
  ReadingVector weight_;  ///< of each row
  FreeMotion free_;
  std::vector<Delay> delays_;  ///< none where there is but one sensor
  std::deque<Moment> moments_;
  std::size_t next_ = 0;  ///< to be looked at, when what follows is there
  double stretch_began_s_ = kNaN;
  std::optional<LateSensor> found_;
};

}  // namespace cdprcal
