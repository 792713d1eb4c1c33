// Data the project makes itself: measurements and logs of a robot, with known truth.
//
// Quasi-static: the platform is always where the tensions balance gravity. The estimator's own
// model, therefore: right for tests of the estimator and for examples, not for tests of the model.
#pragma once

#include <cstdint>
#include <vector>

#include "cdprcal/geometry/fifth_degree.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/readings/log.hpp"
#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// Normal random numbers that are the same on every platform and standard library.
class RandomNormal {
 public:
  explicit RandomNormal(std::uint64_t seed) : state_(seed) {}
  double uniform();     ///< in (0, 1)
  double operator()();  ///< standard normal (Box–Muller)

 private:
  std::uint64_t next();  ///< SplitMix64
  std::uint64_t state_;
};

/// White noise of the readings, one σ. Zero: exact readings.
struct ReadingNoise : AbsoluteFields<NumberOf> {  // NaN: there is no such sensor
  double length_m = 0.0;
  double swivel_rad = 0.0;
  double roll_pitch_rad = 0.0;
  double yaw_rad = 0.0;
  double tension_N = 0.0;
};
/// The σ of a robot's sensors times `scale`; absolute sensors only if asked for.
ReadingNoise reading_noise(const SensorSigma& sigma, double scale = 1.0, bool absolute = false);

/// Constant offsets of the relative readings: what the estimator does not know.
struct ReadingOffsets {
  CableVector length_m;
  CableVector swivel_rad;
  double yaw_rad = 0.0;
};
/// Random offsets: ±1 m, ±60°, ±180°.
ReadingOffsets random_offsets(int cable_count, RandomNormal& random);

/// Exact readings at a pose plus offsets and noise. `tension_N`: the true tensions there.
Measurement synthetic_measurement(const Robot& robot, const Pose& pose,
                                  const CableVector& tension_N, PoseKind kind,
                                  const ReadingOffsets& offsets, const ReadingNoise& noise,
                                  RandomNormal& random);

struct SyntheticLogOptions {
  double dwell_s = 5.0;  ///< at every set-point, the first included
  double move_s = 5.0;   ///< fifth-degree transition between two set-points
  double rate_Hz = 10.0;
  ReadingNoise noise;
  /// What the balance is wrong by along each axis, drawn anew for every set-point: what the model
  /// does not know. It grows from one set-point's to the next's during the move.
  double wrench_force_N = 0.0;
  double wrench_moment_Nm = 0.0;
  std::uint64_t seed = 1;
};

struct SyntheticLog {
  Log log;
  std::vector<Pose> poses;  ///< truth, one a sample; the first is the initial pose
};

/// A start-up run through `setpoints_N` under perfect tension control; or, with poses, one a
/// set-point, led from pose to pose by the lengths of six cables and more (HeldMotion). Throws
/// InputError when a set-point, or a point of a transition, has no stable equilibrium (saying
/// where), or when the cables do not hold the platform there.
SyntheticLog synthetic_log(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                           const SyntheticLogOptions& options = {},
                           const std::vector<Pose>& poses = {});

/// An equilibrium to visit.
struct SyntheticStop {
  Pose pose;
  CableVector tension_N;
};

/// An nx × ny × nz grid of equilibria, visited in a serpentine: a box around the middle of the
/// robot, shrunk until every equilibrium is within the tension limits and, up to five cables,
/// stable under tension control. Throws InputError for fewer than 3 cables and when no such box is
/// found.
std::vector<SyntheticStop> default_stops(const Robot& robot, int nx, int ny, int nz);
/// The tensions of default_stops.
std::vector<CableVector> default_setpoints(const Robot& robot, int nx, int ny, int nz);

}  // namespace cdprcal
