// The only file that sees CGAL.
#include "cdprcal/workspace/alpha_shape.hpp"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/box.hpp"

namespace cdprcal {
namespace {

struct CellInfo {
  double squared_radius = 0.0;
  bool solid = false;
  bool visited = false;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<int, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<CellInfo, Kernel,
                                              CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Delaunay =
    CGAL::Delaunay_triangulation_3<Kernel,
                                   CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;
using Cell = Delaunay::Cell_handle;

/// Coordinates are rounded to this many steps across the set: lattices become exact lattices, whose
/// spheres and volumes are then computed without harm from rounding.
constexpr double kQuanta = 1 << 20;

struct Quantised {
  Vector3 origin_m;
  double quantum_m = 1.0;
  [[nodiscard]] Kernel::Point_3 point(const Vector3& p) const {
    const Vector3 q = ((p - origin_m) / quantum_m).array().round();
    return {q.x(), q.y(), q.z()};
  }
};

Quantised quantise(const std::vector<Vector3>& points_m) {
  Box around = Box::empty();
  for (const Vector3& p : points_m) {
    if (!p.allFinite()) throw InputError("alpha shape: points must be finite");
    around.include(p);
  }
  const double size = points_m.empty() ? 0.0 : around.extent_m().maxCoeff();
  return {around.lower_m, size > 0.0 ? size / kQuanta : 1.0};
}

double squared_circumradius(const Cell& cell) {
  const auto vector = [](const Kernel::Point_3& p) { return Vector3(p.x(), p.y(), p.z()); };
  const Vector3 o = vector(cell->vertex(0)->point());
  const Vector3 a = vector(cell->vertex(1)->point()) - o;
  const Vector3 b = vector(cell->vertex(2)->point()) - o;
  const Vector3 c = vector(cell->vertex(3)->point()) - o;
  const double six_volumes = a.dot(b.cross(c));
  const Vector3 numerator =
      a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b);
  return numerator.squaredNorm() / (4.0 * six_volumes * six_volumes);
}

/// The Delaunay triangulation and which of its cells are solid.
class Solid {
 public:
  /// `rim`: AlphaShapeOptions::core_rim.
  Solid(const std::vector<Vector3>& points_m, std::vector<bool> rim)
      : point_count_(points_m.size()), rim_(std::move(rim)) {
    const Quantised grid = quantise(points_m);
    std::vector<std::pair<Kernel::Point_3, int>> labelled;
    labelled.reserve(points_m.size());
    for (std::size_t k = 0; k < points_m.size(); ++k) {
      labelled.emplace_back(grid.point(points_m[k]), static_cast<int>(k));
    }
    delaunay_.insert(labelled.begin(), labelled.end());
    if (delaunay_.dimension() < 3) return;
    cells_.reserve(delaunay_.number_of_finite_cells());
    for (auto it = delaunay_.finite_cells_begin(); it != delaunay_.finite_cells_end(); ++it) {
      it->info().squared_radius = squared_circumradius(it) * grid.quantum_m * grid.quantum_m;
      cells_.push_back(it);
    }
  }

  [[nodiscard]] bool flat() const { return cells_.empty(); }
  [[nodiscard]] const std::vector<Cell>& cells() const { return cells_; }
  [[nodiscard]] int components() const { return components_; }
  [[nodiscard]] int points_outside() const { return points_outside_; }

  /// Marks what is solid at this alpha.
  void set_alpha(double alpha_m2) {
    for (const Cell& cell : cells_) cell->info().solid = cell->info().squared_radius <= alpha_m2;
    if (!rim_.empty()) fill_core();
    for (const Cell& cell : cells_) cell->info().visited = false;
    components_ = 0;
    for (const Cell& seed : cells_) {
      if (!seed->info().solid || seed->info().visited) continue;
      collect_piece(seed);
      ++components_;
    }
    std::vector<bool> covered(point_count_, false);
    for (const Cell& cell : cells_) {
      if (!cell->info().solid) continue;
      for (int k = 0; k < 4; ++k) covered[cell->vertex(k)->info()] = true;
    }
    points_outside_ = static_cast<int>(std::count(covered.begin(), covered.end(), false));
  }

