#include "cdprcal/text_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// A pipe or a device may never end.
void refuse_unless_file(const std::string& path) {
  std::error_code ignored;
  switch (std::filesystem::status(path, ignored).type()) {
    case std::filesystem::file_type::directory:
      throw InputError(path + ": is a folder; give the path of a file");
    case std::filesystem::file_type::fifo:
      throw InputError(path + ": is a pipe: save what comes out of it to a file first");
    case std::filesystem::file_type::character:
    case std::filesystem::file_type::block:
      throw InputError(path + ": is a device; give the path of a file");
    case std::filesystem::file_type::socket:
      throw InputError(path + ": is a socket; give the path of a file");
    default:
      break;
  }
}

}  // namespace

std::string read_text_file(const std::string& path, std::size_t most) {
  refuse_unless_file(path);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path + ": cannot be opened" +
                     (errno != 0 ? ": " + std::generic_category().message(errno) : "") +
                     "; check the path and its permissions");
  }
  std::string text;
  std::array<char, 1 << 16> block;
  while (text.size() < most) {
    const std::size_t wanted = std::min(block.size(), most - text.size());
    file.read(block.data(), static_cast<std::streamsize>(wanted));
    const auto got = static_cast<std::size_t>(file.gcount());
    text.append(block.data(), got);
    if (got < wanted) break;
  }
  if (file.bad()) throw InputError(path + ": cannot be read; look at the disk");
  return text;
}

void write_text_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) throw InputError(path + ": cannot be created; check the path and its permissions");
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) throw InputError(path + ": could not be written to its end; free some space");
}

std::string one_line(std::string text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  std::size_t end = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    // In UTF-8: U+0080 to U+009F, which terminals obey too; U+2028 and U+2029, which end a line.
    const bool high = byte(i) == 0xC2 && byte(i + 1) >= 0x80 && byte(i + 1) <= 0x9F;
    const bool line_end =
        byte(i) == 0xE2 && byte(i + 1) == 0x80 && (byte(i + 2) == 0xA8 || byte(i + 2) == 0xA9);
    const bool control = byte(i) < 0x20 || byte(i) == 0x7F || high || line_end;
    text[end++] = control ? ' ' : text[i];
    i += high ? 1 : line_end ? 2 : 0;
  }
  text.resize(end);
  return text;
}

std::string shown(std::string_view text) {
  constexpr std::size_t longest = 40;
  const bool cut = text.size() > longest;
  if (cut) {
    std::size_t end = longest;
    // Continuation bytes are 10xxxxxx; a character has three of them at most.
    while (end > longest - 3 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    text = text.substr(0, end);
  }
  return one_line(std::string(text)) + (cut ? "…" : "");
}

std::string in_quotes(std::string_view text) { return "'" + shown(text) + "'"; }

}  // namespace cdprcal
