// Alpha shapes of point sets whose shape is known, and of a workspace.
#include "cdprcal/workspace/alpha_shape.hpp"

#include <gtest/gtest.h>

#include "../equilibria/robots.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/workspace/workspace_shape.hpp"
#include "shapes.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary

constexpr double kCell = 0.75 * 0.1 * 0.1 * 1.01;  ///< alpha at which cells of 0.1 m are solid

AlphaShapeOptions with_alpha(double alpha_m2) {
  AlphaShapeOptions options;
  options.alpha_m2 = alpha_m2;
  return options;
}

TEST(AlphaShape, OfACubeIsTheCube) {
  const AlphaShape s = alpha_shape(lattice({0, 0, 0}, {5, 5, 5}), with_alpha(kCell));
  EXPECT_TRUE(s.watertight);
  EXPECT_NEAR(s.volume_m3, 0.125, 1e-6);
  EXPECT_NEAR(mesh_area_m2(s.mesh), 1.5, 1e-6);
  EXPECT_EQ(s.components, 1);
  EXPECT_EQ(s.points_outside, 0);
}

TEST(AlphaShape, FindsAlphaByItself) {
  Rng rng(1);
  std::vector<Vector3> points = lattice({0, 0, 0}, {5, 4, 3});
  for (Vector3& p : points)
    p += uniform_vector(rng, Vector3::Constant(-0.02), Vector3::Constant(0.02));
  const AlphaShape s = alpha_shape(points);
  EXPECT_TRUE(s.watertight);
  EXPECT_EQ(s.components, 1);
  EXPECT_EQ(s.points_outside, 0);
  // The least such alpha: just below it, something is missing.
  const AlphaShape below = alpha_shape(points, with_alpha(s.alpha_m2 * (1.0 - 1e-9)));
  EXPECT_TRUE(below.components != 1 || below.points_outside > 0);
}

TEST(AlphaShape, OfABallHasItsVolume) {
  std::vector<Vector3> ball;
  for (const Vector3& p : lattice({-12, -12, -12}, {12, 12, 12}, 0.05)) {
    if (p.norm() < 0.5) ball.push_back(p);
  }
  for (int k = 0; k < 4000; ++k) {  // its surface, by the golden spiral
    const double z = 1.0 - (2.0 * k + 1.0) / 4000.0;
    const double a = k * 2.399963229728653;
    const double r = std::sqrt(1.0 - z * z);
    ball.push_back(0.5 * Vector3(r * std::cos(a), r * std::sin(a), z));
  }
  const AlphaShape s = alpha_shape(ball);
  EXPECT_TRUE(s.watertight);
  EXPECT_NEAR(s.volume_m3, 4.0 / 3.0 * kPi * 0.125, 0.003);
  EXPECT_TRUE(contains(s.mesh, {0.3, 0.3, 0.2}));
  EXPECT_FALSE(contains(s.mesh, {0.3, 0.3, 0.3}));
}

TEST(AlphaShape, AVoidIsHollow) {
  std::vector<Vector3> points;
  for (const Vector3& p : lattice({0, 0, 0}, {9, 9, 9})) {
    const bool hollow = ((p.array() > 0.25) && (p.array() < 0.65)).all();  // indices 3 to 6
    if (!hollow) points.push_back(p);
  }
  const AlphaShape s = alpha_shape(points, with_alpha(kCell));
  EXPECT_TRUE(s.watertight);
  // The void reaches from index 2 to 7. A cell along one of its edges has six corners, which span
  // half of it; one in its corners has seven, which span five sixths.
  const double cell = 0.001;
  EXPECT_NEAR(s.volume_m3, 0.729 - 0.125 + 12 * 3 * cell / 2 + 8 * cell * 5 / 6, 1e-6);
  EXPECT_FALSE(contains(s.mesh, {0.45, 0.45, 0.45}));
  EXPECT_TRUE(contains(s.mesh, {0.1, 0.45, 0.45}));
}

TEST(AlphaShape, SeparatePiecesStaySeparate) {
  std::vector<Vector3> points = lattice({0, 0, 0}, {3, 3, 3});
  const std::vector<Vector3> other = lattice({10, 0, 0}, {13, 3, 3});
  points.insert(points.end(), other.begin(), other.end());
  const AlphaShape s = alpha_shape(points, with_alpha(kCell));
  EXPECT_TRUE(s.watertight);
  EXPECT_EQ(s.components, 2);
  EXPECT_NEAR(s.volume_m3, 2 * 0.027, 1e-6);
}

// Tetrahedra like petals around one edge: wedges of 40° are solid at this alpha, gaps are not.
TEST(AlphaShape, PiecesThatTouchInAnEdgeAreStillWatertight) {
  for (const int petals : {2, 3}) {
    std::vector<Vector3> points{{0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}};
    for (int k = 0; k < petals; ++k) {
      for (const double side : {-20.0, 20.0}) {
        const double a = (360.0 / petals * k + side) * kDegree;
        points.emplace_back(std::cos(a), std::sin(a), 0.5);
      }
    }
    const AlphaShape s = alpha_shape(points, with_alpha(0.45));
    std::string why;
    EXPECT_TRUE(is_watertight(s.mesh, &why)) << why;
    EXPECT_EQ(s.components, petals);
    EXPECT_NEAR(s.volume_m3, petals * std::sin(40.0 * kDegree) / 6.0, 1e-6);
    EXPECT_EQ(s.mesh.vertices_m.size(), points.size() + petals - 1);  // one middle a further copy
  }
}

