#include "cdprcal/motion/stretches.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"
#include "cdprcal/statics/taut.hpp"

namespace cdprcal {
namespace {

/// h ∫ w² dt and h⁵ ∫ ẅ² dt of w = 35/32 (1 − u²)³ / h, u = t/h in [−1, 1].
constexpr double kSquare = 0.8159, kCurvature = 35.0;

/// So that m² σ_x² kCurvature / h⁵ is a quarter of σ_τ² kSquare / h.
double half_of(double mass_kg, double position_m, double tension_N) {
  constexpr double kShare = 0.25;
  return std::pow(kCurvature / (kShare * kSquare), 0.25) *
         std::sqrt(mass_kg * position_m / std::max(tension_N, 1e-9));
}

/// What one sample says of the pose by its geometry alone: beside `at`, and how well.
struct OwnPose {
  Vector6 beside;
  Matrix6 covariance;
};
OwnPose own_pose(const GeometricReadings& at, const KnownOffsets& known) {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (std::size_t r = 0; r < known.rows.size(); ++r) {
    const KnownOffsets::Row& row = known.rows[r];
    if (row.inertial) continue;
    const auto k = static_cast<Eigen::Index>(r);
    double ahead = at.misfit[row.reading] + known.offset[k];
    if (!std::isfinite(ahead)) continue;
    if (row.angle) ahead = wrap_angle(ahead);
    const Vector6 by_pose = at.by_pose.row(row.reading).transpose();
    information += by_pose * by_pose.transpose() / known.sample_variance[k];
    gradient += by_pose * (ahead / known.sample_variance[k]);
  }
  const Matrix6 covariance = pseudo_inverse(information);
  return {-covariance * gradient, covariance};
}

/// Between the rows before and after: the mean over a stretch is that of one that is smooth. 0
/// where nobody reads it.
CableVector tension_rate_N_s(const CorrectedRun& run, Eigen::Index row, int n) {
  const Eigen::Index before = std::max(row - 1, run.rows.begin);
  const Eigen::Index after = std::min(row + 1, run.rows.end - 1);
  if (before == after || run.log.tension_N.cols() == 0) return CableVector::Zero(n);
  const CableVector change_N =
      (run.log.tension_N.row(after) - run.log.tension_N.row(before)).transpose();
  return change_N.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; }) /
         (run.log.time_s[after] - run.log.time_s[before]);
}

/// Every geometric reading of a measurement, in the order of geometric_rows().
template <typename Visit>
void for_each_reading(Measurement& m, const std::vector<RowLabel>& labels, const Visit& visit) {
  for (std::size_t r = 0; r < labels.size(); ++r) {
    const ChannelRow& channel = row_of(labels[r].channel);
    const std::span<double> read = readings_of(m, channel.of());
    const auto at = static_cast<std::size_t>(channel.first + labels[r].component);
    if (at < read.size()) visit(static_cast<Eigen::Index>(r), read[at]);
  }
}

}  // namespace

Stretches::Stretches(const Robot& robot, const CorrectedRun& run,
                     const std::vector<SmoothedSample>& path, const KnownOffsets& known,
                     double tension_sigma_N, double least_half_s, double most_half_s)
    : robot_(robot), run_(run), path_(path) {
  along_.resize(path.size());
  const int n = robot.cable_count();
  GeometricReadings at;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const MotionState& state = path[k].state;
    const Eigen::Index row = run.rows.begin + static_cast<Eigen::Index>(k);
    const Measurement m = measurement_at(run.log, row, PoseKind::kinematic_pose, n);
    if (!evaluate(robot, {}, m, state.pose, at)) continue;
    along_[k].misfit = at.misfit;
    const OwnPose own = own_pose(at, known);
    along_[k].beside = own.beside;
    if (k <= path.size() / 2) sample_covariance_ = own.covariance;
    const PlatformState platform = platform_state(robot, state.pose);
    along_[k].rising = structure_matrix(platform) * tension_rate_N_s(run, row, n);
    along_[k].balance = wrench_residual(robot, platform, m.tension_N) +
                        inertial_wrench(robot, platform, state.twist, state.acceleration).wrench;
  }
  const double position_m = std::sqrt(sample_covariance_.topLeftCorner<3, 3>().trace() / 3.0);
  mark_slack(least_half_s, tension_sigma_N);
  half_s_ = std::clamp(half_of(robot.platform.mass_kg, position_m, tension_sigma_N), least_half_s,
                       std::max(least_half_s, most_half_s));
}

