// Point sets and meshes whose volumes are known.
#pragma once

#include <vector>

#include "cdprcal/workspace/mesh.hpp"

namespace cdprcal::test {

/// Lattice points low … high (inclusive, in steps) as metres: step · index.
inline std::vector<Vector3> lattice(const std::array<int, 3>& low, const std::array<int, 3>& high,
                                    double step_m = 0.1) {
  std::vector<Vector3> points;
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) points.push_back(step_m * Vector3(i, j, k));
    }
  }
  return points;
}

/// Axis-aligned box, twelve triangles, outward (inward with `inside_out`).
inline void add_box(Mesh& mesh, const Vector3& low, const Vector3& high, bool inside_out = false) {
  const int base = static_cast<int>(mesh.vertices_m.size());
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices_m.emplace_back((corner & 1) != 0 ? high.x() : low.x(),
                                 (corner & 2) != 0 ? high.y() : low.y(),
                                 (corner & 4) != 0 ? high.z() : low.z());
  }
  constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : kQuads) {
    std::array<std::array<int, 3>, 2> halves{{{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}};
    for (auto& f : halves) {
      if (inside_out) std::swap(f[1], f[2]);
      for (int& v : f) v += base;
      mesh.faces.push_back(f);
    }
  }
}

}  // namespace cdprcal::test
