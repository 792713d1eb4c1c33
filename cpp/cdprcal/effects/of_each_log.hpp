// Effects of the robot that differ from log to log: it was changed between them.
#pragma once

#include <memory>

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// An effect of the catalogue that is the robot's own, with values of each run's own; always the
/// same one. Nothing for effects that are so by nature, and for those that people wrote: they say
/// themselves whose they are.
std::shared_ptr<const Effect> of_each_log(const std::shared_ptr<const Effect>& effect);

/// The effect of the catalogue behind one of these; any other is itself.
std::shared_ptr<const Effect> of_all_logs(const std::shared_ptr<const Effect>& effect);

/// Whether an effect is one of these.
bool is_of_each_log(const Effect& effect);

}  // namespace cdprcal
