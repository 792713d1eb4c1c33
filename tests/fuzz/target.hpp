// What the fuzz targets share: the contract of every parser, and how a target says that it broke.
//
// A target hands any bytes to one parser. The parser either accepts them, and then what it made is
// finite where it must be and survives being written and read again; or it throws InputError with a
// message that begins with the source's name, is of one line and of bounded length. Anything else
// (another exception, a sanitizer's finding, more than a second) is a bug.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "cdprcal/error.hpp"

/// The one function of a target; libFuzzer's main or that of replay.cpp calls it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace fuzz {

[[noreturn]] inline void broken(const std::string& what) {
  std::fprintf(stderr, "the contract is broken: %s\n", what.c_str());
  std::abort();
}

inline void require(bool holds, const char* what) {
  if (!holds) broken(what);
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Runs `read`. True when it took its input; false when it refused it as it should.
template <class Read>
bool accepts(const std::string& source, const Read& read) {
  constexpr std::size_t longest_message = 2000;
  try {
    read();
    return true;
  } catch (const cdprcal::InputError& error) {
    const std::string message = error.what();
    if (message.compare(0, source.size(), source) != 0) broken("no source in: " + message);
    if (message.size() > longest_message) broken("an endless message: " + message);
    for (const char c : message) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
        broken("control characters in: " + message);
      }
    }
  } catch (const std::exception& error) {
    broken(std::string("not an InputError: ") + error.what());
  }
  return false;
}

}  // namespace fuzz
