// Measured data that tests may read when it is there. It is not part of the repository.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace cdprcal::test {

/// Path of a file of the shared data, or empty when it is absent. Looked for in the folder named by
/// the environment variable CDPRCAL_SHARED_DATA, else in ../shared/data beside the repository.
///
///   const auto path = shared_data("irma4/trial_a.csv");
///   if (path.empty()) GTEST_SKIP() << "no shared data: irma4/trial_a.csv";
inline std::string shared_data(const std::string& name) {
  namespace fs = std::filesystem;
  const char* folder = std::getenv("CDPRCAL_SHARED_DATA");
  const fs::path repository = fs::path(__FILE__).parent_path() / ".." / ".." / "..";
  const fs::path path =
      (folder != nullptr ? fs::path(folder) : repository / ".." / "shared" / "data") / name;
  std::error_code error;
  return fs::exists(path, error) ? path.lexically_normal().string() : std::string();
}

}  // namespace cdprcal::test
