// What a log is called in messages, and whether it has the samples that are asked for.
#pragma once

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Its source, or "the log" for one that was made in code without any.
std::string name_of(const Log& log);

/// Throws InputError for a range that does not lie within a log's samples; it may be empty.
void require_within(const SampleRange& range, const Log& log);
/// The same, but it must hold a sample.
void require_samples(const SampleRange& range, const Log& log);

}  // namespace cdprcal