  /// Least alpha in [low, high] with one piece and no point outside, by bisection over the cells'
  /// radii: both hold for every larger alpha, too, once they hold. `high` (when > 0) if none is
  /// good.
  double automatic_alpha(double low, double high) {
    std::vector<double> radii;
    for (const Cell& cell : cells_) {
      const double r = cell->info().squared_radius;
      if (std::isfinite(r) && r > low && (high <= 0.0 || r < high)) radii.push_back(r);
    }
    radii.push_back(low);
    if (high > 0.0) radii.push_back(high);
    std::sort(radii.begin(), radii.end());
    radii.erase(std::unique(radii.begin(), radii.end()), radii.end());
    std::size_t first = 0;
    std::size_t last = radii.size() - 1;
    if (good(radii[first])) return radii[first];
    if (!good(radii[last])) return radii[last];
    while (last - first > 1) {
      const std::size_t middle = (first + last) / 2;
      (good(radii[middle]) ? last : first) = middle;
    }
    return radii[last];
  }

 private:
  bool good(double alpha_m2) {
    if (!(alpha_m2 > 0.0)) return false;
    set_alpha(alpha_m2);
    return components_ == 1 && points_outside_ == 0;
  }

  /// The cells connected to `seed` through faces that are solid (or hollow) as it is.
  const std::vector<Cell>& collect_piece(const Cell& seed) {
    piece_.assign(1, seed);
    seed->info().visited = true;
    for (std::size_t at = 0; at < piece_.size(); ++at) {
      for (int k = 0; k < 4; ++k) {
        const Cell next = piece_[at]->neighbor(k);
        if (next->info().visited || next->info().solid != seed->info().solid) continue;
        next->info().visited = true;
        piece_.push_back(next);
      }
    }
    return piece_;
  }

  /// Fills hollows that have only rim points (AlphaShapeOptions::core_rim) around them: inner
  /// points were left out there.
  void fill_core() {
    for (auto it = delaunay_.all_cells_begin(); it != delaunay_.all_cells_end(); ++it) {
      it->info().visited = false;
    }
    const auto on_rim = [&](const Cell& cell) {
      if (delaunay_.is_infinite(cell)) return false;
      for (int k = 0; k < 4; ++k) {
        if (!rim_[cell->vertex(k)->info()]) return false;
      }
      return true;
    };
    for (const Cell& seed : cells_) {
      if (seed->info().solid || seed->info().visited) continue;
      const std::vector<Cell>& hollow = collect_piece(seed);
      if (!std::all_of(hollow.begin(), hollow.end(), on_rim)) continue;
      for (const Cell& cell : hollow) cell->info().solid = true;
    }
  }

