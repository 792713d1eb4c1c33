// Methods that are written in Python: how results look to people, and what they become.
#pragma once

#include "bindings.hpp"

namespace cdprcal::python {

/// cdprcal.people.<function>: text, tables, pictures and pickles are no business of C++.
inline py::object people(const char* function) {
  return py::module_::import("cdprcal.people").attr(function);
}

/// repr, HTML of notebooks, pandas.DataFrame, picture and pickle. `rows`: what a row of the frame
/// is.
template <typename... Types>
void def_people(py::class_<Types...>& cls, const char* rows, bool pickles) {
  cls.def("_repr_html_", [](const py::object& self) { return py::str(people("html_of")(self)); })
      .def(
          "to_pandas", [](const py::object& self) { return people("frame_of")(self); }, rows)
      .def(
          "plot",
          [](const py::object& self, const py::object& ax) { return people("plot_of")(self, ax); },
          py::arg("ax") = py::none(),
          "Draws into a matplotlib Axes (None: a new one), which is returned.");
  if (pickles) {
    cls.def("__reduce__",
            [](const py::object& self) { return py::tuple(people("reduced")(self)); });
  }
}

/// A repr that is written in Python.
template <typename... Types>
void def_repr(py::class_<Types...>& cls) {
  cls.def("__repr__", [](const py::object& self) { return py::str(people("text_of")(self)); });
}

}  // namespace cdprcal::python
