#include "cdprcal/workspace/mesh_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <map>
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

/// Reads plain values from a byte string, refusing to run past its end.
class Bytes {
 public:
  /// `at` is within the data.
  Bytes(const std::string& data, std::size_t at, const std::string& path)
      : data_(data), at_(at), path_(path) {}
  template <typename T>
  T take() {
    if (data_.size() - at_ < sizeof(T))
      throw InputError(path_ + ": the file ends too early; write it anew");
    T value;
    std::memcpy(&value, data_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }

 private:
  const std::string& data_;
  std::size_t at_;
  const std::string& path_;
};

void check_mesh(const Mesh& mesh, const std::string& path) {
  const int count = static_cast<int>(mesh.vertices_m.size());
  for (const Vector3& v : mesh.vertices_m) {
    if (!v.allFinite()) throw InputError(path + ": vertices must be finite");
  }
  for (const auto& f : mesh.faces) {
    for (const int v : f) {
      if (v < 0 || v >= count)
        throw InputError(path + ": a face names a vertex that is not there; write it anew");
    }
  }
}

/// A count in a header. More elements than the file has bytes are refused before anything of that
/// size is made.
std::size_t element_count(const std::string& word, const std::string& data,
                          const std::string& path) {
  std::size_t count = 0;
  const char* const end = word.data() + word.size();
  const auto [stop, status] = std::from_chars(word.data(), end, count);
  if (status == std::errc::result_out_of_range || (stop == end && count > data.size())) {
    throw InputError(path + ": the file ends too early; write it anew");
  }
  if (status != std::errc{} || stop != end) {
    throw InputError(path + ": the header does not say how many elements there are; write it anew");
  }
  return count;
}

Mesh read_ply(const std::string& data, const std::string& path) {
  std::istringstream header(data);
  std::string line;
  std::string format;
  std::string scalar;
  std::string index = "int";
  std::size_t vertices = 0;
  std::size_t faces = 0;
  int coordinates = 0;
  bool ended = false;
  while (!ended && std::getline(header, line)) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::istringstream words(line);
    std::string word, a, b, c, d;
    words >> word >> a >> b >> c >> d;
    if (word == "format") format = a;
    if (word == "element" && a == "vertex") vertices = element_count(b, data, path);
    if (word == "element" && a == "face") faces = element_count(b, data, path);
    if (word == "property" && a != "list") {
      if (coordinates > 2 || b != std::string(1, "xyz"[coordinates])) {
        throw InputError(path + ": vertices must have x, y, z and nothing else");
      }
      scalar = a;
      ++coordinates;
    }
    if (word == "property" && a == "list") index = c;
    ended = word == "end_header";
  }
  const bool binary = format == "binary_little_endian";
  const bool wide = scalar == "double" || scalar == "float64";
  if (!ended || coordinates != 3 || (!binary && format != "ascii") ||
      (!wide && scalar != "float" && scalar != "float32")) {
    throw InputError(path +
                     ": must be a PLY triangle mesh (ASCII or binary little-endian, float or "
                     "double coordinates)");
  }
  Mesh mesh;
  if (!binary) {
    for (std::size_t k = 0; k < vertices; ++k) {
      Vector3 v;
      if (!(header >> v.x() >> v.y() >> v.z()))
        throw InputError(path + ": a vertex is unreadable; write it anew");
      mesh.vertices_m.push_back(v);
    }
    for (std::size_t k = 0; k < faces; ++k) {
      int corners = 0;
      std::array<int, 3> f{};
      if (!(header >> corners >> f[0] >> f[1] >> f[2]) || corners != 3) {
        throw InputError(path + ": a face is unreadable, or not a triangle as it must be");
      }
      mesh.faces.push_back(f);
    }
  } else {
    if (index != "int" && index != "int32" && index != "uint" && index != "uint32") {
      throw InputError(path + ": vertex indices must be 32-bit integers");
    }
    // A header that ends with the file has no position, and nothing behind it.
    const auto at = header.eof() ? data.size() : static_cast<std::size_t>(header.tellg());
    Bytes bytes(data, at, path);
    for (std::size_t k = 0; k < vertices; ++k) {
      Vector3 v;
      for (int a = 0; a < 3; ++a) v[a] = wide ? bytes.take<double>() : bytes.take<float>();
      mesh.vertices_m.push_back(v);
    }
    for (std::size_t k = 0; k < faces; ++k) {
      if (bytes.take<std::uint8_t>() != 3) throw InputError(path + ": faces must be triangles");
      std::array<int, 3> f{};
      for (int& v : f) v = bytes.take<std::int32_t>();
      mesh.faces.push_back(f);
    }
  }
  return mesh;
}

/// Corners become vertices: the same place is the same vertex.
class Corners {
 public:
  int vertex(const std::array<float, 3>& p) {
    const auto [it, added] = known_.try_emplace(p, static_cast<int>(mesh.vertices_m.size()));
    if (added) mesh.vertices_m.emplace_back(p[0], p[1], p[2]);
    return it->second;
  }
  Mesh mesh;

 private:
  std::map<std::array<float, 3>, int> known_;
};

Mesh read_stl(const std::string& data, const std::string& path) {
  Corners corners;
  std::uint32_t faces = 0;
  if (data.size() >= 84) std::memcpy(&faces, data.data() + 80, sizeof(faces));
  // The size decides: binary files may start with "solid" too.
  if (data.size() >= 84 && data.size() == 84 + 50ULL * faces) {
    Bytes bytes(data, 84, path);
    for (std::uint32_t k = 0; k < faces; ++k) {
      for (int a = 0; a < 3; ++a) bytes.take<float>();
      std::array<int, 3> f{};
      for (int& v : f) {
        std::array<float, 3> p{};
        for (float& x : p) {
          x = bytes.take<float>();
          if (!std::isfinite(x)) throw InputError(path + ": vertices must be finite");
        }
        v = corners.vertex(p);
      }
      bytes.take<std::uint16_t>();
      corners.mesh.faces.push_back(f);
    }
    return corners.mesh;
  }
  if (data.compare(0, 5, "solid") != 0) throw InputError(path + ": must be an STL file");
  std::istringstream in(data);
  std::string word;
  std::vector<int> pending;
  while (in >> word) {
    if (word == "vertex") {
      std::array<float, 3> p{};
      if (!(in >> p[0] >> p[1] >> p[2]))
        throw InputError(path + ": a vertex is unreadable; write it anew");
      pending.push_back(corners.vertex(p));
    } else if (word == "endloop") {
      if (pending.size() != 3) throw InputError(path + ": facets must be triangles");
      corners.mesh.faces.push_back({pending[0], pending[1], pending[2]});
      pending.clear();
    }
  }
  if (!pending.empty()) throw InputError(path + ": the file ends too early; write it anew");
  return corners.mesh;
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

Mesh parse_mesh(const std::string& data, const std::string& path) {
  Mesh mesh = extension(path) == "ply" ? read_ply(data, path) : read_stl(data, path);
  check_mesh(mesh, path);
  return mesh;
}

Mesh read_mesh(const std::string& path) {
  extension(path);  // a file that is no mesh by its name is not read at all
  return parse_mesh(read_text_file(path), path);
}

}  // namespace cdprcal
