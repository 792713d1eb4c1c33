// Whole text files, read and written in one piece, and how a message quotes them.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace cdprcal {

/// What the file holds, up to `most` bytes. Throws InputError naming the path.
std::string read_text_file(const std::string& path,
                           std::size_t most = std::numeric_limits<std::size_t>::max());

/// Writes the file anew. Throws InputError naming the path when it cannot be created or completed.
void write_text_file(const std::string& path, const std::string& text);

/// The same text with a blank for every control character and line end, Unicode's (in UTF-8) among
/// them.
std::string one_line(std::string text);
/// Text of a file as a message may show it: on one line, without control characters, at most 40
/// bytes and "…". No UTF-8 character is cut in two.
std::string shown(std::string_view text);
/// The same between quotation marks: 'text'.
std::string in_quotes(std::string_view text);

}  // namespace cdprcal
