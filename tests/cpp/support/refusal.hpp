// What a call is refused with.
#pragma once

#include <string>

#include "cdprcal/error.hpp"

namespace cdprcal::test {

/// The message of its InputError; "accepted" where there is none.
template <class Call>
std::string refusal_of(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace cdprcal::test
