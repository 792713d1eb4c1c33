// Progress of a long call: a Python callback, Ctrl-C, and neither thrown through C++ threads.
#pragma once

#include <pybind11/typing.h>

#include <exception>
#include <optional>
#include <utility>

#include "bindings.hpp"

namespace cdprcal::python {

/// A callable of these arguments, or None; what it returns matters only when it is False.
template <typename... Values>
using ProgressCallback = std::optional<py::typing::Callable<py::object(Values...)>>;

/// Asks Python now and then whether to go on. The GIL is not held between. An exception of the
/// callback, or Ctrl-C, stops the calculation like False does; rethrow it when the call is back.
class Progress {
 public:
  template <typename Callback>
  explicit Progress(const std::optional<Callback>& callback)
      : callback_(callback ? std::optional<py::function>(*callback) : std::nullopt) {}

  template <typename... Values>
  bool operator()(const Values&... values) {
    if (failure_) return false;
    const py::gil_scoped_acquire gil;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return !callback_ || !(*callback_)(values...).is(py::bool_(false));
    } catch (...) {
      failure_ = std::current_exception();
      return false;
    }
  }

  /// Needs the GIL.
  void rethrow() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

 private:
  std::optional<py::function> callback_;
  std::exception_ptr failure_;
};

}  // namespace cdprcal::python
