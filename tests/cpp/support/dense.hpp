// The diagnosis' system as one dense least-squares problem: unknowns are six a pose, then the
// common ones. Slow and without any elimination: what the fast one is checked against.
#pragma once

#include <gtest/gtest.h>

#include <numeric>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "run.hpp"

namespace cdprcal::test {

struct Dense {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
  Eigen::VectorXd precision, prior_residual;  ///< of all unknowns; 0 of the poses'
  std::vector<std::size_t> channel;
  Eigen::Index poses = 0;  ///< columns of poses

  [[nodiscard]] Eigen::MatrixXd hessian() const {
    Eigen::MatrixXd h = jacobian.transpose() * jacobian;
    h.diagonal() += precision;
    return h;
  }
  [[nodiscard]] Eigen::VectorXd gradient() const {
    return jacobian.transpose() * residual + precision.cwiseSqrt().cwiseProduct(prior_residual);
  }
  /// Scaled to a diagonal of ones first: metres, radians and newtons are mixed.
  [[nodiscard]] Eigen::MatrixXd covariance() const {
    const Eigen::MatrixXd h = hessian();
    const Eigen::VectorXd unit = h.diagonal().cwiseSqrt().cwiseInverse();
    return unit.asDiagonal() * inverse(Eigen::MatrixXd(unit.asDiagonal() * h * unit.asDiagonal())) *
           unit.asDiagonal();
  }
  /// Rows less their leverages, a channel.
  [[nodiscard]] NoiseLevels freedom() const {
    const Eigen::VectorXd hat = (jacobian * covariance()).cwiseProduct(jacobian).rowwise().sum();
    NoiseLevels out{};
    for (std::size_t row = 0; row < channel.size(); ++row) {
      out[channel[row]] += 1.0 - hat[static_cast<Eigen::Index>(row)];
    }
    return out;
  }
  /// Squares of what is left when every pose goes where its own readings want it.
  [[nodiscard]] NoiseLevels squares_off_poses() const {
    const Eigen::MatrixXd a = jacobian.leftCols(poses);
    const Eigen::VectorXd left = residual - a * least_squares(a, residual).x;
    NoiseLevels out{};
    for (std::size_t row = 0; row < channel.size(); ++row) {
      out[channel[row]] += std::pow(left[static_cast<Eigen::Index>(row)], 2);
    }
    return out;
  }
};

/// The rows of one pose, in the order of their channels.
struct PoseSystem {
  std::size_t run = 0, pose = 0;
  std::vector<NoiseGroup> channel;
  std::vector<int> component;
  Eigen::VectorXd scale, residual, freedom;
  Eigen::MatrixXd by_pose, by_common;
  Eigen::VectorXd free_residual;   ///< of which no move of the pose explains anything
  Eigen::MatrixXd free_by_common;  ///< likewise
};

inline std::vector<PoseSystem> poses_of(const DiagnosisSystem& system) {
  std::vector<PoseSystem> out;
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    std::vector<Eigen::Index> order(static_cast<std::size_t>(pose.size));
    std::iota(order.begin(), order.end(), pose.begin);
    const auto row = [&](Eigen::Index i) { return system.rows[static_cast<std::size_t>(i)]; };
    std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
      return static_cast<int>(row(a).channel) % kRestGroups <
             static_cast<int>(row(b).channel) % kRestGroups;
    });
    PoseSystem& to = out.emplace_back();
    to.run = pose.run, to.pose = pose.pose;
    to.scale.resize(pose.size);
    for (std::size_t i = 0; i < order.size(); ++i) {
      to.channel.push_back(row(order[i]).channel);
      to.component.push_back(row(order[i]).component);
      to.scale[static_cast<Eigen::Index>(i)] = row(order[i]).scale;
    }
    to.residual = system.residual(order);
    to.freedom = system.freedom(order);
    to.by_pose = system.by_pose(order, Eigen::all);
    to.by_common = system.by_common(order, Eigen::all);
    to.free_residual = system.free_residual(order);
    to.free_by_common = system.free_by_common(order, Eigen::all);
  }
  return out;
}

inline Dense dense(const DiagnosisSystem& system) {
  const std::vector<PoseSystem> poses = poses_of(system);
  const Eigen::Index rows = system.residual.size(), nuisance = system.layout.nuisance();
  Dense out;
  out.poses = 6 * static_cast<Eigen::Index>(poses.size());
  out.jacobian.setZero(rows, out.poses + nuisance);
  out.residual.resize(rows);
  out.precision.setZero(out.poses + nuisance);
  out.prior_residual.setZero(out.poses + nuisance);
  out.precision.tail(nuisance) = system.prior_precision;
  out.prior_residual.tail(nuisance) = system.prior_residual;
  Eigen::Index row = 0, column = 0;
  for (const PoseSystem& pose : poses) {
    const Eigen::Index count = pose.residual.size();
    out.jacobian.block(row, column, count, 6) = pose.by_pose;
    out.jacobian.block(row, out.poses, count, nuisance) = pose.by_common.leftCols(nuisance);
    out.residual.segment(row, count) = pose.residual;
    for (const NoiseGroup c : pose.channel) out.channel.push_back(static_cast<std::size_t>(c));
    row += count;
    column += 6;
  }
  return out;
}

