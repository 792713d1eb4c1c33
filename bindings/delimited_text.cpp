// readings/delimited_text, readings/json_messages: what importers of other logs are built on.
#include "cdprcal/readings/delimited_text.hpp"

#include <pybind11/numpy.h>
#include <pybind11/typing.h>

#include <memory>

#include "bindings.hpp"
#include "cdprcal/readings/json_messages.hpp"

namespace cdprcal::python {
namespace {

/// The bytes of an object with the buffer protocol, where they are.
std::string_view bytes_of(const py::buffer_info& info) {
  if (info.itemsize != 1 || info.ndim != 1 || (info.size > 1 && info.strides[0] != 1)) {
    throw InputError("text: must be bytes, or a contiguous array of them");
  }
  return {static_cast<const char*>(info.ptr), static_cast<std::size_t>(info.size)};
}

/// Anything with the buffer protocol; Python 3.11 has no name for that.
using Bytes = py::typing::Union<py::bytes, py::array_t<std::uint8_t>>;

/// The vector's own memory as an array that keeps it alive.
template <class T>
py::array_t<T> as_array(std::vector<T> values) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  const auto size = static_cast<py::ssize_t>(owned->size());
  T* const data = owned->data();
  const py::capsule keeper(owned.release(),
                           [](void* held) { delete static_cast<std::vector<T>*>(held); });
  return py::array_t<T>(size, data, keeper);
}

using Integers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

std::span<const std::int64_t> span_of(const Integers& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

py::typing::Tuple<py::array_t<std::int64_t>, py::array_t<std::int32_t>> lines_of(
    const Bytes& text) {
  const py::buffer_info info = py::buffer(text).request();
  TextLines lines;
  {
    const py::gil_scoped_release without_lock;
    lines = text_lines(bytes_of(info));
  }
  return py::make_tuple(as_array(std::move(lines.begin)), as_array(std::move(lines.commas)));
}

/// Line, column and text of a wrong cell.
using Wrong = py::typing::Tuple<py::int_, py::int_, py::bytes>;
using Table = py::typing::Tuple<py::array_t<double>, py::typing::Optional<Wrong>>;

Table numbers_of(const Bytes& text, const Integers& begin, const Integers& columns) {
  const py::buffer_info info = py::buffer(text).request();
  NumberTable table;
  {
    const py::gil_scoped_release without_lock;
    table = number_table(bytes_of(info), span_of(begin), span_of(columns));
  }
  py::object wrong = py::none();
  if (table.wrong) {
    const WrongCell& cell = *table.wrong;
    wrong = py::make_tuple(cell.line, cell.column, py::bytes(cell.text.data(), cell.text.size()));
  }
  return py::make_tuple(py::cast(std::move(table.values)), wrong);
}

using Messages =
    py::typing::Tuple<py::int_, py::typing::List<py::str>, py::array_t<double>, py::array_t<bool>>;

py::typing::Optional<Messages> messages_of(const py::bytes& records,
                                           const std::vector<std::uint16_t>& channels) {
  const std::string_view text = records;
  std::optional<JsonMessages> read;
  {
    const py::gil_scoped_release without_lock;
    read = plain_json_messages(text, channels);
  }
  if (!read) return py::none();
  return py::make_tuple(read->messages, py::cast(std::move(read->names)),
                        py::cast(std::move(read->values)), py::cast(std::move(read->present)));
}

}  // namespace

void register_delimited_text(py::module_& module) {
  module.def("text_lines", &lines_of, py::arg("text"),
             "(begin [lines + 1], commas [lines]) of bytes: where each line begins (the last entry "
             "is the size) and how many commas it holds. The text is not copied.");
  module.def("number_table", &numbers_of, py::arg("text"), py::arg("begin"), py::arg("columns"),
             "(values [lines, columns], wrong) of comma-separated lines that begin at bytes "
             "`begin`; `columns` count from 0 and increase. NaN for a blank cell. wrong: None, or "
             "(line, column, text) of the first cell that is no number, and values end before "
             "that line. The text is not copied. Raises InputError for lines outside the text.");
  module.def(
      "plain_json_messages", &messages_of, py::arg("records"), py::arg("channels"),
      "(count, names [K], values [N, K], present [N, K]) of the messages inside of one MCAP "
      "chunk: how many, and those on `channels`: NaN for null and for a key that is absent. None "
      "unless every record is a whole message, and every one of these a JSON object of numbers and "
      "nulls, no key twice, no number beyond double precision, no whole number beyond 64 bits.");
}

}  // namespace cdprcal::python
