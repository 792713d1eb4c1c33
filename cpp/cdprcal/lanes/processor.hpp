// Private to the library: which vectors to compute with, and functions for each kind of them.
#pragma once

#include <string>

#include "cdprcal/lanes/vectors.hpp"

namespace cdprcal::lanes {

/// Kinds of processor: what every one has, AVX2 with FMA, AVX-512. The last bits of results differ
/// between them, never between runs on one.
enum class Processor { any, avx2, avx512 };

/// The one whose vectors are used: the widest that this processor has, or what the environment
/// variable CDPRCAL_VECTORS says ("any", "avx2", "avx512"), so that two machines can compute alike.
/// Throws InputError for another word, and for what the processor does not have.
Processor processor();
/// Another one from now on, for tests; throws InputError where the processor does not have it.
void use_processor(Processor wanted);

/// What a processor can do, as far as it matters here.
struct Features {
  bool avx2 = false, fma = false;
  bool avx512f = false, avx512dq = false, avx512vl = false;
};
/// The widest of these features.
Processor widest(const Features& features);
/// What `word` names, or `most` where it is empty. Throws InputError for another word, and for what
/// is wider than `most`.
Processor choose_processor(const std::string& word, Processor most);

}  // namespace cdprcal::lanes

// NOLINTBEGIN(bugprone-macro-parentheses): the name of a template cannot be in parentheses
/// Defines `void function(const Argument&)`, which calls kernel<Kind>(argument, first lane) for all
/// lanes, with the Kind of processor().
#define CDPRCAL_DEFINE_FOR_ANY(function, kernel, Argument)              \
  void function##_any(const Argument& in) {                             \
    for (int first = 0; first < ::cdprcal::lanes::kLanes; first += 4) { \
      kernel<::cdprcal::lanes::Anywhere>(in, first);                    \
    }                                                                   \
  }
#if defined(__x86_64__) && defined(__GNUC__)
#define CDPRCAL_HAS_AVX 1
#define CDPRCAL_DEFINE_FOR_PROCESSORS(function, kernel, Argument)                       \
  CDPRCAL_DEFINE_FOR_ANY(function, kernel, Argument)                                    \
  __attribute__((target("avx2,fma"))) void function##_avx2(const Argument& in) {        \
    for (int first = 0; first < ::cdprcal::lanes::kLanes; first += 4) {                 \
      kernel<::cdprcal::lanes::Avx2>(in, first);                                        \
    }                                                                                   \
  }                                                                                     \
  __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma"))) void function##_avx512( \
      const Argument& in) {                                                             \
    kernel<::cdprcal::lanes::Avx512>(in, 0);                                            \
  }                                                                                     \
  void function(const Argument& in) {                                                   \
    const auto processor = ::cdprcal::lanes::processor();                               \
    if (processor == ::cdprcal::lanes::Processor::avx512) return function##_avx512(in); \
    if (processor == ::cdprcal::lanes::Processor::avx2) return function##_avx2(in);     \
    function##_any(in);                                                                 \
  }
#else
#define CDPRCAL_DEFINE_FOR_PROCESSORS(function, kernel, Argument) \
  CDPRCAL_DEFINE_FOR_ANY(function, kernel, Argument)              \
  void function(const Argument& in) { function##_any(in); }
#endif
// NOLINTEND(bugprone-macro-parentheses)
