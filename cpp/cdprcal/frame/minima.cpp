#include "cdprcal/frame/minima.hpp"

#include <algorithm>

#include "cdprcal/frame/start.hpp"

namespace cdprcal::detail {
namespace {

/// Starts of those given that are solved to the end: the best few.
constexpr std::size_t kMostSolved = 3;
/// Of poses that are tried again from elsewhere.
constexpr int kMostRounds = 5;
/// Costs closer than this share are of one minimum.
constexpr double kSame = 1e-6;
constexpr int kMostDrawn = 8;
/// So many ends in the best tell that none better is near, where others end elsewhere.
constexpr int kOften = 3;

/// Whether the readings agree about as well as the robot file's σ say. Where they do not, a frame
/// that several starts end in may still be the wrong one.
bool fits(const FrameProblem& problem, const FrameState& state) {
  constexpr double kNoise = 2.0;  // times σ
  const Robot robot = moved(problem, state.values);
  double readings = 0.0;
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    readings += static_cast<double>(
        frame_rows(problem, robot, state.values, problem.poses[i], state.poses[i], false)
            .residual.size());
  }
  return 2.0 * state.cost < kNoise * kNoise * readings;
}

/// To the end: with poses that sit in minima of their own tried again. As if nothing stretched
/// first: far from the frame a stretch that is not there takes up what the pulleys should.
void follow(const FrameProblem& problem, int max_iterations, FrameState& state) {
  if (const int compliance = problem.unknowns.compliance; compliance >= 0) {
    FrameProblem rigid = problem;
    rigid.unknowns.held[static_cast<std::size_t>(compliance)] = true;
    minimise(rigid, state, max_iterations);
  }
  minimise(problem, state, max_iterations);
  for (int pass = 0; pass < kMostRounds && improve_poses(problem, state); ++pass) {
    minimise(problem, state, max_iterations);
  }
  for (int pass = 0; pass < kMostRounds; ++pass) {
    if (!improve_frame(problem, state, max_iterations)) break;
  }
}

/// Takes an end among the others. Whether it is the best, once more.
bool take(FrameState state, Minima& out) {
  ++out.starts;
  const auto same = [&](const FrameState& other) {
    return std::abs(state.cost - other.cost) <= kSame * (1.0 + other.cost);
  };
  const bool again = !out.each.empty() && same(out.each.front());
  if (again) {
    ++out.of_best;
    return true;
  }
  const bool best = out.each.empty() || state.cost < out.each.front().cost;
  if (best) out.of_best = 1;
  if (best || std::ranges::none_of(out.each, same)) {
    out.each.insert(best ? out.each.begin() : out.each.end(), std::move(state));
  }
  return false;
}

}  // namespace

Minima minima(const FrameProblem& problem, std::vector<FrameState> begin, bool draw,
              int max_iterations) {
  std::ranges::sort(begin, [](const FrameState& a, const FrameState& b) {
    return std::isfinite(a.cost) && !(b.cost <= a.cost);
  });
  if (begin.size() > kMostSolved) begin.resize(kMostSolved);
  Minima out;
  for (FrameState& state : begin) {
    if (!std::isfinite(state.cost)) continue;
    follow(problem, max_iterations, state);
    if (std::isfinite(state.cost) && take(std::move(state), out)) break;
  }
  if (!draw || is_closed_form(problem)) return out;
  out.drawn = true;
  out.of_best = std::min(out.of_best, 1);  // those began with the same pulleys
  for (int k = 1; k <= kMostDrawn; ++k) {
    FrameState state = drawn_start(problem, static_cast<std::uint64_t>(k));
    if (!std::isfinite(state.cost)) continue;
    follow(problem, max_iterations, state);
    if (!std::isfinite(state.cost)) continue;
    take(std::move(state), out);
    const bool often = out.of_best >= (out.each.size() == 1 ? 2 : kOften);
    if (often && fits(problem, out.each.front())) break;
  }
  return out;
}

double apart_m(const FrameProblem& problem, const FrameState& a, const FrameState& b) {
  const Robot one = moved(problem, a.values), other = moved(problem, b.values);
  const auto distance = [](const Robot& robot, std::size_t i, std::size_t j) {
    return (robot.cables[i].pulley.position_m - robot.cables[j].pulley.position_m).norm();
  };
  double most = 0.0;
  for (std::size_t i = 0; i < one.cables.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      most = std::max(most, std::abs(distance(one, i, j) - distance(other, i, j)));
    }
  }
  return most;
}

}  // namespace cdprcal::detail
