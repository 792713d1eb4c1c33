// Where the platform is at every sample, once its start is calibrated.
#pragma once

#include <optional>
#include <string>

#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/motion/agreement.hpp"
#include "cdprcal/motion/contradictions.hpp"
#include "cdprcal/motion/inertial_readings.hpp"
#include "cdprcal/motion/known_offsets.hpp"
#include "cdprcal/motion/late_readings.hpp"
#include "cdprcal/motion/late_sensors.hpp"
#include "cdprcal/motion/motion_state.hpp"

namespace cdprcal {

/// What is known after one sample.
struct TrackedSample {
  double time_s = kNaN;
  MotionState state;
  /// Of (position [m], world-frame rotation vector [rad]), and of the twist; NaN: not known.
  Matrix6 pose_covariance = Matrix6::Constant(kNaN);
  Matrix6 twist_covariance = Matrix6::Constant(kNaN);
  /// Whether the readings agree with one another and with the calibration: the pose is no good
  /// otherwise, or not known at all.
  bool trusted = false;
  int left_out = 0;    ///< readings of this sample that contradict the others
  std::string reason;  ///< not trusted: why
};

/// How the filter came to its latest state, for who goes back along it.
struct TrackerStep {
  bool starts = true;     ///< from nothing but this sample's readings
  MotionState predicted;  ///< before the readings counted
  MotionMatrix predicted_covariance, transition;
  MotionMatrix covariance;  ///< after
  bool agrees = false;      ///< trusted, but for a sensor that is late
};

/// Pose and twist from sample to sample: an extended Kalman filter on SE(3) over pose, twist and
/// acceleration under white jerk, whose density follows from how large the innovations are. What a
/// calibration leaves open of the offsets, and what readings are wrong by at a place, is considered
/// and not estimated (Schmidt 1966; Bierman 1977, ch. VIII): the readings of the run are in the
/// calibration already, and errors that stay do not average out. No load cells are needed: six
/// independent geometric readings a sample are, or as many as the platform has freedoms; an
/// inertial unit carries the motion on where they are fewer, or come seldom.
class Tracker {
 public:
  /// `restless`: so many times the jerk that the innovations show is allowed for. `late`: known
  /// from the whole run, and need not be found again. `ahead_s`: the readings of a sample are those
  /// read so much later (late_readings.hpp). Throws InputError as known_offsets() does.
  explicit Tracker(const Calibration& calibration, double restless = 1.0,
                   std::optional<LateSensor> late = {}, const SensorTimes& ahead_s = {});

  /// Takes the next sample; one that the run's counting is lost in (a gap) is a new start. Throws
  /// InputError for a sample that is not after the last one, or of another number of cables.
  const TrackedSample& add(const Measurement& sample);

  [[nodiscard]] const TrackedSample& latest() const { return now_; }
  [[nodiscard]] const TrackerStep& step() const { return step_; }
  /// A sensor that is late beside the others, as the samples so far tell.
  [[nodiscard]] const std::optional<LateSensor>& late() const { return lateness_.found(); }

 private:
  using Shared = Eigen::Matrix<double, kMotionUnknowns, Eigen::Dynamic, Eigen::ColMajor,
                               kMotionUnknowns, kMostReadings>;
  /// Most readings see pose and twist; an accelerometer sees the acceleration too.
  static constexpr int kSeen = 12;
  using ByState = Eigen::Matrix<double, 1, kMotionUnknowns>;
  /// f(std::integral_constant of how many unknowns a row sees).
  template <typename F>
  void over_seen(Eigen::Index row, const F& f) const;
  struct Reading {
    Eigen::Index row = 0;
    double size = 0.0;        ///< innovation² over what is expected of it
    double innovation = 0.0;  ///< of the reading
    double of_motion = 0.0;   ///< its variance, whatever is considered
  };

