#include "cdprcal/lanes/processor.hpp"

#include <array>
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

Processor widest() {
#ifdef CDPRCAL_HAS_AVX
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl")) {
    return Processor::avx512;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return Processor::avx2;
#endif
  return Processor::any;
}

std::string name_of(Processor processor) {
  return kNames[static_cast<std::size_t>(processor)].name;
}

void check(Processor wanted) {
  if (wanted <= widest()) return;
  throw InputError("vectors: this processor has none of the kind " + name_of(wanted) +
                   "; set the environment variable CDPRCAL_VECTORS to " + name_of(widest()) +
                   ", or unset it");
}

Processor from_environment() {
  const char* const wanted = std::getenv("CDPRCAL_VECTORS");
  if (wanted == nullptr || *wanted == '\0') return widest();
  const Processor processor = parse_processor(wanted);
  check(processor);
  return processor;
}

Processor& chosen() {
  static Processor processor = from_environment();
  return processor;
}

}  // namespace

Processor parse_processor(const std::string& name) {
  for (const Name& one : kNames) {
    if (name == one.name) return one.processor;
  }
  throw InputError("vectors: '" + name +
                   "' is no kind of them; set the environment variable CDPRCAL_VECTORS to any, "
                   "avx2 or avx512, or unset it");
}

Processor processor() { return chosen(); }

void use_processor(Processor wanted) {
  check(wanted);
  chosen() = wanted;
}

}  // namespace cdprcal::lanes