  std::size_t point_count_;
  std::vector<bool> rim_;
  Delaunay delaunay_;
  std::vector<Cell> cells_;  ///< the finite ones
  std::vector<Cell> piece_;
  int components_ = 0;
  int points_outside_ = 0;
};

/// A facet of the boundary, seen from its solid cell.
struct BoundaryFace {
  Cell cell;
  int opposite;                 ///< index of the cell's vertex that is not on the face
  std::array<int, 3> vertices;  ///< point indices, counter-clockwise from outside
};

std::vector<BoundaryFace> boundary_faces(const std::vector<Cell>& cells) {
  // Faces of a positively oriented cell, counter-clockwise seen from outside the cell.
  constexpr int kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::vector<BoundaryFace> faces;
  for (const Cell& cell : cells) {
    if (!cell->info().solid) continue;
    for (int k = 0; k < 4; ++k) {
      if (cell->neighbor(k)->info().solid) continue;
      BoundaryFace face{cell, k, {}};
      for (int v = 0; v < 3; ++v) face.vertices[v] = cell->vertex(kFace[k][v])->info();
      faces.push_back(face);
    }
  }
  return faces;
}

/// The other boundary face of the solid wedge around edge (a, b) that `face` bounds: turns about
/// the edge from solid cell to solid cell. Returned as (cell, index opposite to the face).
std::pair<Cell, int> wedge_partner(const BoundaryFace& face, int a, int b) {
  Cell cell = face.cell;
  int from = face.opposite;
  while (true) {
    int across = 0;  // the vertex that is neither on the edge nor opposite to where we came from
    while (across == from || cell->vertex(across)->info() == a ||
           cell->vertex(across)->info() == b) {
      ++across;
    }
    const Cell next = cell->neighbor(across);
    if (!next->info().solid) return {cell, across};
    const int arrived = next->index(cell);
    from = arrived;
    cell = next;
  }
}

std::uint64_t edge_key(int a, int b) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32 |
         static_cast<std::uint32_t>(std::max(a, b));
}

/// Boundary faces → mesh with two faces an edge (see alpha_shape).
Mesh manifold_mesh(const std::vector<Vector3>& points_m, const std::vector<BoundaryFace>& faces) {
  std::unordered_map<std::uint64_t, std::vector<int>> faces_of_edge;
  faces_of_edge.reserve(faces.size() * 2);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto& v = faces[f].vertices;
      faces_of_edge[edge_key(v[k], v[(k + 1) % 3])].push_back(static_cast<int>(f));
    }
  }
  Mesh mesh;
  std::unordered_map<int, int> vertex_of_point;
  const auto vertex = [&](int point) {
    const auto [it, added] =
        vertex_of_point.try_emplace(point, static_cast<int>(mesh.vertices_m.size()));
    if (added) mesh.vertices_m.push_back(points_m[point]);
    return it->second;
  };
  for (const BoundaryFace& face : faces) {
    for (const int point : face.vertices) vertex(point);
  }
  // Extra wedges along an edge go through a vertex of their own at its middle.
  std::unordered_map<std::uint64_t, int> middle_of;  // (face, side) → vertex
  const auto side_key = [](int f, int side) { return static_cast<std::uint64_t>(f) * 3 + side; };
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces[f].vertices[k];
      const int b = faces[f].vertices[(k + 1) % 3];
      const std::vector<int>& around = faces_of_edge[edge_key(a, b)];
      if (around.size() <= 2 || middle_of.count(side_key(static_cast<int>(f), k)) > 0) continue;
      const auto [cell, opposite] = wedge_partner(faces[f], a, b);
      const int first = *std::min_element(around.begin(), around.end());
      for (const int g : around) {
        if (faces[g].cell != cell || faces[g].opposite != opposite) continue;
        if (static_cast<int>(f) == first || g == first) break;  // this wedge keeps the edge
        int side = 0;
        while (edge_key(faces[g].vertices[side], faces[g].vertices[(side + 1) % 3]) !=
               edge_key(a, b)) {
          ++side;
        }
        const int middle = static_cast<int>(mesh.vertices_m.size());
        mesh.vertices_m.push_back(0.5 * (points_m[a] + points_m[b]));
        middle_of[side_key(static_cast<int>(f), k)] = middle;
        middle_of[side_key(g, side)] = middle;
        break;
      }
    }
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    // The triangle with up to three middles is a convex polygon: a fan covers it. Starting at a
    // middle keeps every triangle of the fan from being flat.
    std::vector<int> ring;
    std::size_t start = 0;
    for (int k = 0; k < 3; ++k) {
      ring.push_back(vertex(faces[f].vertices[k]));
      const auto it = middle_of.find(side_key(static_cast<int>(f), k));
      if (it == middle_of.end()) continue;
      start = ring.size();
      ring.push_back(it->second);
    }
    std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(start), ring.end());
    if (ring.size() == 6) {  // three middles: corners cut off, then the middle triangle
      mesh.faces.push_back({ring[0], ring[1], ring[2]});
      mesh.faces.push_back({ring[2], ring[3], ring[4]});
      mesh.faces.push_back({ring[4], ring[5], ring[0]});
      mesh.faces.push_back({ring[0], ring[2], ring[4]});
      continue;
    }
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
      mesh.faces.push_back({ring[0], ring[k], ring[k + 1]});
    }
  }
  return mesh;
}

}  // namespace

AlphaShape alpha_shape(const std::vector<Vector3>& points_m, const AlphaShapeOptions& options) {
  if (options.alpha_m2 && !(*options.alpha_m2 > 0.0)) {
    throw InputError("alpha_m2: must be positive [m²]");
  }
  if (!options.core_rim.empty() && options.core_rim.size() != points_m.size()) {
    throw InputError("core_rim: needs one value a point");
  }
  AlphaShape result;
  Solid solid(points_m, options.core_rim);
  result.points_outside = static_cast<int>(points_m.size());
  if (solid.flat()) return result;
  result.alpha_m2 = options.alpha_m2
                        ? *options.alpha_m2
                        : solid.automatic_alpha(options.min_alpha_m2, options.max_alpha_m2);
  solid.set_alpha(result.alpha_m2);
  result.components = solid.components();
  result.points_outside = solid.points_outside();
  result.mesh = manifold_mesh(points_m, boundary_faces(solid.cells()));
  result.volume_m3 = mesh_volume_m3(result.mesh);
  result.watertight = is_watertight(result.mesh);
  return result;
}

}  // namespace cdprcal
