// Fields of absolute sensors in Python, all by the table of sensors (model/sensors.hpp).
#pragma once

#include "bindings.hpp"
#include "cdprcal/model/sensors.hpp"
#include "masked.hpp"

namespace cdprcal::python {

/// "[n] [m]: whole cable lengths …", `samples` before the shape ("N, ") if there are many.
inline std::string describe(const Sensor& sensor, const std::string& samples = "") {
  const std::string width = sensor.width == kOneACable ? "n" : std::to_string(sensor.width);
  const std::string shape =
      samples.empty() ? "[" + width + "]" : "[" + samples + width + "] or [" + samples + "0]";
  return shape + " [" + sensor.unit + "]: " + sensor.about + ".";
}

/// A read-only attribute for each absolute sensor; what it gives back is a copy.
template <class T, class Class>
void def_absolute(Class& cls) {
  const T of_types{};
  for_each_absolute(
      [&](const Sensor& sensor, const auto& field) {
        using Field = std::remove_cvref_t<decltype(field)>;
        const auto get = [&sensor](const T& fields) {
          Field out{};
          for_each_absolute(
              [&](const Sensor& other, const auto& value) {
                if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, Field>) {
                  if (&other == &sensor) out = value;
                }
              },
              fields);
          return out;
        };
        cls.def_property_readonly(sensor.field().c_str(), get, describe(sensor).c_str());
      },
      of_types);
}

/// Fills fields of absolute sensors from keyword arguments; None: as it is. Throws TypeError for
/// other names and for what is no such array.
template <class Fields>
void set_absolute(const py::kwargs& given, Fields& fields) {
  std::size_t used = 0;
  for_each_absolute(
      [&](const Sensor& sensor, auto& field) {
        using Field = std::remove_cvref_t<decltype(field)>;
        const std::string name = sensor.field();
        if (!given.contains(name)) return;
        ++used;
        const py::object value = unmasked(given[name.c_str()]);
        if (value.is_none()) return;
        try {
          if constexpr (std::is_same_v<Field, CableVector>) {
            field = to_cable_vector(value.cast<Eigen::VectorXd>(), name.c_str());
          } else {
            field = value.cast<Field>();
          }
        } catch (const py::cast_error&) {
          throw py::type_error(name + ": must be " + describe(sensor));
        }
      },
      fields);
  if (used == given.size()) return;
  std::string known;
  for_each_absolute([&](const Sensor& s, const auto&) { known += " " + s.field(); }, fields);
  throw py::type_error("unexpected keyword argument among those beyond the named ones; known are" +
                       known);
}

}  // namespace cdprcal::python
