// NumPy's masked arrays: the Eigen caster reads the data under the mask as if it were good.
#pragma once

#include <limits>

#include "bindings.hpp"
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

/// A matrix of readings; what was masked is NaN, which is: not there.
struct Readings {
  LogMatrix values;
};

}  // namespace cdprcal::python

namespace pybind11::detail {

template <>
struct type_caster<cdprcal::python::Readings> {
  PYBIND11_TYPE_CASTER(cdprcal::python::Readings, make_caster<cdprcal::LogMatrix>::name);

  bool load(handle source, bool convert) {
    make_caster<cdprcal::LogMatrix> matrix;
    if (!matrix.load(cdprcal::python::unmasked(source), convert)) return false;
    value.values = cast_op<cdprcal::LogMatrix&&>(std::move(matrix));
    return true;
  }
};

}  // namespace pybind11::detail
