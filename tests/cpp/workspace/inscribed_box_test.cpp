// The largest inscribed box against trying them all.
#include "cdprcal/workspace/inscribed_box.hpp"

#include <gtest/gtest.h>

#include "../equilibria/robots.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary

/// A made-up workspace: only the grid and the statuses matter here.
Workspace made_up(Rng& rng, const std::array<int, 3>& count, double density) {
  Workspace w;
  w.grid = make_grid(
      {{0, 0, 0}, {0.1 * (count[0] - 1), 0.1 * (count[1] - 1), 0.1 * (count[2] - 1)}}, 0.1);
  for (std::int64_t k = 0; k < w.grid.size(); ++k) {
    const bool inside = uniform(rng, 0.0, 1.0) < density;
    w.status.push_back(inside ? PointStatus::inside : PointStatus::infeasible);
  }
  return w;
}

double largest_by_trying(const Workspace& w) {
  const auto& n = w.grid.count;
  double best = 0.0;
  for (int a = 0; a < n[0]; ++a)
    for (int b = 0; b < n[1]; ++b)
      for (int c = 0; c < n[2]; ++c) {
        for (int x = a + 1; x < n[0]; ++x)
          for (int y = b + 1; y < n[1]; ++y)
            for (int z = c + 1; z < n[2]; ++z) {
              const Box box{w.grid.position_m({a, b, c}), w.grid.position_m({x, y, z})};
              if (box.volume_m3() > best && box_is_inside(w, box)) best = box.volume_m3();
            }
      }
  return best;
}

TEST(InscribedBox, IsTheLargestOfAll) {
  Rng rng(1);
  for (int trial = 0; trial < 60; ++trial) {
    const std::array<int, 3> count{2 + static_cast<int>(rng() % 5), 2 + static_cast<int>(rng() % 5),
                                   2 + static_cast<int>(rng() % 5)};
    const Workspace w = made_up(rng, count, uniform(rng, 0.6, 1.0));
    const std::optional<Box> box = largest_inscribed_box(w);
    const double best = largest_by_trying(w);
    ASSERT_EQ(box.has_value(), best > 0.0);
    if (!box) continue;
    EXPECT_NEAR(box->volume_m3(), best, 1e-12);
    EXPECT_TRUE(box_is_inside(w, *box));
  }
}

TEST(InscribedBox, OfIrma4HoldsThePapersHeightAndMore) {
  WorkspaceOptions options;
  options.step_m = 0.1;
  options.boundary_halvings = 0;
  const Workspace w = compute_workspace(irma4(), options);
  const std::optional<Box> box = largest_inscribed_box(w);
  ASSERT_TRUE(box.has_value());
  EXPECT_TRUE(box_is_inside(w, *box));
  EXPECT_GT(box->volume_m3(), 0.8 * 0.8 * 0.6);  // eq. 19's box is one candidate
  // One more layer on any side leaves the workspace.
  for (int axis = 0; axis < 3; ++axis) {
    Box grown = *box;
    grown.upper_m[axis] += w.grid.step_m;
    EXPECT_FALSE(box_is_inside(w, grown));
    grown = *box;
    grown.lower_m[axis] -= w.grid.step_m;
    EXPECT_FALSE(box_is_inside(w, grown));
  }
}

TEST(InscribedBox, NeedsOneWholeCell) {
  Rng rng(2);
  Workspace w = made_up(rng, {4, 4, 4}, 1.0);
  EXPECT_NEAR(largest_inscribed_box(w)->volume_m3(), 0.027, 1e-12);
  for (PointStatus& s : w.status) s = PointStatus::untested;
  EXPECT_FALSE(largest_inscribed_box(w).has_value());
  for (int i = 0; i < 4; ++i) w.status[w.grid.index({i, 1, 1})] = PointStatus::inside;  // a line
  EXPECT_FALSE(largest_inscribed_box(w).has_value());
}

TEST(InscribedBox, ABoxBeyondTheGridIsNotInside) {
  Rng rng(3);
  const Workspace w = made_up(rng, {4, 4, 4}, 1.0);
  EXPECT_TRUE(box_is_inside(w, {{0, 0, 0}, {0.3, 0.3, 0.3}}));
  EXPECT_TRUE(box_is_inside(w, {{0.05, 0.05, 0.05}, {0.25, 0.25, 0.25}}));
  EXPECT_FALSE(box_is_inside(w, {{0, 0, 0}, {0.31, 0.3, 0.3}}));
  EXPECT_FALSE(box_is_inside(w, {{-0.01, 0, 0}, {0.3, 0.3, 0.3}}));
}

}  // namespace
}  // namespace cdprcal
