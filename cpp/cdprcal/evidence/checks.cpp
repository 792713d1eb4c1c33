#include "cdprcal/evidence/checks.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

namespace cdprcal {
namespace {

/// Which share of the rests is at places of its own. Of two at one place the second reads the same
/// once more, which tells the noise and nothing of the model.
double share_of_places(const DiagnosisModel& model) {
  constexpr double kSamePlace = 0.01;  // of the robot's size, and in turns as far at its rim
  const double near_m = kSamePlace * robot_size_m(model.robot);
  double rests = 0.0, places = 0.0;
  for (const DiagnosisRun& run : model.runs) {
    std::vector<Pose> seen;
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      if (is_moving(run.measurements[i])) continue;
      rests += 1.0;
      const auto here = [&](const Pose& other) {
        const Vector6 apart = minus(run.poses[i], other);
        return apart.head<3>().norm() < near_m && apart.tail<3>().norm() < kSamePlace;
      };
      if (!std::ranges::any_of(seen, here)) seen.push_back(run.poses[i]);
    }
    places += static_cast<double>(seen.size());
  }
  return rests > 0.0 ? places / rests : 1.0;
}

double correlation_in_motion(const DiagnosisModel& model, const DiagnosisSystem& system) {
  double products = 0.0, squares = 0.0;
  Eigen::VectorXd last;
  if (!system.valid) return 0.0;
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const Measurement& m = model.runs[pose.run].measurements[pose.pose];
    if (!is_moving(m)) {
      last.resize(0);
      continue;
    }
    const Eigen::VectorXd rows = system.free_residual.segment(pose.begin, pose.size);
    if (rows.size() == last.size()) {
      products += rows.dot(last);
      squares += 0.5 * (rows.squaredNorm() + last.squaredNorm());
    }
    last = rows;
  }
  return squares > 0.0 ? products / squares : 0.0;
}

}  // namespace

double motion_correlation(const DiagnosisModel& model) {
  return correlation_in_motion(model, linearise(model));
}

Checks checks_of(const DiagnosisModel& model) {
  Checks out;
  const DiagnosisSystem system = linearise(model);
  for (int o = 0; o < system.layout.offsets; ++o) {
    if (system.by_common.col(o).norm() > 0.0) ++out.constants;
  }
  // Of the rests, or of the samples in motion where nothing rested: a sample beside one rest reads
  // the same once more.
  const NoiseLevels freedom = channel_sums(model).freedom;
  const auto moving = freedom.begin() + kRestGroups;
  out.readings = std::max(share_of_places(model) * std::accumulate(freedom.begin(), moving, 0.0),
                          std::accumulate(moving, freedom.end(), 0.0));
  const auto by_samples = [](const DiagnosisRun& run) {
    return std::ranges::all_of(run.measurements,
                               [](const Measurement& m) { return is_moving(m) && !m.moves(); });
  };
  if (std::ranges::any_of(model.runs, by_samples))
    out.shared = correlation_in_motion(model, system);
  return out;
}

