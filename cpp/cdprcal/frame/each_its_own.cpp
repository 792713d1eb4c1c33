#include "cdprcal/frame/each_its_own.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/frame/gauge.hpp"
#include "cdprcal/frame/unknowns.hpp"
#include "cdprcal/model/yardstick.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal::detail {
namespace {

/// How far cables differ where they do, on a robot of irma4's size: arms and belt ends measured by
/// a ruler [m], belts and drums of one make [1], mounts 25 mm apart that stand 50 mm out [m²].
constexpr std::array<double, kOwn> kWidth{0.01, 0.003, 0.0025};
/// By which power of the robot's size that grows.
constexpr std::array<int, kOwn> kGrowsBy{1, 0, 2};
/// Nobody knows which: half or twice as far is as likely.
constexpr std::array<double, 2> kTimesWidth{0.5, 2.0};
/// Before any reading each of them is as likely as not. Beyond doubt: nothing else is as likely as
/// one in a hundred.
constexpr double kBeyondDoubt = 0.99;
/// Worth trying where it is not clear which it is.
constexpr double kLikely = 0.1;

double width_of(const Robot& robot, Own what) {
  const auto at = static_cast<std::size_t>(what);
  return kWidth[at] * std::pow(times_reference(Yardstick::frame, robot), kGrowsBy[at]);
}

/// Orthonormal columns with sums of 0 (Helmert).
Eigen::MatrixXd contrasts(int cables) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(cables, cables - 1);
  for (int k = 0; k + 1 < cables; ++k) {
    const double n = k + 1.0;
    out.col(k).head(k + 1).setConstant(1.0 / std::sqrt(n * (n + 1.0)));
    out(k + 1, k) = -n / std::sqrt(n * (n + 1.0));
  }
  return out;
}

/// Whether a cable's own may be beside what is solved for, and is not yet.
bool may_differ(const FrameOptions& options, const FrameProblem& problem, Own what) {
  const FrameUnknowns& u = problem.unknowns;
  if (u.cables < 2 || u.own_column(what) >= 0) return false;
  switch (what) {
    case Own::offset:
      return u.direct_offset_count == 1;
    case Own::scale:
      return true;
    default:
      return options.off_plane && row_of(problem.robot.platform.motion).is_planar();
  }
}

/// A frame in which cables have more of their own: which, by how much everything is then elsewhere,
/// how well that is known, and how much better the readings go with it than with none of it [nat].
struct Other {
  std::vector<Own> own;
  FrameUnknowns unknowns;
  Eigen::VectorXd step;
  Eigen::MatrixXd covariance;
  double evidence = 0.0;
};

/// What the readings tell about all that cables may have of their own, where `solved` stands.
struct Told {
  FrameProblem problem;  ///< with all of it, without the poses
  FrameState state;
  FrameInformation information;
};

Told told_of(const std::vector<Own>& may, const Solved& solved) {
  Told out{solved.problem, solved.state, {}};
  FrameUnknowns& u = out.problem.unknowns;
  const Eigen::Index before = u.size;
  for (const Own what : may) add_own(out.problem.robot, what, u);
  out.state.values.conservativeResize(u.size);
  out.state.values.tail(u.size - before).setZero();
  out.information = information(out.problem, out.state);
  // Residuals that hang together are worth fewer readings.
  const double worth = 1.0 / (solved.known.lack_of_fit * solved.known.lack_of_fit);
  out.information.normal *= worth;
  out.information.scores *= worth;
  out.information.rows.clear();
  out.problem.poses.clear();
  return out;
}

/// One step from where the frame stands with `own` of `told`; nullopt where it cannot be solved.
/// What is small bends a frame by little: one step is all.
std::optional<Other> other_frame(const Solved& solved, const Told& told, std::vector<Own> own,
                                 double times_width) {
  FrameProblem problem = told.problem;
  problem.unknowns = solved.problem.unknowns;
  FrameUnknowns& u = problem.unknowns;
  const int before = u.size;
  Eigen::VectorXi columns = Eigen::VectorXi::LinSpaced(before, 0, before - 1);
  for (const Own what : own) {
    add_own(problem.robot, what, u);
    columns.conservativeResize(u.size);
    const int first = told.problem.unknowns.own_column(what);
    columns.tail(u.cables - 1).setLinSpaced(first, first + u.cables - 2);
  }
  u.precision.tail(u.size - before) /= times_width * times_width;
  FrameInformation information = told.information;
  information.normal = told.information.normal(columns, columns);
  information.scores = told.information.scores(columns, Eigen::all);
  FrameState state{told.state.values(columns), told.state.poses};
  const Knowledge known = knowledge(problem, state, information);
  if (!known.valid) return std::nullopt;
  const Eigen::VectorXd gradient =
      information.scores.rowwise().sum() + u.precision.cwiseProduct(state.values);
  const Eigen::VectorXd step = -known.whole * gradient;
  Other out{std::move(own), u, known.without_motions * step, known.covariance};
  out.evidence = -0.5 * gradient.dot(step);
  if (u.size == before) return out;
  // Laplace: the price of a number is how much of its width the readings leave.
  const Eigen::Index more = u.size - before;
  const Eigen::VectorXd by_width = u.precision.tail(more).cwiseSqrt() / known.lack_of_fit;
  const Eigen::MatrixXd left = by_width.asDiagonal() *
                               known.covariance.bottomRightCorner(more, more) *
                               by_width.asDiagonal();
  out.evidence += 0.5 * Cholesky<Eigen::MatrixXd>(left).log_determinant();
  return out;
}