/// Where the mean tension of `around_s` to both sides, as far as it is read, is that of a cable
/// that hangs, noise apart.
void Stretches::mark_slack(double around_s, double tension_sigma_N) {
  constexpr double kClear = 2.0;  // σ of the mean
  const Log& log = run_.log;
  const double taut_N = taut_tension_N(robot_);
  Eigen::Index begin = run_.rows.begin, end = begin;
  const LogMatrix& tension_N = log.tension_N;
  if (tension_N.cols() == 0) return;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(tension_N.cols()), samples = sum;
  const auto count = [&](Eigen::Index row, double sign) {
    const auto read = tension_N.row(row).array().isFinite();
    sum.array() += sign * read.select(tension_N.row(row).array(), 0.0);
    samples.array() += sign * read.cast<double>();
  };
  for (Eigen::Index row = run_.rows.begin; row < run_.rows.end; ++row) {
    while (end < run_.rows.end && log.time_s[end] <= log.time_s[row] + around_s) {
      count(end++, 1.0);
    }
    while (log.time_s[begin] < log.time_s[row] - around_s) count(begin++, -1.0);
    const Eigen::ArrayXd read = samples.transpose().array();
    along_[static_cast<std::size_t>(row - run_.rows.begin)].slack =
        (sum.transpose().array() < taut_N * read - kClear * tension_sigma_N * read.sqrt()).any();
  }
}

std::optional<Measurement> Stretches::about(Eigen::Index row, Matrix6& inertial_covariance) const {
  const Log& log = run_.log;
  const SampleRange& rows = run_.rows;
  const double middle_s = log.time_s[row];
  if (middle_s - half_s_ < log.time_s[rows.begin] ||
      middle_s + half_s_ > log.time_s[rows.end - 1]) {
    return std::nullopt;
  }
  const int n = robot_.cable_count();
  Measurement m = measurement_at(log, row, PoseKind::static_pose, n);
  const std::vector<RowLabel> labels = geometric_rows(n);
  const auto count = static_cast<Eigen::Index>(labels.size());
  Vector6 balance = Vector6::Zero(), twist = balance, bent = balance, beside = balance,
          rising = balance;
  CableVector tension_N = CableVector::Zero(n);
  ReadingVector misfit = ReadingVector::Zero(count), of = misfit;
  const ReadingVector& here = along_[static_cast<std::size_t>(row - rows.begin)].misfit;
  double sum = 0.0, squares = 0.0, curved = 0.0;
  bool slack = false;
  const auto add = [&](Eigen::Index other) {
    const double u = (log.time_s[other] - middle_s) / half_s_;
    const double left = 1.0 - u * u;
    if (!(left > 0.0)) return false;
    const double apart_s = 0.5 * (log.time_s[std::min(other + 1, rows.end - 1)] -
                                  log.time_s[std::max(other - 1, rows.begin)]);
    const double weight = left * left * left * apart_s;
    const double curvature = (-6.0 + 36.0 * u * u - 30.0 * u * u * u * u) * apart_s;
    const auto k = static_cast<std::size_t>(other - rows.begin);
    slack = slack || along_[k].slack;
    balance += weight * along_[k].balance;
    rising += weight * along_[k].rising;
    twist += weight * path_[k].state.twist;
    bent += curvature * along_[k].beside;
    beside += weight * along_[k].beside;
    curved += curvature;
    tension_N += weight * log.tension_N.row(other).transpose();
    for (Eigen::Index r = 0; r < along_[k].misfit.size(); ++r) {
      double ahead = along_[k].misfit[r];
      if (!std::isfinite(ahead)) continue;
      if (is_angle(labels[static_cast<std::size_t>(r)]) && here.size() > 0) {
        ahead = here[r] + wrap_angle(ahead - here[r]);
      }
      misfit[r] += weight * ahead;
      of[r] += weight;
    }
    sum += weight;
    squares += weight * weight;
    return true;
  };
  for (Eigen::Index other = row; other >= rows.begin && add(other); --other) continue;
  for (Eigen::Index other = row + 1; other < rows.end && add(other); ++other) continue;
  if (slack) return std::nullopt;
  balance /= sum;
  bent = (bent - curved / sum * beside) / (sum * half_s_ * half_s_);
  const Pose& pose = path_[static_cast<std::size_t>(row - rows.begin)].state.pose;
  const PlatformState state = platform_state(robot_, pose);
  if (!(balance + twist + bent).allFinite() || !state.valid || here.size() == 0) {
    return std::nullopt;
  }
  for_each_reading(m, labels, [&](Eigen::Index r, double& reading) {
    if (std::isfinite(here[r]) && of[r] > 0.0) reading += here[r] - misfit[r] / of[r];
  });
  m.tension_N = tension_N / sum;
  m.rising_wrench = rising / sum;
  m.twist = twist / sum;
  m.samples = std::max(1, static_cast<int>(sum * sum / squares));
  const InertialWrench at_rest = inertial_wrench(robot_, state, m.twist, Vector6::Zero());
  m.acceleration =
      bent + solve_symmetric(
                 at_rest.mass,
                 Vector6(balance - wrench_residual(robot_, state, m.tension_N) - at_rest.wrench));
  const double apart_s = half_s_ / (kSquare * m.samples);
  inertial_covariance = kCurvature * apart_s / std::pow(half_s_, 5) * at_rest.mass *
                        sample_covariance_ * at_rest.mass.transpose();
  m.inertial_sigma = inertial_covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return m;
}

}  // namespace cdprcal
