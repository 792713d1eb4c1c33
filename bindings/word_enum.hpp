// Enums whose members are words in Python: Verdict.explained == "explained", as commands and files
// have it.
#pragma once

#include <pybind11/native_enum.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <type_traits>
#include <typeindex>
#include <utility>
#include <vector>

namespace cdprcal {
enum class PointStatus : std::uint8_t;
}

namespace cdprcal::python {

namespace py = pybind11;

/// Every enum but the one of which arrays are made: its members are numbers.
template <typename Enum>
inline constexpr bool kIsWordEnum = std::is_enum_v<Enum> && !std::is_same_v<Enum, PointStatus>;

/// The members of an enum in Python, which live as long as the process.
template <typename Enum>
inline std::vector<std::pair<Enum, py::handle>> kMembers;

/// Registers an enum.StrEnum: as py::native_enum, whose values can only be numbers.
template <typename Enum>
class WordEnum {
 public:
  WordEnum(py::module_& module, const char* name, const char* doc)
      : module_(module), name_(name), doc_(doc) {}

  /// `word`: what commands and files say, where it is not the name in C++.
  WordEnum& value(const char* name, Enum value, const char* word = nullptr) {
    words_.append(py::make_tuple(name, word == nullptr ? name : word));
    values_.push_back(value);
    return *this;
  }

  void finalize() {
    py::object type = py::module_::import("enum").attr("StrEnum")(
        name_, words_, py::arg("module") = module_.attr("__name__"));
    type.attr("__doc__") = doc_;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const py::object member = type[py::object(words_[i][py::int_(0)])];
      kMembers<Enum>.emplace_back(values_[i], member.inc_ref());
    }
    module_.attr(name_) = type;
    // Signatures name the type by this.
    py::detail::with_internals([&](py::detail::internals& internals) {
      internals.native_enum_type_map[std::type_index(typeid(Enum))] = type.inc_ref().ptr();
    });
  }

 private:
  py::module_ module_;
  const char* name_;
  const char* doc_;
  py::list words_;
  std::vector<Enum> values_;
};

}  // namespace cdprcal::python

namespace pybind11::detail {

template <typename Enum>
struct type_caster_enum_type_enabled<Enum, enable_if_t<cdprcal::python::kIsWordEnum<Enum>>>
    : std::false_type {};

template <typename Enum>
class type_caster<Enum, enable_if_t<cdprcal::python::kIsWordEnum<Enum>>> {
 public:
  PYBIND11_TYPE_CASTER(Enum, const_name<Enum>());

  /// A member of this enum, no string: of what is not meant, Python's own message tells.
  bool load(handle source, bool) {
    for (const auto& [candidate, member] : cdprcal::python::kMembers<Enum>) {
      if (!source.is(member)) continue;
      value = candidate;
      return true;
    }
    return false;
  }

  static handle cast(Enum source, return_value_policy, handle) {
    for (const auto& [candidate, member] : cdprcal::python::kMembers<Enum>) {
      if (candidate == source) return handle(member).inc_ref();
    }
    throw cast_error("an enum's value has no member in Python");
  }
};

}  // namespace pybind11::detail
