// NAME=v1,v2,…: an effect on the command line.
#include "cdprcal/simulator/injected_effect.hpp"

#include "target.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using fuzz::require;
  const std::string source = "effect ";
  cdprcal::InjectedEffect effect;
  const bool accepted = fuzz::accepts(
      source, [&] { effect = cdprcal::parse_injected_effect(fuzz::text_of(data, size)); });
  if (!accepted) return 0;
  const std::string written = cdprcal::to_string(effect);
  require(cdprcal::to_string(cdprcal::parse_injected_effect(written)) == written, "round trip");
  for (int cables = 1; cables <= cdprcal::kMaxCables; ++cables) {
    fuzz::accepts(source, [&] {
      for (const double value : cdprcal::expanded(effect, cables).values) {
        require(std::isfinite(value), "a value");
      }
    });
  }
  return 0;
}
