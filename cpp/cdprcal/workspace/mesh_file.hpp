// Meshes as PLY and STL files, for other programs: nothing here reads them.
#pragma once

#include <string>

#include "cdprcal/workspace/mesh.hpp"

namespace cdprcal {

enum class MeshEncoding { binary, ascii };

/// Writes by the extension of `path`: .ply (double precision vertices) or .stl (single precision,
/// as the format demands). Binary is little-endian. Throws InputError when the extension is another
/// or the file cannot be written. format_mesh gives the bytes of that file.
void write_mesh(const std::string& path, const Mesh& mesh,
                MeshEncoding encoding = MeshEncoding::binary);
std::string format_mesh(const Mesh& mesh, const std::string& path,
                        MeshEncoding encoding = MeshEncoding::binary);

}  // namespace cdprcal
