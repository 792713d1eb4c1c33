#include "cdprcal/calibration/shared_errors.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/keep_one_of.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {

namespace {

/// What some poses leave of every reading: one row a reading, in the order of `poses` (indices).
std::vector<std::vector<double>> rows_of(const std::vector<PoseResidual>& residuals,
                                         const std::vector<std::size_t>& poses) {
  std::vector<std::vector<double>> out;
  for (const std::size_t i : poses) {
    std::size_t next = 0;
    const auto add = [&](std::span<const double> values) {
      for (const double value : values) {
        if (next == out.size()) out.emplace_back();
        out[next++].push_back(value);
      }
    };
    for_each_sensor([&](const Sensor&, const auto& field) { add(numbers(field)); }, residuals[i]);
    add(numbers(residuals[i].wrench));
  }
  return out;
}

/// How alike what moments leave is to what the rests nearest in time leave, of readings that both
/// have: correlation, mean over the readings; 0 where none is shared.
double alike_nearest_rests(const Calibration& calibration,
                           const std::vector<std::size_t>& moments) {
  const auto& measurements = calibration.problem.measurements;
  std::vector<std::size_t> rests;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (measurements[i].kind == PoseKind::static_pose) rests.push_back(i);
  }
  if (rests.empty()) return 0.0;
  std::vector<std::size_t> nearest;
  for (const std::size_t m : moments) {
    nearest.push_back(*std::ranges::min_element(rests, {}, [&](std::size_t rest) {
      return std::abs(measurements[rest].time_s - measurements[m].time_s);
    }));
  }
  const auto moving = rows_of(calibration.result.residuals, moments);
  const auto resting = rows_of(calibration.result.residuals, nearest);
  double all = 0.0, count = 0.0;
  for (std::size_t row = 0; row < moving.size(); ++row) {
    double products = 0.0, of_moments = 0.0, of_rests = 0.0;
    for (std::size_t k = 0; k < moments.size(); ++k) {
      const double a = moving[row][k], b = resting[row][k];
      if (!std::isfinite(a * b)) continue;
      products += a * b, of_moments += a * a, of_rests += b * b;
    }
    const double size = std::sqrt(of_moments * of_rests);
    if (size > 0.0) all += products / size, count += 1.0;
  }
  return count > 0.0 ? all / count : 0.0;
}

constexpr std::size_t kFewest = 8;  // poses: fewer say nothing of their noise

/// Whether the i-th pose is a moment in motion; the first is what all count from.
bool is_moment(const Calibration& calibration, std::size_t i) {
  return i > 0 && calibration.problem.measurements[i].kind == PoseKind::kinematic_pose;
}

/// What moments in motion are wrong by may be what the rests around them are wrong by, and
/// residuals hardly show it: most of an error goes into the pose, at each one another part. Along
/// each freedom the platform is no better known than by the rests alone; at worst the moments are
/// as many readings that say the same once more. Moments whose own noise is larger than a rest's,
/// so that they weigh little, change nothing here.
void widen_to_rests(Calibration& calibration) {
  CalibrationResult& result = calibration.result;
  if (!result.covariance) return;
  CalibrationProblem rests = calibration.problem;
  rests.measurements.clear();
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    if (is_moment(calibration, i)) continue;
    rests.measurements.push_back(calibration.problem.measurements[i]);
    poses.push_back(result.poses[i]);
  }
  if (poses.size() < kFewest || poses.size() == result.poses.size()) return;
  const double most = static_cast<double>(result.poses.size()) / static_cast<double>(poses.size());
  Assembly assembly(rests, poses);
  assembly.set_reference_errors(result.reference_errors);
  assembly.poses().update_wrench_weights(1.0);
  const TwistBasis basis = motion_basis(rests.robot);
  // Of information, not of covariance: rests may tell nothing at all along a freedom.
  const Eigen::MatrixXd told = assembly.reference_information().information;
  const Eigen::MatrixXd stated = basis.transpose() * *result.covariance * basis;
  const SymmetricEigen<Eigen::MatrixXd> share =
      symmetric_eigen<Eigen::MatrixXd>(basis.transpose() * told * basis, stated.inverse());
  const Eigen::VectorXd wider =
      share.eigenvalues().cwiseMax(1.0 / most).cwiseMin(1.0).cwiseInverse();
  const Eigen::MatrixXd directions = basis * share.eigenvectors();
  *result.covariance = directions * wider.asDiagonal() * directions.transpose();
}

}  // namespace