namespace {

/// A square root of the covariance of the common unknowns: S = L Lᵀ, without what nothing tells.
Eigen::MatrixXd root_of_common(const DiagnosisSystem& system) {
  constexpr double kUntold = 1e-10;
  const Eigen::Index count = system.layout.nuisance();
  const auto columns = system.free_by_common.leftCols(count);
  Eigen::MatrixXd information = columns.transpose() * columns;
  information.diagonal() += system.prior_precision;
  const Eigen::VectorXd unit =
      information.diagonal().unaryExpr([](double v) { return v > 0.0 ? 1.0 / std::sqrt(v) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> told(unit.asDiagonal() * information *
                                                            unit.asDiagonal());
  const Eigen::VectorXd spread =
      told.eigenvalues().unaryExpr([](double v) { return v > kUntold ? 1.0 / std::sqrt(v) : 0.0; });
  return unit.asDiagonal() * told.eigenvectors() * spread.asDiagonal();
}

/// Of each group of readings how many residuals tell its level apart from the levels of the others.
/// A pose follows what is precise: where that may be one group or another, few do, however many
/// residuals there are. With P, which leaves of readings what neither poses nor common unknowns
/// explain, log σ² of group c has the variance 2 [F⁻¹]cc, F_cd = Σ P_ij² over rows i of c, j of d
/// (restricted likelihood); levels in `known` are none to tell.
Eigen::VectorXd telling_residuals(const DiagnosisModel& model, const std::vector<char>& known) {
  const DiagnosisSystem system = linearise(model);
  const Eigen::MatrixXd root = root_of_common(system);
  const auto group = [&](Eigen::Index row) {
    return static_cast<Eigen::Index>(system.rows[static_cast<std::size_t>(row)].channel);
  };
  Eigen::MatrixXd fisher = Eigen::MatrixXd::Zero(kNoiseGroups, kNoiseGroups);
  // Rows of two poses have only the common unknowns in common: P_ij = −aᵢ·aⱼ.
  const auto count = root.cols();
  std::vector<Eigen::MatrixXd> all(kNoiseGroups, Eigen::MatrixXd::Zero(count, count));
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    const Eigen::MatrixXd a =
        system.free_by_common.middleRows(pose.begin, pose.size).leftCols(count) * root;
    const Eigen::MatrixXd left =
        Eigen::MatrixXd::Identity(pose.size, pose.size) -
        system.by_pose.middleRows(pose.begin, pose.size) * system.pose_by_rows(pose) -
        a * a.transpose();
    std::map<Eigen::Index, Eigen::MatrixXd> own;
    for (Eigen::Index i = 0; i < pose.size; ++i) {
      const auto [at, is_new] = own.try_emplace(group(pose.begin + i));
      if (is_new) at->second.setZero(count, count);
      at->second.noalias() += a.row(i).transpose() * a.row(i);
      for (Eigen::Index j = 0; j < pose.size; ++j) {
        fisher(group(pose.begin + i), group(pose.begin + j)) += left(i, j) * left(i, j);
      }
    }
    for (const auto& [c, of_c] : own) {
      all[static_cast<std::size_t>(c)] += of_c;
      for (const auto& [d, of_d] : own) fisher(c, d) -= of_c.cwiseProduct(of_d).sum();
    }
  }
  for (Eigen::Index c = 0; c < kNoiseGroups; ++c) {
    for (Eigen::Index d = 0; d < kNoiseGroups; ++d) {
      fisher(c, d) +=
          all[static_cast<std::size_t>(c)].cwiseProduct(all[static_cast<std::size_t>(d)]).sum();
    }
  }
  for (Eigen::Index c = 0; c < kNoiseGroups; ++c) {
    if (!known[static_cast<std::size_t>(c)]) continue;
    fisher.row(c).setZero();
    fisher.col(c).setZero();
    fisher(c, c) = 1.0;
  }
  fisher.diagonal().array() += 1e-9;  // groups without rows
  return fisher.inverse().diagonal().cwiseInverse();
}

}  // namespace

DiagnosisModel with_uncertain_noise(DiagnosisModel model) {
  constexpr double kLeastFreedom = 3.0;  // below, t has no variance
  std::vector<char> known(kNoiseGroups, 0);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) known[c] = !(model.noise[c] > model.floor[c]);
  const ChannelSums sums = channel_sums(model);
  const Eigen::VectorXd telling = telling_residuals(model, known);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (sums.freedom[c] < 1.0 || known[c]) continue;
    const double freedom = std::max(kLeastFreedom, telling[static_cast<Eigen::Index>(c)]);
    model.noise[c] *= std::sqrt(freedom / (freedom - 2.0));
  }
  return model;
}

std::string too_little(const Checks& checks) {
  if (checks.shared > kMostShared) {
    return "too little to say: what rests there are leave the pose open, and samples in motion "
           "share their errors with their neighbours; measure at more rests, more varied";
  }
  char text[280];
  std::snprintf(text, sizeof text,
                "too little to say: once the poses are fitted, %.0f readings are left to check the "
                "model by, and %d constants of the sensors to tell; measure at more rests, or "
                "rest longer where cdprcal check finds fewer than there were",
                checks.readings, checks.constants);
  return text;
}

}  // namespace cdprcal
