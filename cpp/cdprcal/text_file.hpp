// Whole text files, read and written in one piece.
#pragma once

#include <cstddef>
#include <limits>
#include <string>

namespace cdprcal {

/// What the file holds, up to `most` bytes. Throws InputError naming the path.
std::string read_text_file(const std::string& path,
                           std::size_t most = std::numeric_limits<std::size_t>::max());

/// Writes the file anew. Throws InputError naming the path when it cannot be created or completed.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace cdprcal
