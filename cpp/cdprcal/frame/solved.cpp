#include "cdprcal/frame/solved.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/frame/unknowns.hpp"

namespace cdprcal::detail {
namespace {

constexpr int kNoiseRounds = 4;
/// Noise that changes by less than this share is known well enough for any σ.
constexpr double kNoiseSettled = 0.005;
/// Of the robot file's σ.
constexpr double kLeastNoise = 1e-3;
constexpr int kFolds = 5;

/// Noise of each channel from what its rows leave over, their leverages counted.
/// Returns the largest relative change.
double estimate_noise(FrameProblem& problem, const FrameInformation& information,
                      const Knowledge& known) {
  ChannelSigma squares{}, freedom{}, least = specified_sigma(problem.robot.sigma);
  for (double& sigma : least) sigma *= kLeastNoise;
  double change = 0.0;
  for (const FrameRows& rows : information.rows) {
    const Eigen::MatrixXd free = basis_across(rows.by_pose, 1e-7);
    const Eigen::Index size = rows.residual.size(), left = free.cols();
    const Eigen::MatrixXd common = free.transpose() * rows.by_common;
    const Eigen::MatrixXd own =
        free * (Eigen::MatrixXd::Identity(left, left) - common * known.whole * common.transpose()) *
        free.transpose();
    for (Eigen::Index row = 0; row < size; ++row) {
      const auto channel = static_cast<std::size_t>(rows.channel[static_cast<std::size_t>(row)]);
      squares[channel] += rows.residual[row] * rows.residual[row];
      freedom[channel] += std::max(0.0, own(row, row));
    }
  }
  for (std::size_t channel = 0; channel < squares.size(); ++channel) {
    if (freedom[channel] < 1.0) continue;
    const double factor = std::sqrt(std::max(squares[channel] / freedom[channel], 1e-12));
    // Readings that agree by chance, or are copies, are no better than any sensor.
    problem.sigma[channel] = std::max(factor * problem.sigma[channel], least[channel]);
    change = std::max(change, std::abs(factor - 1.0));
  }
  return change;
}

bool is_length(Channel channel) {
  return channel == Channel::direct_length || channel == Channel::length;
}

}  // namespace

void solve(Solved& s, int max_iterations) {
  for (int round = 0; round < kNoiseRounds; ++round) {
    const FrameUnknowns& u = s.problem.unknowns;
    if (u.untold_tension >= 0) {
      s.problem.untold_stretch = std::abs(s.state.values[u.compliance]) * u.tension_spread_N;
    }
    minimise(s.problem, s.state, max_iterations);
    if (!std::isfinite(s.state.cost)) return;
    s.information = information(s.problem, s.state);
    s.known = knowledge(s.problem, s.state, s.information);
    if (!s.known.valid) return;
    const double change = estimate_noise(s.problem, s.information, s.known);
    s.information = information(s.problem, s.state);
    s.known = knowledge(s.problem, s.state, s.information);
    if (!s.known.valid || change < kNoiseSettled) return;
  }
}

std::vector<Eigen::VectorXd> length_residuals(const Solved& s) {
  std::vector<Eigen::VectorXd> out;
  for (const FrameRows& rows : s.information.rows) {
    Eigen::VectorXd own = Eigen::VectorXd::Constant(s.problem.unknowns.cables, kNaN);
    for (std::size_t row = 0; row < rows.channel.size(); ++row) {
      double& residual = own[rows.component[row] % s.problem.unknowns.cables];
      if (!is_length(rows.channel[row]) || std::isfinite(residual)) continue;
      residual = rows.residual[static_cast<Eigen::Index>(row)] * rows.sigma[row];
    }
    out.push_back(own);
  }
  return out;
}

double rms(const std::vector<Eigen::VectorXd>& residuals) {
  double sum = 0.0, count = 0.0;
  for (const Eigen::VectorXd& own : residuals) {
    for (const double value : own) {
      if (!std::isfinite(value)) continue;
      sum += value * value;
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

double held_out_rms(const Solved& s, int max_iterations) {
  std::vector<Eigen::VectorXd> all;
  for (int fold = 0; fold < kFolds; ++fold) {
    Solved part{s.problem, s.state, {}, {}};
    part.problem.poses.clear();
    part.state.poses.clear();
    Solved rest = part;
    for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
      Solved& to = static_cast<int>(i) % kFolds == fold ? rest : part;
      to.problem.poses.push_back(s.problem.poses[i]);
      to.state.poses.push_back(s.state.poses[i]);
    }
    if (rest.problem.poses.empty() || part.problem.poses.empty()) return kNaN;
    minimise(part.problem, part.state, max_iterations);
    rest.state.values = part.state.values;
    const Robot robot = moved(rest.problem, rest.state.values);
    for (std::size_t i = 0; i < rest.problem.poses.size(); ++i) {
      settle_pose(rest.problem, robot, rest.state.values, rest.problem.poses[i],
                  rest.state.poses[i]);
    }
    rest.information = information(rest.problem, rest.state);
    if (!rest.information.valid) return kNaN;
    for (Eigen::VectorXd& own : length_residuals(rest)) all.push_back(std::move(own));
  }
  return rms(all);
}

void try_off_plane(Solved& s, int max_iterations) {
  FrameUnknowns& u = s.problem.unknowns;
  Solved more = s;
  FrameUnknowns& with = more.problem.unknowns;
  with.off_plane = with.size++;
  with.precision.conservativeResize(with.size);
  with.precision[with.off_plane] = 0.0;
  with.held.push_back(false);
  more.state.values.conservativeResize(with.size);
  more.state.values[with.off_plane] = 0.0;
  minimise(more.problem, more.state, max_iterations);
  const double gain = s.state.cost - more.state.cost;
  // Residuals that hang together are worth fewer readings.
  const double evidence = gain / (s.known.lack_of_fit * s.known.lack_of_fit);
  if (!(evidence > kEvidence) || !(more.state.values[u.size] > 0.0)) return;
  solve(more, max_iterations);
  if (!more.known.valid) return;
  // Chosen by the very residuals that it explains, it earns no smaller σ.
  const double before = s.known.lack_of_fit, after = more.known.lack_of_fit;
  if (before > after) {
    more.known.covariance *= (before * before) / (after * after);
    more.known.lack_of_fit = before;
  }
  s = std::move(more);
}

}  // namespace cdprcal::detail
