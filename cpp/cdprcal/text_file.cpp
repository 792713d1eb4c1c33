#include "cdprcal/text_file.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "cdprcal/error.hpp"

namespace cdprcal {

std::string read_text_file(const std::string& path, std::size_t most) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path + ": is a folder, not a file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path + ": cannot be opened");
  std::string text;
  std::array<char, 1 << 16> block;
  while (text.size() < most) {
    const std::size_t wanted = std::min(block.size(), most - text.size());
    file.read(block.data(), static_cast<std::streamsize>(wanted));
    const auto got = static_cast<std::size_t>(file.gcount());
    text.append(block.data(), got);
    if (got < wanted) break;
  }
  if (file.bad()) throw InputError(path + ": cannot be read (a failing disk?)");
  return text;
}

void write_text_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) throw InputError(path + ": cannot be created");
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) throw InputError(path + ": could not be written to its end (disk full?)");
}

}  // namespace cdprcal