/// Spread of a model's only effect in one run: that of its estimate, and what it changes by when
/// directions of motion are off by their own error, and by a tenth.
inline Eigen::VectorXd deviation_with_directions(const DiagnosisModel& model) {
  const Eigen::Index own = model.effects[0].values.size();
  Eigen::VectorXd variance =
      dense(linearise(with_uncertain_noise(model))).covariance().diagonal().tail(own);
  for (const bool by_error : {true, false}) {
    DiagnosisModel other = model;
    for (Measurement& m : other.runs[0].measurements) {
      for (auto [s, error] : {std::pair{&m.length_direction, &m.length_direction_error},
                              std::pair{&m.swivel_direction, &m.swivel_direction_error}}) {
        *s = by_error ? CableVector(*s + *error) : CableVector(0.9 * *s);
      }
    }
    EXPECT_TRUE(fit(other));
    variance += (other.effects[0].values - model.effects[0].values).cwiseAbs2();
  }
  // Nobody knows from which side a cable came before power-on.
  for (int i = 0; i < 2 * model.robot.cable_count(); ++i) {
    DiagnosisModel other = model;
    for (Measurement& m : other.runs[0].measurements) {
      const int cable = i / 2;
      if (i % 2 == 0) m.length_direction[cable] += m.length_direction_open[cable];
      if (i % 2 == 1) m.swivel_direction[cable] += m.swivel_direction_open[cable];
    }
    EXPECT_TRUE(fit(other));
    variance += (other.effects[0].values - model.effects[0].values).cwiseAbs2();
  }
  return variance.cwiseSqrt();
}

/// Two short runs of irma4 with biased load cells (the robot's) and a drifting yaw (each run's
/// own), as logs and as the fitted model that knows both.
inline std::vector<Log> two_logs() {
  std::vector<Log> logs{startup_log(load_robot("irma4"), 0.2, 71, 0),
                        startup_log(load_robot("irma4"), 0.2, 72, 0)};
  for (std::size_t r = 0; r < 2; ++r) {
    logs[r].tension_N.rowwise() += Eigen::RowVector4d(6.0, -4.0, 3.0, -7.0);
    logs[r].roll_pitch_yaw_rad.col(2) += (r == 0 ? 3e-4 : -4e-4) * logs[r].time_s;
  }
  return logs;
}

inline DiagnosisModel two_runs_baseline() {
  std::vector<Log> logs = two_logs();
  std::vector<std::string> left_out;
  return baseline_model(load_robot("irma4"), logs, left_out);
}

inline const DiagnosisModel& two_runs() {
  static const DiagnosisModel model = [] {
    DiagnosisModel m = two_runs_baseline();
    m.effects.push_back({find_effect("load_cell_bias"), EffectValues::Zero(4)});
    m.effects.push_back({find_effect("yaw_drift"), EffectValues::Zero(2)});
    EXPECT_TRUE(fit_with_noise(m));
    return m;
  }();
  return model;
}

/// The two runs without effects, with so few swivels that they have less than one degree of freedom
/// left, and so few yaws that they have one to two: then noise is estimated for the yaws alone.
inline const DiagnosisModel& few_readings() {
  static const DiagnosisModel model = [] {
    DiagnosisModel m = two_runs_baseline();
    // From the last pose on, never at the first, which the offsets are known from.
    const auto drop = [&m](std::size_t channel, double below, auto take_out) {
      for (std::size_t i = m.runs[0].measurements.size() - 1; i > 0; --i) {
        for (DiagnosisRun& run : m.runs) {
          for (int k = 0; k < 4; ++k) {
            if (channel_sums(m).freedom[channel] < below) return;
            take_out(run.measurements[i], k);
          }
        }
      }
    };
    drop(1, 1.0, [](Measurement& r, int k) { r.swivel_rad[k] = kNaN; });
    drop(3, 2.0, [](Measurement& r, int) { r.roll_pitch_yaw_rad[2] = kNaN; });
    EXPECT_TRUE(fit_with_noise(m));
    const NoiseLevels freedom = dense(linearise(m)).freedom();
    EXPECT_GT(freedom[1], 0.01);
    EXPECT_LT(freedom[1], 1.0);
    EXPECT_GT(freedom[3], 1.0);
    EXPECT_LT(freedom[3], 2.0);
    return m;
  }();
  return model;
}

}  // namespace cdprcal::test
