// PLY and STL meshes: the first byte picks the format.
#include "cdprcal/workspace/mesh.hpp"

#include "cdprcal/workspace/mesh_file.hpp"
#include "target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using fuzz::require;
  if (size == 0) return 0;
  const std::string source = data[0] % 2 == 0 ? "mesh.ply" : "mesh.stl";
  cdprcal::Mesh mesh;
  const bool accepted = fuzz::accepts(
      source, [&] { mesh = cdprcal::parse_mesh(fuzz::text_of(data + 1, size - 1), source); });
  if (!accepted) return 0;
  for (const cdprcal::Vector3& vertex : mesh.vertices_m) require(vertex.allFinite(), "a vertex");
  const auto count = static_cast<int>(mesh.vertices_m.size());
  for (const auto& face : mesh.faces) {
    for (const int corner : face) require(corner >= 0 && corner < count, "a face");
  }
  cdprcal::is_watertight(mesh);
  for (const auto encoding : {cdprcal::MeshEncoding::binary, cdprcal::MeshEncoding::ascii}) {
    const std::string written = cdprcal::format_mesh(mesh, source, encoding);
    const cdprcal::Mesh again = cdprcal::parse_mesh(written, source);
    require(again.faces.size() == mesh.faces.size(), "the faces of a round trip");
    require(cdprcal::format_mesh(again, source, encoding) == written, "round trip");
  }
  return 0;
}
