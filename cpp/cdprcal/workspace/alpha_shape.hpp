// Alpha shape of a point set (Edelsbrunner & Mücke 1994, the paper's [36]): the boundary of a
// workspace from the points inside it. CGAL stays behind this header.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/workspace/mesh.hpp"
#include "cdprcal/workspace/workspace.hpp"

namespace cdprcal {

struct AlphaShapeOptions {
  /// Squared radius [m²] (CGAL's convention): tetrahedra of the Delaunay triangulation with a
  /// circumscribed sphere of at most this are solid. Empty: automatic, the least for which the
  /// solid is one piece with every point in or on it, but no more than `max_alpha_m2`.
  std::optional<double> alpha_m2;
  /// Bounds of the automatic alpha; 0: none.
  double min_alpha_m2 = 0.0;
  double max_alpha_m2 = 0.0;
};

struct AlphaShape {
  Mesh mesh;              ///< watertight, outward; vertices are input points (see below)
  double alpha_m2 = 0.0;  ///< used
  int components = 0;     ///< pieces of the solid (through faces)
  int points_outside = 0; ///< input points neither in nor on the solid
  double volume_m3 = 0.0; ///< of the solid
  bool watertight = false;
};

/// Regularised alpha shape: no dangling faces, edges or points. Where solid pieces meet in an edge
/// only, the boundary would have four faces there; the edge is doubled, one copy through an added
/// vertex at its middle, so every edge has exactly two faces.
/// Returns an empty mesh when fewer than four points, or all in a plane, or none fits.
/// Throws InputError for points that are not finite or an alpha that is not positive.
AlphaShape alpha_shape(const std::vector<Vector3>& points_m, const AlphaShapeOptions& options = {});

/// Of a workspace: grid points inside and boundary points. Automatic alpha: at least step² (a grid
/// cell needs ¾ step²), so that full cells are solid; at most (2 · step)², so that hollows wider
/// than four steps stay hollow; the least in between with one piece and no point outside.
/// Points deep inside are left out of the triangulation and their space is solid as it is: the
/// result is the same, sooner.
AlphaShape workspace_shape(const Workspace& workspace,
                           const std::optional<double>& alpha_m2 = std::nullopt);

}  // namespace cdprcal
