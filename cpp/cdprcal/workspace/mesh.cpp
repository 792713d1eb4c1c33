#include "cdprcal/workspace/mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <unordered_map>

namespace cdprcal {
namespace {

std::uint64_t directed(int from, int to) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(from)) << 32 |
         static_cast<std::uint32_t>(to);
}

}  // namespace

bool is_watertight(const Mesh& mesh, std::string* why) {
  const auto fail = [&](const std::string& reason) {
    if (why != nullptr) *why = reason;
    return false;
  };
  if (mesh.faces.empty()) return fail("the mesh has no faces");
  const int count = static_cast<int>(mesh.vertices_m.size());
  std::unordered_map<std::uint64_t, int> uses;
  uses.reserve(mesh.faces.size() * 3);
  for (const auto& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const int from = face[k];
      const int to = face[(k + 1) % 3];
      if (from < 0 || from >= count) return fail("a face names a vertex that does not exist");
      if (from == to) return fail("a face has the same vertex twice");
      if (++uses[directed(from, to)] > 1) return fail("two faces run along an edge the same way");
    }
  }
  for (const auto& face : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      if (uses.count(directed(face[(k + 1) % 3], face[k])) == 0) return fail("an edge is open");
    }
  }
  return true;
}

double mesh_volume_m3(const Mesh& mesh) {
  if (mesh.vertices_m.empty()) return 0.0;
  const Vector3 origin = mesh.vertices_m[0];
  double six = 0.0;
  for (const auto& f : mesh.faces) {
    const Vector3 a = mesh.vertices_m[f[0]] - origin;
    const Vector3 b = mesh.vertices_m[f[1]] - origin;
    const Vector3 c = mesh.vertices_m[f[2]] - origin;
    six += a.dot(b.cross(c));
  }
  return six / 6.0;
}

double mesh_area_m2(const Mesh& mesh) {
  double twice = 0.0;
  for (const auto& f : mesh.faces) {
    const Vector3 a = mesh.vertices_m[f[1]] - mesh.vertices_m[f[0]];
    const Vector3 b = mesh.vertices_m[f[2]] - mesh.vertices_m[f[0]];
    twice += a.cross(b).norm();
  }
  return 0.5 * twice;
}

bool contains(const Mesh& mesh, const Vector3& position_m) {
  double solid_angle = 0.0;
  for (const auto& f : mesh.faces) {
    const Vector3 a = mesh.vertices_m[f[0]] - position_m;
    const Vector3 b = mesh.vertices_m[f[1]] - position_m;
    const Vector3 c = mesh.vertices_m[f[2]] - position_m;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    solid_angle += 2.0 * std::atan2(a.dot(b.cross(c)), denominator);
  }
  return solid_angle > 2.0 * kPi;  // half of the full angle
}

std::vector<Polygon> cross_section(const Mesh& mesh, double height_m) {
  if (mesh.vertices_m.empty() || !std::isfinite(height_m)) return {};
  double low = mesh.vertices_m[0].z();
  double high = low;
  for (const Vector3& v : mesh.vertices_m) {
    low = std::min(low, v.z());
    high = std::max(high, v.z());
  }
  if (height_m < low || height_m > high) return {};
  // No vertex may lie in the plane; towards the middle, so that the ends of the mesh still cut it.
  const double shift = (height_m < 0.5 * (low + high) ? 1e-9 : -1e-9) * (high - low);
  const auto touches = [&](const Vector3& v) { return v.z() == height_m; };
  while (std::any_of(mesh.vertices_m.begin(), mesh.vertices_m.end(), touches) && shift != 0.0) {
    height_m += shift;
  }

  // Each cut face gives one segment from the edge along which it goes down through the plane to the
  // one along which it goes up; the other face of that edge goes on from there: a loop.
  struct Cut {
    std::uint64_t next;
    Eigen::Vector2d point;
  };
  const auto undirected = [](int a, int b) { return directed(std::min(a, b), std::max(a, b)); };
  const auto crossing = [&](int a, int b) -> Eigen::Vector2d {
    const Vector3& p = mesh.vertices_m[std::min(a, b)];
    const Vector3& q = mesh.vertices_m[std::max(a, b)];
    const double t = (height_m - p.z()) / (q.z() - p.z());
    return (p + t * (q - p)).head<2>();
  };
  std::unordered_map<std::uint64_t, Cut> cuts;
  std::vector<std::uint64_t> order;
  for (const auto& f : mesh.faces) {
    std::uint64_t up = 0;
    std::uint64_t down = 0;
    Eigen::Vector2d point = Eigen::Vector2d::Zero();
    bool cut = false;
    for (int k = 0; k < 3; ++k) {
      const int a = f[k];
      const int b = f[(k + 1) % 3];
      const bool below_a = mesh.vertices_m[a].z() < height_m;
      const bool below_b = mesh.vertices_m[b].z() < height_m;
      if (below_a == below_b) continue;
      cut = true;
      if (below_a) {
        up = undirected(a, b);
      } else {
        down = undirected(a, b);
        point = crossing(a, b);
      }
    }
    if (!cut) continue;
    // Outward counter-clockwise faces: going from the falling edge to the rising one keeps the
    // inside on the left, seen from above.
    cuts[down] = {up, point};
    order.push_back(down);
  }
  std::vector<Polygon> polygons;
  for (const std::uint64_t start : order) {
    Polygon polygon;
    for (std::uint64_t at = start; cuts.count(at) > 0;) {
      const Cut cut = cuts[at];
      cuts.erase(at);
      polygon.push_back(cut.point);
      at = cut.next;
    }
    if (polygon.size() >= 3) polygons.push_back(std::move(polygon));
  }
  return polygons;
}

double polygon_area_m2(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Eigen::Vector2d& a = polygon[k];
    const Eigen::Vector2d& b = polygon[(k + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

}  // namespace cdprcal
