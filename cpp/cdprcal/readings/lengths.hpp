// What is read of the cables' lengths, whatever it counts from.
#pragma once

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Changes of the cables' lengths or, where a log has none, whole ones; null: neither.
LogMatrix* read_lengths(Log& log);
const LogMatrix* read_lengths(const Log& log);

}  // namespace cdprcal