/// All of them but none.
std::vector<std::vector<Own>> choices(const std::vector<Own>& of) {
  std::vector<std::vector<Own>> out{{}};
  for (const Own what : of) {
    for (std::size_t i = out.size(); i-- > 0;) {
      out.push_back(out[i]);
      out.back().push_back(what);
    }
  }
  out.erase(out.begin());
  return out;
}

/// "length 2 by +0.41 %"
std::string most_apart(const Other& other, Own what) {
  const FrameUnknowns& u = other.unknowns;
  int most = 0;
  const auto value = [&](int cable) { return u.own_value(other.step, what, cable); };
  for (int i = 1; i < u.cables; ++i) {
    if (std::abs(value(i)) > std::abs(value(most))) most = i;
  }
  const bool share = what == Own::scale;
  return "length " + std::to_string(most + 1) + " by " +
         printed(share ? "%+.2f %%" : "%+.1f mm", (share ? 1e2 : 1e3) * value(most));
}

/// Of one or several that cables may have of their own, of which the readings ask for one at least.
std::string in_words(const std::vector<std::pair<Own, const Other*>>& asked) {
  std::string with, then;
  for (const auto& [what, frame] : asked) {
    const bool plane = what == Own::square;
    with += with.empty() ? "with " : " or ";
    then += then.empty() ? "" : ", ";
    with += plane ? "a distance of each belt's own from the plane"
                  : std::string(what == Own::scale ? "a scale" : "an offset") +
                        " of each length's own (" + most_apart(*frame, what) + " off the mean)";
    then += plane ? "each pulley's distance from the plane in position_m"
                  : std::string(what == Own::scale ? "--scale" : "--offset") + " each";
  }
  return with + " they agree beyond chance better, and σ allows for that; it is told by " + then;
}

}  // namespace

void add_own(const Robot& robot, Own what, FrameUnknowns& u) {
  const int more = u.cables - 1;
  u.contrasts = contrasts(u.cables);
  u.own[static_cast<std::size_t>(what)] = u.size;
  u.size += more;
  const double width = width_of(robot, what);
  u.precision.conservativeResize(u.size);
  u.precision.tail(more).setConstant(1.0 / (width * width));
  u.held.resize(static_cast<std::size_t>(u.size), false);
}

std::vector<std::string> allow_for_own(const FrameOptions& options, Solved& solved) {
  std::vector<Own> may;
  for (const Own what : {Own::offset, Own::scale, Own::square}) {
    if (may_differ(options, solved.problem, what)) may.push_back(what);
  }
  if (may.empty()) return {};
  const Told told = told_of(may, solved);
  if (!told.information.valid) return {};
  const std::optional<Other> as_it_stands = other_frame(solved, told, {}, 1.0);
  if (!as_it_stands) return {};
  std::vector<Other> frames{*as_it_stands};
  for (const std::vector<Own>& own : choices(may)) {
    for (const double times : kTimesWidth) {
      std::optional<Other> other = other_frame(solved, told, own, times);
      if (!other) continue;
      other->evidence -= std::log(static_cast<double>(kTimesWidth.size()));
      frames.push_back(std::move(*other));
    }
  }
  const auto better = [](const Other& a, const Other& b) { return a.evidence < b.evidence; };
  const double most = std::max_element(frames.begin(), frames.end(), better)->evidence;
  double all = 0.0;
  for (const Other& other : frames) all += std::exp(other.evidence - most);
  const Eigen::Index size = solved.problem.unknowns.size;
  const double alike = std::exp(as_it_stands->evidence - most) / all;
  Eigen::MatrixXd covariance = alike * solved.known.covariance;
  std::array<double, kOwn> chance{};
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const Other& other = frames[k];
    const double share = std::exp(other.evidence - most) / all;
    for (const Own what : other.own) chance[static_cast<std::size_t>(what)] += share;
    const Eigen::VectorXd shift = other.step.head(size) - as_it_stands->step;
    covariance += share * (other.covariance.topLeftCorner(size, size) + shift * shift.transpose());
  }
  if (!covariance.allFinite()) return {};
  solved.known.covariance = covariance;
  if (alike > 1.0 - kBeyondDoubt) return {};
  std::vector<std::pair<Own, const Other*>> asked;
  const bool sure = *std::max_element(chance.begin(), chance.end()) > kBeyondDoubt;
  for (const Own what : may) {
    if (!(chance[static_cast<std::size_t>(what)] > (sure ? kBeyondDoubt : kLikely))) continue;
    const Other* best = nullptr;
    for (const Other& other : frames) {
      const bool has = other.unknowns.own_column(what) >= 0;
      if (has && (best == nullptr || better(*best, other))) best = &other;
    }
    asked.emplace_back(what, best);
  }
  return {in_words(asked)};
}

}  // namespace cdprcal::detail
