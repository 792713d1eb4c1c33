#include "cdprcal/frame/solved.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal::detail {
namespace {

/// Readings to spare, by the numbers that they determine, before anything is accused.
constexpr double kSpare = 5.0;

/// By which reading of one cable a pose that does not fit is off, where one alone explains it.
LeftOutPose suspect(const Solved& s, std::size_t index) {
  const FramePose& pose = s.problem.poses[index];
  LeftOutPose out{pose.log, pose.sample, -1, kNaN};
  const Robot robot = moved(s.problem, s.state.values);
  double least = kNaN;
  int fitting = 0;
  for (int cable = 0; cable < s.problem.unknowns.cables; ++cable) {
    FramePose without = pose;
    double read = kNaN;
    for (const Channel channel : {Channel::direct_length, Channel::length}) {
      const std::span<double> all = readings_of(without.reading, row_of(channel).of());
      if (static_cast<int>(all.size()) <= cable) continue;
      double& own = all[static_cast<std::size_t>(cable)];
      if (!std::isfinite(own)) continue;
      if (std::isnan(read)) read = own;
      own = kNaN;
    }
    Pose at = s.state.poses[index];
    const double cost = settle_pose(s.problem, robot, s.state.values, without, at);
    const FrameRows rows = frame_rows(s.problem, robot, s.state.values, without, at, false);
    const double freedom =
        static_cast<double>(rows.residual.size()) - static_cast<double>(s.problem.basis.cols());
    if (!(freedom >= 1.0) || chi_square_survival(2.0 * cost, freedom) < kFalseAlarm) continue;
    ++fitting;
    if (cost >= least) continue;
    least = cost;
    out.cable = cable;
    const FrameRows all = frame_rows(s.problem, robot, s.state.values, pose, at, false);
    for (std::size_t row = 0; row < all.channel.size(); ++row) {
      const bool length =
          all.channel[row] == Channel::direct_length || all.channel[row] == Channel::length;
      if (!length || all.component[row] != cable) continue;
      out.error_m = -all.residual[static_cast<Eigen::Index>(row)] * all.sigma[row];
      break;
    }
  }
  if (fitting != 1) out.cable = -1;  // several would do: none is named
  if (out.cable < 0) out.error_m = kNaN;
  return out;
}

}  // namespace

bool to_spare(const Solved& s) {
  return static_cast<double>(s.information.freedom.sum()) >= kSpare * s.known.parameters;
}

std::vector<LeftOutPose> leave_out(Solved& s) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (s.information.freedom[at] < 1) continue;
    shares.push_back(s.information.misfit[at] /
                     chi_square_quantile(0.5, s.information.freedom[at]));
  }
  std::vector<LeftOutPose> out;
  if (shares.empty() || !to_spare(s)) return out;
  const double level = std::max(median(shares), 1e-12);
  const double chance = kFalseAlarm / static_cast<double>(shares.size());
  std::vector<FramePose> poses;
  std::vector<Pose> states;
  for (std::size_t i = 0; i < s.problem.poses.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const int own = s.information.freedom[at];
    const bool belongs =
        own < 1 || chi_square_survival(s.information.misfit[at] / level, own) > chance;
    if (belongs) {
      poses.push_back(s.problem.poses[i]);
      states.push_back(s.state.poses[i]);
    } else {
      out.push_back(suspect(s, i));
    }
  }
  s.problem.poses = std::move(poses);
  s.state.poses = std::move(states);
  return out;
}

}  // namespace cdprcal::detail