double moments_a_reading(const std::vector<PoseResidual>& residuals,
                         const std::vector<std::size_t>& moments) {
  constexpr double kGone = 0.05;
  const auto series = rows_of(residuals, moments);
  const auto correlation = [&](std::size_t lag) {
    double all = 0.0, count = 0.0;
    for (const std::vector<double>& row : series) {
      double squares = 0.0, products = 0.0;
      for (std::size_t k = 0; k < row.size(); ++k) {
        if (std::isfinite(row[k])) squares += row[k] * row[k];
        if (k >= lag && std::isfinite(row[k] * row[k - lag])) products += row[k] * row[k - lag];
      }
      if (squares > 0.0) all += products / squares, count += 1.0;
    }
    return count > 0.0 ? all / count : 0.0;
  };
  double worth = 1.0;
  for (std::size_t lag = 1; lag < moments.size() / 3; ++lag) {
    const double rho = correlation(lag);
    if (rho < kGone) break;
    worth += 2.0 * rho;
  }
  return worth;
}

double moments_a_reading(const std::vector<PoseResidual>& residuals, std::size_t last) {
  std::vector<std::size_t> moments(last);
  std::iota(moments.begin(), moments.end(), residuals.size() - last);
  return moments_a_reading(residuals, moments);
}

namespace {

/// Of so many moments as are worth one reading, one stays.
void keep_independent(const CalibrateOptions& options, Calibration& calibration) {
  constexpr double kSame = 0.99;  // of a correlation: beyond, a moment adds nothing
  const std::size_t count = calibration.problem.measurements.size();
  const auto moves = [&](std::size_t i) { return is_moment(calibration, i); };
  std::vector<std::size_t> moments;
  for (std::size_t i = 0; i < count; ++i) {
    if (moves(i)) moments.push_back(i);
  }
  // Beside a reading that is known another of correlation ρ is worth (1 − ρ) / (1 + ρ).
  const double alike = std::clamp(alike_nearest_rests(calibration, moments), 0.0, kSame);
  const double worth =
      moments_a_reading(calibration.result.residuals, moments) * (1.0 + alike) / (1.0 - alike);
  const std::size_t rests = count - moments.size();
  const std::size_t fewest = rests < kFewest ? kFewest : 1;
  const double most = static_cast<double>(moments.size()) / static_cast<double>(fewest);
  const auto every = static_cast<std::size_t>(std::round(std::min(worth, most)));
  if (every < 2) return;
  Calibration next = calibration;
  std::vector<Pose>& poses = next.result.poses;
  keep_one_of(every, moves, next.problem.measurements);
  keep_one_of(every, moves, poses);
  next.kinematic_poses -= static_cast<int>(count - poses.size());
  // Their noise is not that of all: where moments repeat what rests say, a channel that is fitted
  // exactly seems to have none, and would keep it.
  next.problem.noise.reset();
  const double solve_time_s = next.result.solve_time_s;
  next.result = solve(next.problem, poses, options.solve);
  next.result.solve_time_s += solve_time_s;
  refine_in_place(options, next);
  // What is left holds as much as all: where that does not say how well the pose is known, neither
  // do all of them.
  if (next.result.status == CalibrationStatus::converged || next.result.curved) {
    calibration = std::move(next);
  } else if (calibration.result.covariance) {
    // Too few alone: all of them, and no more sure than as many as are independent.
    *calibration.result.covariance *= worth;
  }
}

}  // namespace

void leave_independent_moments(const CalibrateOptions& options, Calibration& calibration) {
  if (noise_source(options) != NoiseSource::from_data || !options.at_s.empty()) return;
  if (calibration.result.status != CalibrationStatus::converged) return;
  keep_independent(options, calibration);
  widen_to_rests(calibration);
}

}  // namespace cdprcal
