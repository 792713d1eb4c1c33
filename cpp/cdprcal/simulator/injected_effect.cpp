#include "cdprcal/simulator/injected_effect.hpp"

#include <algorithm>
#include <charconv>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/readings/log_columns.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {
namespace {

constexpr auto kScalar = InjectedShape::scalar;
constexpr auto kPerCable = InjectedShape::per_cable;
constexpr auto kVector3 = InjectedShape::vector3;
constexpr auto kPerCableVector3 = InjectedShape::per_cable_vector3;

const InjectableEffect& find(const std::string& name) {
  std::string known;
  for (const InjectableEffect& effect : injectable_effects()) {
    if (effect.name == name) return effect;
    known += (known.empty() ? "" : ", ") + effect.name;
  }
  throw InputError("effect " + in_quotes(name) + ": not known; give one of " + known);
}

std::size_t entries(InjectedShape shape, int cable_count) {
  const auto n = static_cast<std::size_t>(cable_count);
  switch (shape) {
    case InjectedShape::scalar:
      return 1;
    case InjectedShape::per_cable:
      return n;
    case InjectedShape::vector3:
      return 3;
    case InjectedShape::per_cable_vector3:
      return 3 * n;
  }
  return 0;
}

/// Entries of the short form: one number, or one vector, for all cables.
std::size_t short_entries(InjectedShape shape) {
  return shape == kVector3 || shape == kPerCableVector3 ? 3 : 1;
}

std::string sizes_text(const InjectableEffect& effect) {
  std::string text;
  for (const InjectedParameter& parameter : effect.parameters) {
    text += (text.empty() ? "" : ", ") + parameter.name;
    switch (parameter.shape) {
      case InjectedShape::scalar:
        break;
      case InjectedShape::per_cable:
        text += " [1 or n]";
        break;
      case InjectedShape::vector3:
        text += " [3]";
        break;
      case InjectedShape::per_cable_vector3:
        text += " [3 or n*3]";
        break;
    }
  }
  return text;
}

[[noreturn]] void fail(const InjectableEffect& effect, const std::string& what) {
  throw InputError("effect " + effect.name + ": " + what + "; it takes " + sizes_text(effect));
}

double parse_number(const InjectableEffect& effect, std::string text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_space(text.back())) text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), is_space));
  if (effect.name == "euler_convention" && text.size() == 3 &&
      text.find_first_not_of("XYZ") == std::string::npos) {
    try {
      return static_cast<double>(parse_euler_convention(text));
    } catch (const InputError&) {
      fail(effect, in_quotes(text) + " must be one of XYZ, XZY, YXZ, YZX, ZXY, ZYX");
    }
  }
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    fail(effect, in_quotes(text) + " must be a finite number");
  }
  return value;
}

/// Values that no robot can have.
void check_values(const InjectableEffect& effect, const std::vector<double>& values,
                  int cable_count) {
  const auto check = [&](bool fine, const std::string& what) {
    if (!fine) fail(effect, what);
  };
  for (const double v : values) check(std::isfinite(v), "values must be finite");
  if (effect.name == "length_sign" || effect.name == "swivel_sign") {
    for (const double v : values) check(v == 1.0 || v == -1.0, "a sign must be 1 or -1");
  } else if (effect.name == "cable_order") {
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      check(sorted[i] == static_cast<double>(i + 1),
            "the values must be the cable numbers 1 to n, each once");
    }
  } else if (effect.name == "euler_convention") {
    check(values[0] >= 0.0 && values[0] <= 5.0 && values[0] == std::floor(values[0]),
          "give an order such as ZYX, or its number 0 to 5");
  } else if (effect.name == "cable_elasticity") {
    check(values[0] > 0.0, "the stiffness must be positive");
  } else if (effect.name == "transmission_ratio" || effect.name == "swivel_scale" ||
             effect.name == "load_cell_gain") {
    for (const double v : values) check(v > -1.0, "a relative error must be above -1");
  } else if (effect.name == "cable_sag" || effect.name == "pulley_friction" ||
             effect.name == "swivel_hysteresis" || effect.name == "sensor_delay" ||
             effect.name == "bent_frame_under_load") {
    check(values[0] >= 0.0, "the value must not be negative");
  }
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    if (effect.parameters[i].name != "cable") continue;
    check(values[i] >= 1.0 && values[i] <= cable_count && values[i] == std::floor(values[i]),
          "cable must be a number from 1 to " + std::to_string(cable_count));
  }
}

}  // namespace

