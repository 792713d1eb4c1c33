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

}  // namespace cdprcal
