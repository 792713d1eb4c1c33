#include "cdprcal/lanes/processor.hpp"

#include <array>
#include <cstdlib>
#include <string>

#include "cdprcal/error.hpp"

namespace cdprcal::lanes {
namespace {

struct Name {
  const char* name;
  Processor processor;
};
constexpr std::array<Name, 3> kNames{
    {{"any", Processor::any}, {"avx2", Processor::avx2}, {"avx512", Processor::avx512}}};

std::string name_of(Processor processor) {
  return kNames[static_cast<std::size_t>(processor)].name;
}

void check(Processor wanted, Processor most) {
  if (wanted <= most) return;
  throw InputError("vectors: this processor has none of the kind " + name_of(wanted) +
                   "; set the environment variable CDPRCAL_VECTORS to " + name_of(most) +
                   ", or unset it");
}

Processor parse(const std::string& name) {
  for (const Name& one : kNames) {
    if (name == one.name) return one.processor;
  }
  throw InputError("vectors: '" + name +
                   "' is no kind of them; set the environment variable CDPRCAL_VECTORS to any, "
                   "avx2 or avx512, or unset it");
}

Features features_of_this_one() {
  Features features;
#ifdef CDPRCAL_HAS_AVX
  features.avx2 = __builtin_cpu_supports("avx2");
  features.fma = __builtin_cpu_supports("fma");
  features.avx512f = __builtin_cpu_supports("avx512f");
  features.avx512dq = __builtin_cpu_supports("avx512dq");
  features.avx512vl = __builtin_cpu_supports("avx512vl");
#endif
  return features;
}

Processor& chosen() {
  static Processor processor = [] {
    const char* const word = std::getenv("CDPRCAL_VECTORS");
    return choose_processor(word == nullptr ? "" : word, widest(features_of_this_one()));
  }();
  return processor;
}

}  // namespace

Processor widest(const Features& features) {
  if (!features.avx2 || !features.fma) return Processor::any;
  return features.avx512f && features.avx512dq && features.avx512vl ? Processor::avx512
                                                                    : Processor::avx2;
}

Processor choose_processor(const std::string& word, Processor most) {
  if (word.empty()) return most;
  const Processor wanted = parse(word);
  check(wanted, most);
  return wanted;
}

Processor processor() { return chosen(); }

void use_processor(Processor wanted) {
  check(wanted, widest(features_of_this_one()));
  chosen() = wanted;
}

}  // namespace cdprcal::lanes