const std::vector<InjectableEffect>& injectable_effects() {
  static const std::vector<InjectableEffect> table{
      {"transmission_ratio",
       {{"ratio_error", kPerCable}},
       false,
       "the drum pays out less than the encoder says"},
      {"cable_elasticity", {{"axial_stiffness_N", kScalar}}, false, "the cable stretches"},
      {"cable_creep", {{"amplitude_m", kScalar}}, false, "the cable grows longer with log time"},
      {"cable_sag", {{"linear_density_kg_m", kScalar}}, false, "the cable has weight"},
      {"pulley_friction", {{"coefficient", kScalar}}, false, "the pulley rubs"},
      {"bending_hysteresis",
       {{"force_N", kScalar}, {"coefficient", kScalar}},
       false,
       "bending the cable over the pulley takes force"},
      {"swivel_hysteresis", {{"half_width_rad", kScalar}}, false, "the swivel lags"},
      {"swivel_scale", {{"scale_error", kPerCable}}, false, "the swivel encoder's scale is off"},
      {"pulley_radius", {{"radius_error_m", kPerCable}}, false, "the pulley is larger"},
      {"frame_anchors", {{"offset_m", kPerCableVector3}}, false, "the pulley is elsewhere"},
      {"platform_anchors",
       {{"offset_m", kPerCableVector3}},
       false,
       "the cable is attached elsewhere"},
      {"load_cell_bias", {{"bias_N", kPerCable}}, false, "the load cell's zero is off"},
      {"load_cell_gain", {{"gain_error", kPerCable}}, false, "the load cell's gain is off"},
      {"load_cell_drift", {{"rate_N_s", kScalar}}, false, "the load cells' zero moves"},
      {"mass", {{"mass_error_kg", kScalar}}, false, "the platform is heavier"},
      {"centre_of_mass", {{"offset_m", kVector3}}, false, "the centre of mass is elsewhere"},
      {"external_force", {{"force_N", kVector3}}, false, "something pulls at the platform"},
      {"ahrs_misalignment", {{"rotation_rad", kVector3}}, false, "the AHRS is mounted askew"},
      {"yaw_drift", {{"rate_rad_s", kScalar}}, false, "yaw drifts"},
      {"magnetic_disturbance", {{"gradient_rad_m", kVector3}}, false, "yaw depends on the place"},
      {"sensor_delay", {{"delay_s", kScalar}}, false, "the attitude arrives late"},
      {"length_sign", {{"sign", kPerCable}}, false, "the encoder counts backwards"},
      {"swivel_sign", {{"sign", kPerCable}}, false, "the swivel encoder counts backwards"},
      {"cable_order",
       {{"cable", kPerCable}},
       false,
       "the length and swivel columns 1 … n are those of other cables"},
      {"angle_unit",
       {{"swivel_factor", kScalar}, {"attitude_factor", kScalar}},
       false,
       "angles are in another unit (57.29577951308232: degrees)"},
      {"length_unit", {{"factor", kScalar}}, false, "lengths are in another unit (1000: mm)"},
      {"euler_convention",
       {{"order", kScalar}},
       false,
       "the AHRS speaks another order: XYZ, XZY, YXZ, YZX, ZXY, ZYX (0 … 5)"},
      {"slack",
       {{"time_s", kScalar}, {"cable", kScalar}, {"length_m", kScalar}},
       false,
       "the winch loses its grip: so much cable runs off, and the encoder sees it"},
      {"outlier",
       {{"time_s", kScalar}, {"cable", kScalar}, {"length_m", kScalar}},
       false,
       "the encoder is off by so much for 0.1 s"},
      {"oscillation",
       {{"time_s", kScalar}, {"cable", kScalar}, {"impulse_N_s", kScalar}},
       false,
       "a knock at the cable's anchor, across the cable"},
      {"cable_slip",
       {{"time_s", kScalar}, {"cable", kScalar}, {"length_m", kScalar}},
       false,
       "the cable slips on its drum: longer by so much, unseen by the encoder"},
      {"bent_frame_under_load",
       {{"compliance_m_N", kScalar}},
       true,
       "each pulley gives way along its cable's pull"},
      {"temperature_step",
       {{"time_s", kScalar}, {"rise_K", kScalar}},
       true,
       "it gets warmer: cables lengthen, load cells shift"},
      {"drum_runout",
       {{"amplitude_m", kScalar}, {"circumference_m", kScalar}},
       true,
       "an eccentric drum: a sine of the pay-out"}};
  return table;
}

InjectedEffect parse_injected_effect(const std::string& text) {
  const std::size_t equal = text.find('=');
  const InjectableEffect& effect = find(text.substr(0, equal));
  InjectedEffect parsed{effect.name, {}};
  if (equal == std::string::npos) fail(effect, "write " + effect.name + "=v1,v2,…");
  for (std::size_t begin = equal + 1;;) {
    const std::size_t comma = text.find(',', begin);
    parsed.values.push_back(parse_number(effect, text.substr(begin, comma - begin)));
    if (comma == std::string::npos) break;
    begin = comma + 1;
  }
  return parsed;
}

std::string to_string(const InjectedEffect& effect) {
  std::string text = effect.name;
  for (std::size_t i = 0; i < effect.values.size(); ++i) {
    text += (i == 0 ? '=' : ',') + detail::number_text(effect.values[i]);
  }
  return text;
}

InjectedEffect expanded(const InjectedEffect& injected, int cable_count) {
  const InjectableEffect& effect = find(injected.name);
  std::size_t full = 0, brief = 0;
  for (const InjectedParameter& parameter : effect.parameters) {
    full += entries(parameter.shape, cable_count);
    brief += short_entries(parameter.shape);
  }
  InjectedEffect out{effect.name, {}};
  if (injected.values.size() == full) {
    out.values = injected.values;
  } else if (injected.values.size() == brief && effect.name != "cable_order") {
    auto value = injected.values.begin();
    for (const InjectedParameter& parameter : effect.parameters) {
      const auto count = static_cast<std::ptrdiff_t>(short_entries(parameter.shape));
      const std::size_t repeat =
          entries(parameter.shape, cable_count) / short_entries(parameter.shape);
      for (std::size_t k = 0; k < repeat; ++k)
        out.values.insert(out.values.end(), value, value + count);
      value += count;
    }
  } else {
    fail(effect, std::to_string(injected.values.size()) + " values do not fit " +
                     std::to_string(cable_count) + " cables; give one a cable");
  }
  check_values(effect, out.values, cable_count);
  return out;
}

}  // namespace cdprcal
