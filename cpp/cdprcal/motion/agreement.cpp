#include "cdprcal/motion/agreement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Numbers of readings; nothing is allocated for them at every sample.
using Rows = Eigen::Matrix<Eigen::Index, Eigen::Dynamic, 1, Eigen::ColMajor, kMostReadings, 1>;

/// Of readings that agree, one in so many is said to contradict: a log has thousands of moments.
constexpr double kChance = 1e-6;
/// What each number more that is left out must gain, and by what the best explanation must be
/// better than the next to be told: a thousandth of its likelihood.
constexpr double kEach = 6.0, kTold = 13.8;
/// An error of the pose of so many σ does no harm.
constexpr double kHarmless = 2.0;
/// Nor does what rounding makes of a direction in which guides hold the platform [m, rad].
constexpr double kRoundedOff = 1e-9;

bool agree(double chi_square, double freedom) {
  // Nothing is left that could contradict.
  if (chi_square <= freedom || freedom < 0.5) return true;
  return chi_square_survival(chi_square, freedom) >= kChance;
}

}  // namespace

Agreement::Agreement(const KnownOffsets& offsets, const FreeMotion& free, double size_m)
    : rows_(offsets.rows), free_(free), covariance_(offsets.covariance) {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  const auto sensor = [&](Eigen::Index row) {
    return row_of(rows_[static_cast<std::size_t>(row)].label.channel).sensor;
  };
  std::vector<std::vector<Eigen::Index>> of_sensors;
  for (Eigen::Index row = 0; row < count; ++row) {
    if (rows_[static_cast<std::size_t>(row)].inertial) continue;
    suspects_.push_back({row});
    const auto same = std::ranges::find_if(
        of_sensors, [&](const auto& rows) { return sensor(rows.front()) == sensor(row); });
    if (same == of_sensors.end()) {
      of_sensors.push_back({row});
    } else {
      same->push_back(row);
    }
  }
  std::ranges::copy_if(of_sensors, std::back_inserter(suspects_),
                       [](const auto& rows) { return rows.size() > 1; });
  Vector6 information;
  information << Vector3::Constant(1.0 / (size_m * size_m)), Vector3::Ones();
  anywhere_ = free.of_square(information.asDiagonal());
  across_ = free.of_stiffness(Matrix6::Zero());
}

Disagreement Agreement::of(const ReadingVector& misfits, const ReadingsByPose& by_pose,
                           const ReadingVector& sample_variance, const Vector6& pose_sigma) const {
  Rows place = Rows::Constant(misfits.size(), -1);  // of a row among those that were read
  Rows read(misfits.size());
  Eigen::Index count = 0;
  for (Eigen::Index row = 0; row < misfits.size(); ++row) {
    if (rows_[static_cast<std::size_t>(row)].inertial || !std::isfinite(misfits[row])) continue;
    read[place[row] = count++] = row;
  }
  read.conservativeResize(count);
  const ReadingVector misfit = misfits(read);
  ReadingMatrix covariance = covariance_(read, read);
  covariance.diagonal() += sample_variance(read);
  ReadingsByPose rows(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = static_cast<std::size_t>(read[i]);
    rows.row(i) = free_.of(Vector6(by_pose.row(rows_[row].reading).transpose())).transpose();
  }
  const Eigen::LLT<ReadingMatrix> root(covariance);
  if (root.info() != Eigen::Success) return {};
  // In units of σ: what the pose explains of the misfit, and what it could.
  ReadingsByPose white = rows;
  ReadingVector white_misfit = misfit;
  root.matrixL().solveInPlace(white);
  root.matrixL().solveInPlace(white_misfit);
  const Matrix6 by_readings = white.transpose().lazyProduct(white);
  const Eigen::LLT<Matrix6> pose(by_readings + anywhere_ + across_);
  const Vector6 towards = white.transpose().lazyProduct(white_misfit);
  const double chi_square = white_misfit.squaredNorm() - towards.dot(pose.solve(towards));
  const double freedom = static_cast<double>(count) - pose.solve(by_readings).trace();
  if (agree(chi_square, freedom)) return {};

  // M = W − W H (Hᵀ W H)⁻¹ Hᵀ W: what is left of the readings' information beyond the pose.
  const ReadingMatrix weight = root.solve(ReadingMatrix::Identity(count, count));
  const ReadingsByPose weighted = weight.lazyProduct(rows);
  const Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMostReadings> by_reading =
      pose.solve(weighted.transpose());
  const ReadingMatrix left = weight - weighted.lazyProduct(by_reading);
  const ReadingVector against = left.lazyProduct(misfit);

  Disagreement out{true, {}};
  struct Suspicion {
    const std::vector<Eigen::Index>* rows;
    double cost;
    bool harms;
  };
  std::vector<Suspicion> enough;
  for (const std::vector<Eigen::Index>& rows_of : suspects_) {
    std::vector<Eigen::Index> at;
    for (const Eigen::Index row : rows_of) {
      if (place[row] >= 0) at.push_back(place[row]);
    }
    if (at.empty()) continue;
    const ReadingMatrix own = left(at, at);
    const ReadingVector said = against(at);
    const Eigen::LLT<ReadingMatrix> factor(own);
    // Readings that nothing else says anything of cannot be contradicted.
    constexpr double kAlone = 1e-6;
    if (factor.info() != Eigen::Success ||
        !(own.diagonal().array() > kAlone * weight(at, at).diagonal().array()).all()) {
      continue;
    }
    const auto number = static_cast<double>(at.size());
    const ReadingVector error = factor.solve(said);
    const double remains = chi_square - said.dot(error);
    if (!agree(remains, freedom - number)) continue;
    const Vector6 moves = by_reading(Eigen::all, at) * error;
    const bool harms = (moves.array().abs() > kHarmless * pose_sigma.array() + kRoundedOff).any();
    enough.push_back({&rows_of, remains + kEach * number, harms});
  }
  if (enough.empty()) return out;
  if (std::ranges::none_of(enough, &Suspicion::harms)) return {};
  const auto best = std::ranges::min_element(enough, {}, &Suspicion::cost);
  const bool told = std::ranges::all_of(enough, [&](const Suspicion& other) {
    const bool holds_it = std::ranges::includes(*other.rows, *best->rows);
    return holds_it || other.cost > best->cost + kTold;
  });
  if (told && !best->harms) return {};
  if (told) out.rows = *best->rows;
  return out;
}

}  // namespace cdprcal
