// NumPy's arrays that the Eigen caster reads as if they were plain numbers: masked ones by what is
// under the mask, dates and durations by the number of whatever they count.
#pragma once

#include <limits>

#include "bindings.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal::python {

/// The same with NaN where it is masked; anything but a masked array as it is.
inline py::object unmasked(py::handle values) {
  const py::module_ masked = py::module_::import("numpy.ma");
  if (!py::isinstance(values, masked.attr("MaskedArray"))) {
    return py::reinterpret_borrow<py::object>(values);
  }
  return values.attr("astype")("float64").attr("filled")(
      py::float_(std::numeric_limits<double>::quiet_NaN()));
}

/// Raises InputError for dates and durations.
inline void refuse_dates(py::handle values) {
  const py::object type = py::getattr(values, "dtype", py::none());
  if (type.is_none()) return;
  const auto kind = py::str(py::getattr(type, "kind", py::str("O"))).cast<std::string>();
  if (kind != "M" && kind != "m") return;
  throw InputError(
      "a column of dates or durations counts no seconds: give numbers, such as "
      "(t - t[0]) / numpy.timedelta64(1, 's')");
}

/// A matrix of readings, and a vector of times; what was masked is NaN, which is: not there.
struct Readings {
  LogMatrix values;
};
struct Times {
  Eigen::VectorXd values;
};

}  // namespace cdprcal::python

namespace pybind11::detail {

/// Of either, by the caster of its values.
template <class T, class Values>
struct unmasked_caster {
  PYBIND11_TYPE_CASTER(T, make_caster<Values>::name);

  bool load(handle source, bool convert) {
    cdprcal::python::refuse_dates(source);
    make_caster<Values> read;
    if (!read.load(cdprcal::python::unmasked(source), convert)) return false;
    value.values = cast_op<Values&&>(std::move(read));
    return true;
  }
};
template <>
struct type_caster<cdprcal::python::Readings>
    : unmasked_caster<cdprcal::python::Readings, cdprcal::LogMatrix> {};
template <>
struct type_caster<cdprcal::python::Times>
    : unmasked_caster<cdprcal::python::Times, Eigen::VectorXd> {};

}  // namespace pybind11::detail