TEST(AlphaShape, RandomSubsetsAreAlwaysWatertight) {
  // Random holes make every kind of contact between solid parts, also several on one face.
  Rng rng(2);
  int doubled = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Vector3> points;
    for (const Vector3& p : lattice({0, 0, 0}, {7, 7, 7})) {
      if (uniform(rng, 0.0, 1.0) < 0.8) points.push_back(p);
    }
    const AlphaShape s = alpha_shape(points, with_alpha(kCell));
    std::string why;
    ASSERT_TRUE(is_watertight(s.mesh, &why)) << "trial " << trial << ": " << why;
    EXPECT_GT(s.volume_m3, 0.0);
    // More vertices than points on the boundary: some edges had to be doubled.
    for (const Vector3& v : s.mesh.vertices_m) {
      const Vector3 steps = v / 0.1;
      if ((steps - Vector3(steps.array().round())).norm() > 1e-6) {
        ++doubled;
        break;
      }
    }
  }
  EXPECT_GT(doubled, 10);  // the case is really there
}

TEST(AlphaShape, OfTooLittleIsEmpty) {
  EXPECT_TRUE(alpha_shape({}).mesh.faces.empty());
  EXPECT_TRUE(alpha_shape({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).mesh.faces.empty());
  const AlphaShape flat = alpha_shape(lattice({0, 0, 0}, {4, 4, 0}));
  EXPECT_TRUE(flat.mesh.faces.empty());
  EXPECT_FALSE(flat.watertight);
  EXPECT_EQ(flat.points_outside, 25);
  EXPECT_TRUE(alpha_shape(std::vector<Vector3>(9, Vector3::Ones())).mesh.faces.empty());
  EXPECT_TRUE(alpha_shape(lattice({0, 0, 0}, {2, 2, 2}), with_alpha(1e-6)).mesh.faces.empty());
}

TEST(AlphaShape, RefusesWhatMakesNoSense) {
  EXPECT_THROW(alpha_shape({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, kNaN}}), InputError);
  EXPECT_THROW(alpha_shape(lattice({0, 0, 0}, {2, 2, 2}), with_alpha(0.0)), InputError);
  EXPECT_THROW(alpha_shape(lattice({0, 0, 0}, {2, 2, 2}), with_alpha(kNaN)), InputError);
}

Workspace workspace_of(double step_m) {
  WorkspaceOptions options;
  options.step_m = step_m;
  return compute_workspace(irma4(), options);
}

TEST(WorkspaceShape, ConvergesAndIsWatertight) {
  double previous = 0.0;
  for (const double step : {0.16, 0.08, 0.05}) {
    const AlphaShape s = workspace_shape(workspace_of(step));
    std::string why;
    EXPECT_TRUE(is_watertight(s.mesh, &why)) << why;
    EXPECT_EQ(s.components, 1);
    EXPECT_EQ(s.points_outside, 0);
    EXPECT_GE(s.alpha_m2, step * step);
    EXPECT_LE(s.alpha_m2, 4.0 * step * step);
    if (step == 0.05) {
      EXPECT_NEAR(s.volume_m3, previous, 0.02 * previous);
    }
    previous = s.volume_m3;
    for (const Vector3& corner : {Vector3(-0.4, -0.4, 0.6), Vector3(0.4, 0.4, 1.2)}) {
      EXPECT_TRUE(contains(s.mesh, corner));  // eq. 19
    }
  }
}

TEST(WorkspaceShape, LeavingOutTheCoreChangesNothing) {
  const Workspace w = workspace_of(0.09);
  const AlphaShape s = workspace_shape(w);
  const AlphaShape all = alpha_shape(w.points_m(), with_alpha(s.alpha_m2));
  EXPECT_EQ(s.mesh.faces.size(), all.mesh.faces.size());
  EXPECT_EQ(s.mesh.vertices_m.size(), all.mesh.vertices_m.size());
  EXPECT_NEAR(s.volume_m3, all.volume_m3, 1e-9);
}

TEST(WorkspaceShape, KeepsARealVoid) {
  Workspace w = workspace_of(0.1);
  const Vector3 centre(0.0, 0.0, 0.7);
  for (std::size_t row = 0; row < w.inside.size(); ++row) {  // punch a hole
    if ((w.position_m(row) - centre).norm() < 0.25) {
      w.status[w.inside[row]] = PointStatus::infeasible;
    }
  }
  std::vector<std::int64_t> kept;
  for (const std::int64_t k : w.inside) {
    if (w.status[k] == PointStatus::inside) kept.push_back(k);
  }
  const double whole = workspace_shape(workspace_of(0.1)).volume_m3;
  w.inside = kept;
  const AlphaShape s = workspace_shape(w);
  EXPECT_TRUE(s.watertight);
  EXPECT_FALSE(contains(s.mesh, centre));
  EXPECT_GT(whole - s.volume_m3, 4.0 / 3.0 * kPi * std::pow(0.25, 3));
}

TEST(WorkspaceShape, TakesAGivenAlpha) {
  const Workspace w = workspace_of(0.12);
  const AlphaShape wide = workspace_shape(w, 1.0);  // radius 1 m: hollows are bridged
  EXPECT_EQ(wide.alpha_m2, 1.0);
  EXPECT_TRUE(wide.watertight);
  EXPECT_GE(wide.volume_m3, workspace_shape(w).volume_m3);
  EXPECT_THROW(workspace_shape(w, -1.0), InputError);
}

}  // namespace
}  // namespace cdprcal
