// Hands the files of a corpus to a target that is built without libFuzzer: a test for every build.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "cdprcal/text_file.hpp"
#include "target.hpp"

namespace {

constexpr double kLongest_s = 1.0;

std::vector<std::string> files_of(int count, char** arguments) {
  std::vector<std::string> files;
  for (int i = 1; i < count; ++i) {
    if (!std::filesystem::is_directory(arguments[i])) {
      files.emplace_back(arguments[i]);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(arguments[i])) {
      files.push_back(entry.path().string());
    }
  }
  return files;
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> files = files_of(count, arguments);
  if (files.empty()) {
    std::fprintf(stderr, "usage: %s FILE_OR_FOLDER…\n", arguments[0]);
    return 2;
  }
  int slow = 0;
  for (const std::string& file : files) {
    const std::string text = cdprcal::read_text_file(file);
    const auto begin = std::chrono::steady_clock::now();
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    if (took.count() <= kLongest_s) continue;
    std::fprintf(stderr, "%s: took %.2f s\n", file.c_str(), took.count());
    ++slow;
  }
  std::printf("%zu files\n", files.size());
  return slow == 0 ? 0 : 1;
}
