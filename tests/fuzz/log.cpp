// The canonical log.
#include "cdprcal/readings/log.hpp"

#include "target.hpp"

using fuzz::require;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string source = "log.csv";
  cdprcal::Log log;
  const bool accepted =
      fuzz::accepts(source, [&] { log = cdprcal::parse_log(fuzz::text_of(data, size), source); });
  if (!accepted) return 0;
  cdprcal::validate(log);  // shapes, times that increase, no infinities
  require(log.cable_count() <= cdprcal::kMaxCables, "number of cables");
  const auto runs = cdprcal::segments(log);
  require(!runs.empty() && runs.front().begin == 0 && runs.back().end == log.sample_count(),
          "segments");
  const std::string written = cdprcal::format_log(log);
  require(cdprcal::format_log(cdprcal::parse_log(written, source)) == written, "round trip");
  return 0;
}
