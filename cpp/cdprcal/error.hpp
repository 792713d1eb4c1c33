// The one exception of the library: input that cannot be used, with the place and the remedy.
#pragma once

#include <stdexcept>
#include <string>

namespace cdprcal {

/// Wrong use or unusable input. The message names the file, line or field and what to do.
/// Numerical failure is never an exception: it is a status in the result.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cdprcal
