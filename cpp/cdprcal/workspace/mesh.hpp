// Triangle meshes of a workspace's boundary: checks, volume, inclusion, cross-sections.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Closed surface; faces are counter-clockwise seen from outside.
struct Mesh {
  std::vector<Vector3> vertices_m;
  std::vector<std::array<int, 3>> faces;
};

/// Whether every edge belongs to exactly two faces, which run along it in opposite directions
/// (closed and consistently oriented). False for an empty mesh. `why`, when given, says what fails.
bool is_watertight(const Mesh& mesh, std::string* why = nullptr);

/// Enclosed volume by the divergence theorem; positive when the faces are oriented outward.
double mesh_volume_m3(const Mesh& mesh);
double mesh_area_m2(const Mesh& mesh);

/// Inclusion by the winding number (van Oosterom & Strackee 1983): robust to where edges lie.
/// Linear in the number of faces.
bool contains(const Mesh& mesh, const Vector3& position_m);

/// Closed polygon [m]; outer ones run counter-clockwise seen from above, holes clockwise.
using Polygon = std::vector<Eigen::Vector2d>;

/// The section of a watertight mesh with the plane z = height_m; empty when they do not meet. A
/// plane through vertices is shifted by 1e-9 of the mesh's height, so that every loop closes.
std::vector<Polygon> cross_section(const Mesh& mesh, double height_m);

/// Signed area: positive counter-clockwise. Over a section, holes count negative.
double polygon_area_m2(const Polygon& polygon);

}  // namespace cdprcal
