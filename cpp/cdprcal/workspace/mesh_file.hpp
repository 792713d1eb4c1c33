// Meshes as PLY and STL files, both ways.
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

/// Reads what write_mesh writes, and other files of these formats with triangles only: PLY ASCII
/// or binary little-endian with float or double x, y, z; STL ASCII or binary, corners at exactly
/// the same place becoming one vertex. Throws InputError with the file's name on anything else,
/// vertices that are not finite among it. parse_mesh takes the file's bytes.
Mesh read_mesh(const std::string& path);
Mesh parse_mesh(const std::string& data, const std::string& path);

}  // namespace cdprcal
