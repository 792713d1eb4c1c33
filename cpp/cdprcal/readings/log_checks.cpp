#include "cdprcal/readings/log_checks.hpp"

#include "cdprcal/error.hpp"

namespace cdprcal {

std::string name_of(const Log& log) { return log.source.empty() ? "the log" : log.source; }

void require_within(const SampleRange& range, const Log& log) {
  if (range.begin < 0 || range.end < range.begin || range.end > log.sample_count()) {
    throw InputError("range: [" + std::to_string(range.begin) + ", " + std::to_string(range.end) +
                     ") is not within the log's " + std::to_string(log.sample_count()) +
                     " samples; give one that is");
  }
}

void require_samples(const SampleRange& range, const Log& log) {
  require_within(range, log);
  if (range.size() < 1) throw InputError("range: must hold a sample; give one that does");
}

}  // namespace cdprcal