  void leave_out_held();
  void leave_out_slack();
  void allow_for_directions();
  void start();
  void forget();
  [[nodiscard]] bool goes_unseen(double silence_s) const;
  void predict();
  [[nodiscard]] double largest(std::size_t reading) const;
  [[nodiscard]] MotionMatrix of_jerk() const;
  [[nodiscard]] Vector6 pose_sigma() const {
    return covariance_.diagonal().head<6>().cwiseMax(0.0).cwiseSqrt();
  }
  [[nodiscard]] bool is_vague(const Vector6& variance) const;
  void note_what_is_said();
  void watch_open();
  bool evaluate_now();
  bool correct();
  bool update(const std::vector<Reading>& readings);
  [[nodiscard]] std::vector<Reading> weigh() const;
  [[nodiscard]] bool surprised(const std::vector<Reading>& readings) const;
  bool quickens(const std::vector<Reading>& readings);
  [[nodiscard]] double misfit(Eigen::Index row) const;
  [[nodiscard]] ByState by_state(Eigen::Index row) const;
  void leave_out_strangers(std::vector<Reading>& readings);
  void compare_of_late(const ReadingVector& misfits);
  void learn_jerk(const std::vector<Reading>& readings);
  void follow_directions();
  void judge(bool corrected);
  void judge_lateness();

  Robot robot_;  ///< as its known effects have made it
  ActiveEffects effects_;
  KnownOffsets offsets_;
  std::vector<Measurement> places_;  ///< of the calibration, and where they were
  std::vector<Pose> poses_;
  FreeMotion free_;
  double size_m_;
  double turn_per_shift_;  ///< rad/m
  double taut_N_;
  /// Of each row: how much later it is read, and with that what effects make of its rate, a delay.
  ReadingVector ahead_s_, by_rate_s_;
  bool at_rest_ = false;  ///< the first sample of a run that begins so: its readings have no rate

  TrackerStep step_;
  MotionMatrix covariance_;
  Shared shared_;  ///< with what is considered
  double jerk_;    ///< density of shifts
  double restless_;
  ReadingMatrix considered_;  ///< inverse of the covariance of what is considered
  ReadingVector lasting_;     ///< mean innovation of each row of late, and of how many
  ReadingVector lasted_;
  /// What each row missed of late in the mean, of how many, and when the last one was.
  struct Lately {
    ReadingVector mean, count, last_s;
  };
  std::array<Lately, 2> lately_;  ///< of moments, and of longer than a swing
  double dt_s_ = 0.0, last_s_ = kNaN;
  bool lost_ = false;          ///< no pose near the last one had its readings
  Measurement sample_, read_;  ///< the present one, as it counts and as it was read
  std::array<std::vector<int>, kSensors> repeated_;  ///< how often each column in a row
  GeometricReadings readings_;
  InertialReadings inertial_;
  CableVector swivel_turn_, length_turn_, swivel_rad_, length_m_;  ///< how far turned over, and at
  ReadingVector innovation_;  ///< size of each, NaN where nothing was read
  Agreement agreement_;
  std::vector<bool> disagrees_, disagreed_;  ///< rows: in this sample, and of late
  bool quarrels_ = false;        ///< of late no pose had the readings, whichever is wrong
  double quarrels_for_s_ = 0.0;  ///< so far
  double compared_s_ = kNaN;     ///< when the means of late were last held against one another
  bool left_open_ = false;       ///< the pose, by the readings; until they close it
  bool anew_ = false;            ///< it was found from nothing since
  /// Information about the pose that samples hold which are not whole, in two spans of time.
  Matrix6 said_ = Matrix6::Zero(), said_before_ = Matrix6::Zero();
  double said_since_s_ = 0.0;  ///< when the later span began
  double unsaid_s_ = 0.0;      ///< how long the readings have not determined the pose
  Contradictions contradictions_;
  LateSensors lateness_;
  std::optional<LateSensor> known_late_;
  TrackedSample now_;
};

/// A run, sample after sample.
struct Track {
  EulerConvention convention = EulerConvention::XYZ;  ///< of the robot's sensors
  std::vector<TrackedSample> samples;
};

/// All samples of a log's run: of one segment, −1 the last. What the robot file knows to be wrong
/// with the readings is set right. Throws InputError as Tracker does, for a log of another number
/// of cables, and for a segment that it does not have.
Track track(const Calibration& calibration, const Log& log, int segment = -1);

}  // namespace cdprcal
