#include "cdprcal/motion/known_offsets.hpp"

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/motion/geometric_readings.hpp"

namespace cdprcal {

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
      const double sigma = std::max(noise[label.channel].sigma(m.samples), 1e-12);
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
  const auto count = static_cast<Eigen::Index>(out.rows.size());
  out.offset.setZero(count);
  out.sample_variance.resize(count);
  out.covariance.setZero(count, count);
  if (!evaluate(robot, problem.effects, problem.measurements.front(), result.poses.front(), at)) {
    throw InputError(
        "track: the initial pose of the calibration has no kinematics; give a log that calibrates");
  }
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_pose(count, 6);
  for (Eigen::Index r = 0; r < count; ++r) {
    const KnownOffsets::Row& row = out.rows[static_cast<std::size_t>(r)];
    const Channel channel = row.label.channel;
    const ChannelNoise& of = noise[channel];
    by_pose.row(r).setZero();
    if (has_offset(row.label)) {
      by_pose.row(r) = at.by_pose.row(row.reading);
      out.offset[r] = offset[row.reading];
      // Between the mean of all poses' errors and the reference's own.
      const double sigma = of.sigma(problem.measurements.front().samples);
      out.covariance(r, r) = 2.0 * sigma * sigma / (poses[row.reading] + 1.0);
    }
    out.covariance(r, r) += of.pose * of.pose;
    // Correlated readings are worth fewer; of those held, one in so many counts.
    const Signal& signal = calibration.signals[static_cast<std::size_t>(channel)];
    const double rows = std::max(1.0, signal.rows / signal.hold_rows);
    const double least = 1e-3 * specified[channel].pose;
    out.sample_variance[r] = std::max(signal.sigma * signal.sigma * rows, least * least);
  }
  out.covariance += by_pose * *result.covariance * by_pose.transpose();
  return out;
}

}  // namespace cdprcal
