#include "cdprcal/motion/known_offsets.hpp"

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/motion/geometric_readings.hpp"
#include "cdprcal/motion/inertial_readings.hpp"

namespace cdprcal {
namespace {

/// What the readings of an inertial unit are off by while the platform rests, and how much that
/// varies from rest to rest; as specified where too few rests show it.
struct Bias {
  double offset = 0.0, variance = 0.0;
  bool told = false;  ///< by rests
};
std::vector<Bias> biases(const Robot& robot, const Calibration& calibration) {
  constexpr double kFewest = 3.0;
  const std::vector<RowLabel> labels = inertial_rows();
  std::vector<Bias> out(labels.size());
  std::vector<double> rests(labels.size());
  InertialReadings at;
  Robot still = robot;  // anywhere does while nothing turns
  still.platform.inertial_unit_m.emplace(Vector3::Zero());
  for (std::size_t i = 0; i < calibration.problem.measurements.size(); ++i) {
    const Measurement& m = calibration.problem.measurements[i];
    if (!m.rests()) continue;
    evaluate(still, m, {calibration.result.poses[i]}, at);
    for (std::size_t r = 0; r < labels.size(); ++r) {
      const double off = -at.misfit[static_cast<Eigen::Index>(r)];
      if (!std::isfinite(off)) continue;
      const double before = off - out[r].offset;
      out[r].offset += before / ++rests[r];
      out[r].variance += before * (off - out[r].offset);  // West's update
    }
  }
  for (std::size_t r = 0; r < labels.size(); ++r) {
    const double sigma = robot.sigma.*row_of(labels[r].channel).of().sigma;
    out[r].told = rests[r] >= kFewest;
    out[r].variance =
        out[r].told ? out[r].variance / (rests[r] - 1.0) * (1.0 + 1.0 / rests[r]) : sigma * sigma;
  }
  return out;
}

/// Whether any measurement holds a reading, also one that says nothing of the pose.
bool is_read(const CalibrationProblem& problem, const RowLabel& label) {
  const ChannelRow& channel = row_of(label.channel);
  return std::ranges::any_of(problem.measurements, [&](Measurement m) {
    const std::span<double> all = readings_of(m, channel.of());
    return std::isfinite(all[static_cast<std::size_t>(channel.first + label.component)]);
  });
}

/// White, of one fresh reading. Correlated readings are worth fewer; of those held, one in so many
/// counts.
double sample_variance(const Calibration& calibration, Channel channel, double specified) {
  constexpr double kLeast = 1e-3;  // of what is specified
  const Signal& signal = calibration.signals[static_cast<std::size_t>(channel)];
  const double rows = std::max(1.0, signal.rows / signal.hold_rows);
  const double least = kLeast * specified;
  return std::max(signal.sigma * signal.sigma * rows, least * least);
}

}  // namespace

KnownOffsets known_offsets(const Calibration& calibration) {
  const CalibrationProblem& problem = calibration.problem;
  const CalibrationResult& result = calibration.result;
  if (result.status != CalibrationStatus::converged || !result.covariance) {
    throw InputError("track: the calibration has no pose that can be trusted (" + result.reason +
                     "); give a log that calibrates, or the robot file that diagnose -o writes");
  }
  const Robot robot = with_effects(problem.robot, problem.effects);
  const NoiseModel noise = problem.noise.value_or(specified_noise(robot.sigma));
  const NoiseModel specified = specified_noise(robot.sigma);
  KnownOffsets out;
  out.run_start_s = problem.measurements.front().time_s;
  for (std::size_t c = 0; c < kChannels; ++c) {
    out.is_held[c] = calibration.signals[c].hold_rows > 1.0;
    out.repeats[c] = calibration.signals[c].repeats;
  }
  const std::vector<RowLabel> labels = geometric_rows(robot.cable_count());
  const auto most = static_cast<Eigen::Index>(labels.size());
  ReadingVector offset = ReadingVector::Zero(most), weight = offset, poses = offset;
  GeometricReadings at;
  for (std::size_t i = 0; i < problem.measurements.size(); ++i) {
    const Measurement& m = problem.measurements[i];
    if (!evaluate(robot, problem.effects, m, result.poses[i], at)) continue;
    for (Eigen::Index r = 0; r < most; ++r) {
      if (!std::isfinite(at.misfit[r])) continue;
      // Rests say what readings count from; a single sample in motion hardly adds to them.
      const RowLabel& label = labels[static_cast<std::size_t>(r)];
      const double sigma = std::max(noise[label.channel].sigma(m), 1e-12);
      const double w = 1.0 / (sigma * sigma);
      double said = -at.misfit[r] - offset[r];
      if (is_angle(label)) said = wrap_angle(said);
      weight[r] += w;
      offset[r] += said * w / weight[r];
      poses[r] += 1.0;
    }
  }
  for (Eigen::Index r = 0; r < most; ++r) {
    const RowLabel& label = labels[static_cast<std::size_t>(r)];
    if (poses[r] > 0.0) out.rows.push_back({label, r, is_angle(label)});
  }
  const auto geometric = static_cast<Eigen::Index>(out.rows.size());
  const std::vector<RowLabel> inertial = inertial_rows();
  const std::vector<Bias> bias = biases(robot, calibration);
  const bool knows_up = std::ranges::any_of(out.rows, [](const KnownOffsets::Row& row) {
    return row.label.channel == Channel::roll_pitch;
  });
  for (std::size_t r = 0; r < inertial.size(); ++r) {
    if (!is_read(problem, inertial[r])) continue;
    // A bias that no rests tell is an acceleration all the way: a force where there is none.
    if (inertial[r].channel == Channel::specific_force && !bias[r].told && knows_up) continue;
    out.rows.push_back({inertial[r], static_cast<Eigen::Index>(r), false, true});
  }
  const auto count = static_cast<Eigen::Index>(out.rows.size());
  out.offset.setZero(count);
  out.sample_variance.resize(count);
  out.rounding_variance.setZero(count);
  out.covariance.setZero(count, count);
  if (!evaluate(robot, problem.effects, problem.measurements.front(), result.poses.front(), at)) {
    throw InputError(
        "track: the initial pose of the calibration has no kinematics; give a log that calibrates");
  }
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_pose =
      Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(count, 6);
  for (Eigen::Index r = geometric; r < count; ++r) {
    const KnownOffsets::Row& row = out.rows[static_cast<std::size_t>(r)];
    const Bias& of = bias[static_cast<std::size_t>(row.reading)];
    out.offset[r] = of.offset;
    out.covariance(r, r) = of.variance;
    out.sample_variance[r] =
        sample_variance(calibration, row.label.channel, specified[row.label.channel].pose);
  }
  for (Eigen::Index r = 0; r < geometric; ++r) {
    const KnownOffsets::Row& row = out.rows[static_cast<std::size_t>(r)];
    const Channel channel = row.label.channel;
    const ChannelNoise& of = noise[channel];
    if (has_offset(row.label)) {
      by_pose.row(r) = at.by_pose.row(row.reading);
      out.offset[r] = offset[row.reading];
      // Between the mean of all poses' errors and the reference's own.
      const double sigma = of.sigma(problem.measurements.front().samples);
      out.covariance(r, r) = 2.0 * sigma * sigma / (poses[row.reading] + 1.0);
    } else {
      // An absolute reading agrees with ζ0: by what that is known worse than the reading's noise
      // says, the reading may be off, too (an AHRS that is mounted askew).
      const double sigma = of.sigma(problem.measurements.front());
      const double all = at.by_pose.row(row.reading) * *result.covariance *
                         at.by_pose.row(row.reading).transpose();
      if (all > sigma * sigma) {
        by_pose.row(r) = std::sqrt(1.0 - sigma * sigma / all) * at.by_pose.row(row.reading);
      }
    }
    out.covariance(r, r) += of.pose * of.pose;
    out.sample_variance[r] = sample_variance(calibration, channel, specified[channel].pose);
    const double rounding = calibration.signals[static_cast<std::size_t>(channel)].rounding;
    out.rounding_variance[r] = rounding * rounding;
  }
  out.covariance += by_pose * *result.covariance * by_pose.transpose();
  return out;
}

}  // namespace cdprcal
