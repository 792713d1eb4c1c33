#include "cdprcal/equilibria/polytope.hpp"

#include <Eigen/LU>

namespace cdprcal {
namespace {

using Eigen::Vector2d;

/// A cable whose tension λ cannot move by this much (relative) sets no limit on λ.
constexpr double kFlat = 1e-12;

/// One side of one tension limit, as normalᵀ λ ≤ bound, and how it moves.
struct HalfPlane {
  Vector2d normal;
  double bound = 0.0;
  int cable = 0;
  double sign = 1.0;  ///< +1: upper limit, −1: lower

  /// ∂bound − ∂normalᵀ λ: how far the edge at λ moves along the normal (not normalised).
  [[nodiscard]] double motion(const MovingFamily& f, int direction, const Vector2d& lambda) const {
    return -sign * (f.particular_by[direction][cable] +
                    f.basis_by[direction].row(cable).dot(lambda.transpose()));
  }
};

struct HalfPlanes {
  std::array<HalfPlane, 2 * kMaxCables> plane;
  int count = 0;
};

HalfPlanes half_planes(const MovingFamily& f, double low_N, double high_N) {
  HalfPlanes result;
  for (int i = 0; i < f.cable_count; ++i) {
    const Vector2d row(f.basis(i, 0), f.freedom == 2 ? f.basis(i, 1) : 0.0);
    if (row.norm() < kFlat) continue;
    result.plane[result.count++] = {row, high_N - f.particular_N[i], i, 1.0};
    result.plane[result.count++] = {-row, f.particular_N[i] - low_N, i, -1.0};
  }
  return result;
}

Barycentre interval_midpoint(const MovingFamily& f, double low_N, double high_N) {
  const HalfPlanes planes = half_planes(f, low_N, high_N);
  const HalfPlane* upper = nullptr;  // the tightest of each side
  const HalfPlane* lower = nullptr;
  const auto at = [](const HalfPlane* p) { return p->bound / p->normal.x(); };
  for (int k = 0; k < planes.count; ++k) {
    const HalfPlane* plane = &planes.plane[k];
    const HalfPlane*& side = plane->normal.x() > 0.0 ? upper : lower;
    if (side == nullptr || (at(plane) < at(side)) == (plane->normal.x() > 0.0)) side = plane;
  }
  Barycentre result;
  result.by.fill(Vector2d::Zero());
  if (upper == nullptr || lower == nullptr) return result;
  result.exists = at(lower) <= at(upper);
  result.lambda_N.x() = 0.5 * (at(lower) + at(upper));
  for (int d = 0; d < f.directions; ++d) {
    for (const HalfPlane* side : {lower, upper}) {
      const Vector2d lambda(at(side), 0.0);
      result.by[d].x() += 0.5 * side->motion(f, d, lambda) / side->normal.x();
    }
  }
  return result;
}

/// A convex polygon, counter-clockwise; edge k runs from corner k to k + 1 and lies on plane[k].
struct Polygon {
  // A square, and each half plane adds a corner at most.
  std::array<Vector2d, 4 + 2 * kMaxCables> corner;
  std::array<int, 4 + 2 * kMaxCables> plane;
  int count = 0;
};

/// Sutherland–Hodgman against one half plane.
Polygon clip(const Polygon& in, const HalfPlane& by, int plane) {
  Polygon out;
  for (int k = 0; k < in.count; ++k) {
    const Vector2d& a = in.corner[k];
    const Vector2d& b = in.corner[(k + 1) % in.count];
    const double inside_a = by.bound - by.normal.dot(a);
    const double inside_b = by.bound - by.normal.dot(b);
    if (inside_a >= 0.0) {
      out.corner[out.count] = a;
      out.plane[out.count++] = in.plane[k];
    }
    if ((inside_a >= 0.0) != (inside_b >= 0.0)) {
      const double t = inside_a / (inside_a - inside_b);
      out.corner[out.count] = a + t * (b - a);
      // Leaving: the next edge runs along the clipping line. Entering: along the old edge.
      out.plane[out.count++] = inside_a >= 0.0 ? plane : in.plane[k];
    }
  }
  return out;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// λ where the largest violation s of the limits is least: the best vertex of the linear programme
/// "min s subject to normalᵀλ − s ≤ bound", found by trying the triples (120 of five
/// cables, 560 of eight).
Barycentre least_violation(const MovingFamily& f, const HalfPlanes& planes) {
  Barycentre result;
  result.by.fill(Vector2d::Zero());
  double best = HUGE_VAL;
  for (int a = 0; a < planes.count; ++a) {
    for (int b = a + 1; b < planes.count; ++b) {
      for (int c = b + 1; c < planes.count; ++c) {
        const std::array<const HalfPlane*, 3> side{&planes.plane[a], &planes.plane[b],
                                                   &planes.plane[c]};
        Matrix3 m;
        Vector3 bound;
        for (int k = 0; k < 3; ++k) {
          m.row(k) << side[k]->normal.transpose(), -1.0;
          bound[k] = side[k]->bound;
        }
        if (std::abs(m.determinant()) < 1e-9) continue;
        const Matrix3 inverse = m.inverse();
        const Vector3 x = inverse * bound;
        if (!(x.z() < best)) continue;
        bool feasible = true;
        for (int k = 0; k < planes.count && feasible; ++k) {
          const HalfPlane& p = planes.plane[k];
          feasible =
              p.normal.dot(x.head<2>()) - x.z() <= p.bound + 1e-9 * (1.0 + std::abs(p.bound));
        }
        if (!feasible) continue;
        best = x.z();
        result.lambda_N = x.head<2>();
        for (int d = 0; d < f.directions; ++d) {
          Vector3 motion;
          for (int k = 0; k < 3; ++k) motion[k] = side[k]->motion(f, d, x.head<2>());
          result.by[d] = (inverse * motion).head<2>();
        }
      }
    }
  }
  return result;
}

Barycentre polygon_centroid(const MovingFamily& f, double low_N, double high_N, bool nearest_miss) {
  const HalfPlanes planes = half_planes(f, low_N, high_N);
  // |λ| = |Nλ| ≤ |τ| + |τ₀|, so this square holds every feasible λ.
  const double reach =
      2.0 * (std::sqrt(f.cable_count) * std::max(std::abs(low_N), std::abs(high_N)) +
             f.particular_N.norm());
  Polygon polygon;
  polygon.corner = {Vector2d(-reach, -reach), Vector2d(reach, -reach), Vector2d(reach, reach),
                    Vector2d(-reach, reach)};
  polygon.plane.fill(-1);
  polygon.count = 4;
  for (int k = 0; k < planes.count && polygon.count > 0; ++k) {
    polygon = clip(polygon, planes.plane[k], k);
  }
  double twice_area = 0.0;
  Vector2d moment = Vector2d::Zero();
  const Vector2d origin = polygon.count > 0 ? polygon.corner[0] : Vector2d::Zero();
  for (int k = 1; k + 1 < polygon.count; ++k) {
    const Vector2d a = polygon.corner[k] - origin;
    const Vector2d b = polygon.corner[k + 1] - origin;
    twice_area += cross(a, b);
    moment += cross(a, b) * (a + b) / 3.0;
  }
  const double range = high_N - low_N;
  if (!(twice_area > 1e-12 * range * range)) {
    return nearest_miss ? least_violation(f, planes) : Barycentre{};
  }

  Barycentre result;
  result.exists = true;
  result.lambda_N = origin + moment / twice_area;
  // An edge that moves outward by v sweeps area: dC = (∮ (x − C) v ds) / area. Along an edge x and
  // v are linear, so Simpson's rule is exact.
  const double area = 0.5 * twice_area;
  for (int d = 0; d < f.directions; ++d) {
    Vector2d sweep = Vector2d::Zero();
    for (int k = 0; k < polygon.count; ++k) {
      if (polygon.plane[k] < 0) continue;
      const HalfPlane& plane = planes.plane[polygon.plane[k]];
      const Vector2d& a = polygon.corner[k];
      const Vector2d& b = polygon.corner[(k + 1) % polygon.count];
      const double scale = (b - a).norm() / (6.0 * plane.normal.norm());
      const Vector2d middle = 0.5 * (a + b);
      sweep += scale * (plane.motion(f, d, a) * (a - result.lambda_N) +
                        4.0 * plane.motion(f, d, middle) * (middle - result.lambda_N) +
                        plane.motion(f, d, b) * (b - result.lambda_N));
    }
    result.by[d] = sweep / area;
  }
  return result;
}

}  // namespace

Barycentre barycentre(const MovingFamily& family, double low_N, double high_N, bool nearest_miss) {
  return family.freedom == 1 ? interval_midpoint(family, low_N, high_N)
                             : polygon_centroid(family, low_N, high_N, nearest_miss);
}

}  // namespace cdprcal
