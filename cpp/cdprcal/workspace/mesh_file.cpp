#include "cdprcal/workspace/mesh_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cctype>
#include <cstdint>
#include <sstream>

#include "cdprcal/error.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {
namespace {

static_assert(std::endian::native == std::endian::little, "mesh files are little-endian");

std::string extension(const std::string& path) {
  const std::size_t dot = path.find_last_of('.');
  std::string text = dot == std::string::npos ? std::string() : path.substr(dot + 1);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (text != "ply" && text != "stl") {
    throw InputError(path + ": a mesh file must end in .ply or .stl");
  }
  return text;
}

template <typename T>
void put(std::ostream& out, T value) {
  out.write(reinterpret_cast<const char*>(&value), sizeof(T));
}

Vector3 face_normal(const Mesh& mesh, const std::array<int, 3>& f) {
  const Vector3& a = mesh.vertices_m[f[0]];
  const Vector3 n = (mesh.vertices_m[f[1]] - a).cross(mesh.vertices_m[f[2]] - a);
  return n.norm() > 0.0 ? Vector3(n.normalized()) : Vector3::Zero();
}

void write_ply(std::ostream& out, const Mesh& mesh, MeshEncoding encoding) {
  const bool binary = encoding == MeshEncoding::binary;
  out << "ply\nformat " << (binary ? "binary_little_endian" : "ascii")
      << " 1.0\ncomment static workspace boundary, metres\nelement vertex "
      << mesh.vertices_m.size()
      << "\nproperty double x\nproperty double y\nproperty double z\nelement face "
      << mesh.faces.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  out.precision(17);
  for (const Vector3& v : mesh.vertices_m) {
    if (binary) {
      for (int a = 0; a < 3; ++a) put(out, v[a]);
    } else {
      out << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
    }
  }
  for (const auto& f : mesh.faces) {
    if (binary) {
      put(out, std::uint8_t{3});
      for (const int v : f) put(out, static_cast<std::int32_t>(v));
    } else {
      out << "3 " << f[0] << ' ' << f[1] << ' ' << f[2] << '\n';
    }
  }
}

void write_stl(std::ostream& out, const Mesh& mesh, MeshEncoding encoding) {
  if (encoding == MeshEncoding::binary) {
    char header[80] = "static workspace boundary, metres";
    out.write(header, sizeof(header));
    put(out, static_cast<std::uint32_t>(mesh.faces.size()));
    for (const auto& f : mesh.faces) {
      const Vector3 normal = face_normal(mesh, f);
      for (int a = 0; a < 3; ++a) put(out, static_cast<float>(normal[a]));
      for (const int v : f) {
        for (int a = 0; a < 3; ++a) put(out, static_cast<float>(mesh.vertices_m[v][a]));
      }
      put(out, std::uint16_t{0});
    }
    return;
  }
  out.precision(9);
  out << "solid workspace\n";
  for (const auto& f : mesh.faces) {
    const Vector3 n = face_normal(mesh, f);
    out << "facet normal " << n.x() << ' ' << n.y() << ' ' << n.z() << "\nouter loop\n";
    for (const int v : f) {
      const Vector3& p = mesh.vertices_m[v];
      out << "vertex " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid workspace\n";
}

}  // namespace

std::string format_mesh(const Mesh& mesh, const std::string& path, MeshEncoding encoding) {
  const bool ply = extension(path) == "ply";
  std::ostringstream out;
  if (ply) {
    write_ply(out, mesh, encoding);
  } else {
    write_stl(out, mesh, encoding);
  }
  return std::move(out).str();
}

void write_mesh(const std::string& path, const Mesh& mesh, MeshEncoding encoding) {
  write_text_file(path, format_mesh(mesh, path, encoding));
}

}  // namespace cdprcal
