// What the module was built with.
#pragma once

#include "bindings.hpp"

namespace cdprcal::python {

void register_versions(py::module_& module);

}  // namespace cdprcal::python
