// Alpha shape of a point set (Edelsbrunner & Mücke 1994, the paper's [36]): the boundary of a
// workspace from the points inside it. CGAL stays behind this header.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/workspace/mesh.hpp"

namespace cdprcal {

struct AlphaShapeOptions {
  /// Squared radius [m²] (CGAL's convention): tetrahedra of the Delaunay triangulation with a
  /// circumscribed sphere of at most this are solid. Empty: automatic, the least for which the
  /// solid is one piece with every point in or on it, but no more than `max_alpha_m2`.
  std::optional<double> alpha_m2;
  /// Bounds of the automatic alpha; 0: none.
  double min_alpha_m2 = 0.0;
  double max_alpha_m2 = 0.0;
  /// To be faster, a caller may leave out points deep inside a set. Then core_rim has one value a
  /// point, true where every neighbour is inside the set (given or left out). A hollow with nothing
  /// but such points on its wall counts as solid. Empty: nothing was left out.
  std::vector<bool> core_rim;
};

struct AlphaShape {
  Mesh mesh;               ///< watertight, outward; vertices are input points (see below)
  double alpha_m2 = 0.0;   ///< used
  int components = 0;      ///< pieces of the solid (through faces)
  int points_outside = 0;  ///< input points neither in nor on the solid
  double volume_m3 = 0.0;  ///< of the solid
  bool watertight = false;
};

/// Regularised alpha shape: no dangling faces, edges or points. Where solid pieces meet in an edge
/// only, the boundary would have four faces there; the edge is doubled, one copy through an added
/// vertex at its middle, so every edge has exactly two faces.
/// Returns an empty mesh when fewer than four points, or all in a plane, or none fits.
/// Throws InputError for points that are not finite or an alpha that is not positive.
AlphaShape alpha_shape(const std::vector<Vector3>& points_m, const AlphaShapeOptions& options = {});

}  // namespace cdprcal
