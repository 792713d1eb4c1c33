// readings/noise, calibration/refine: how much readings may be wrong, and which were left out.
#include <map>
#include <optional>

#include "bindings.hpp"
#include "cdprcal/calibration/refine.hpp"
#include "cdprcal/readings/log_checks.hpp"

namespace cdprcal::python {
namespace {

/// "length [m], swivel [rad] …": all channels.
std::string channel_list() {
  std::string text;
  for (const ChannelRow& row : kChannelTable) {
    text += (text.empty() ? "" : ", ") + std::string(row.name) + " [" + row.of().unit + "]";
  }
  return text;
}

void register_table(py::module_& module) {
  py::class_<Sensor>(module, "Sensor", "One row of the table of sensors: a matrix of a log.")
      .def_readonly("name", &Sensor::name, "'position'.")
      .def_readonly("unit", &Sensor::unit, "m, rad, N, m_s2 or rad_s.")
      .def_property_readonly(
          "is_per_cable", [](const Sensor& s) { return s.width == kOneACable; },
          "One reading a cable; otherwise one or three of the platform.")
      .def_property_readonly("is_angle", &Sensor::is_angle)
      .def_property_readonly("is_absolute", &Sensor::is_absolute,
                             "One of those, without an offset, that few robots have.")
      .def_property_readonly("is_inertial", &Sensor::is_inertial,
                             "Of an inertial unit: it reads how the platform moves.")
      .def_property_readonly("field", &Sensor::field, "The attribute of a Log: 'position_m'.")
      .def_property_readonly(
          "sigma_field",
          [](const Sensor& s) {
            return s.sigma ? std::optional<std::string>(s.sigma_field()) : std::nullopt;
          },
          "The attribute of a SensorSigma; None: it is told, not read.")
      .def_readonly("in_words", &Sensor::in_words)
      .def_readonly("about", &Sensor::about, "What it reads, for descriptions.")
      .def("columns_of", &Sensor::columns_of, py::arg("cable_count"), "How many columns.")
      .def(
          "column",
          [](const Sensor& sensor, int index) {
            if (index < 0 || index >= sensor.columns_of(kMaxCables)) {
              throw InputError("index: " + std::to_string(index) + " is no column of " +
                               sensor.field() + "; give one from 0 on");
            }
            return sensor.column(index);
          },
          py::arg("index"), "As in a log: 'position_x_m'. Raises InputError beyond the last one.");
  py::class_<ChannelRow>(module, "ChannelRow",
                         "One row of the table of channels: readings that share one noise.")
      .def_readonly("name", &ChannelRow::name, "'roll_pitch'.")
      .def_readonly("rms_field", &ChannelRow::rms_field,
                    "The attribute of a ResidualRms: 'roll_pitch_rad'.")
      .def_property_readonly("sensor", &ChannelRow::of, py::return_value_policy::reference)
      .def_readonly("first", &ChannelRow::first, "Of the sensor's columns.")
      .def_readonly("count", &ChannelRow::count, "Columns; all, if they are one a cable.")
      .def_readonly("has_offset", &ChannelRow::has_offset,
                    "Its readings count from an unknown start.")
      .def_readonly("label", &ChannelRow::label, "In tables.")
      .def_readonly("plural", &ChannelRow::plural, "In sentences.");
  module.def(
      "log_groups", [] { return std::vector<Sensor>(kSensorTable.begin(), kSensorTable.end()); },
      "What a log holds, in the order of its columns: every sensor, then the set-points.");
  module.def(
      "channels",
      [] { return std::vector<ChannelRow>(kChannelTable.begin(), kChannelTable.end()); },
      "The channels that noise is estimated by, those of the paper's sensors first.");
}

}  // namespace

void register_noise(py::module_& module) {
  register_table(module);
  py::class_<Signal>(module, "Signal", "How the samples of one channel come at rest.")
      .def_readonly("sigma", &Signal::sigma, "Of one reading.")
      .def_readonly("rounding", &Signal::rounding, "The part of sigma that a mean keeps.")
      .def_readonly("rows", &Signal::rows, "Rows of the log worth one independent reading.")
      .def_readonly("resolution", &Signal::resolution,
                    "Step of the readings where it shows beside their noise; else 0.")
      .def_readonly("hold_rows", &Signal::hold_rows, "Rows a fresh reading.")
      .def_readonly("correlation_s", &Signal::correlation_s,
                    "Time constant of the filter that the noise went through; 0: none.")
      .def_readonly("loudest", &Signal::loudest,
                    "What the noisiest column scatters by beside the middle one.")
      .def("effective", &Signal::effective, py::arg("samples"),
           "How many independent readings so many rows hold.");
  module.def(
      "signals",
      [](const Log& log, const SampleRange& run, const std::vector<Equilibrium>& equilibria,
         const SensorSigma& sigma) {
        require_within(run, log);
        for (const Equilibrium& rest : equilibria) require_within(rest.samples, log);
        const Signals found = signals(log, run, equilibria, sigma);
        std::map<std::string, Signal> out;
        for (std::size_t c = 0; c < kChannels; ++c) out[kChannelTable[c].name] = found[c];
        return out;
      },
      py::arg("log"), py::arg("run"), py::arg("equilibria"), py::arg("sigma"),
      "A Signal for each channel, by name; absent ones have the robot file's sigma. Raises "
      "InputError for a run or a rest outside the log.");
  py::class_<ChannelNoise>(module, "ChannelNoise", "Noise of one channel, two components.")
      .def(py::init(
               [](double pose, double sample) { return ChannelNoise{pose, {.sigma = sample}}; }),
           py::arg("pose"), py::arg("sample") = 0.0)
      .def_readonly("pose", &ChannelNoise::pose,
                    "sigma shared by all samples of a pose: does not average out.")
      .def_property_readonly(
          "sample", [](const ChannelNoise& noise) { return noise.sample.sigma; },
          "sigma from sample to sample, which averages out as `signal` says.")
      .def_readonly("signal", &ChannelNoise::sample, "How the samples come.")
      .def("sigma", py::overload_cast<int>(&ChannelNoise::sigma, py::const_), py::arg("samples"),
           "Of the mean of so many samples.");
  py::class_<NoiseModel>(
      module, "NoiseModel",
      ("Noise by channel: " + channel_list() + "; the balance's is of a tension.").c_str())
      .def(py::init([](const std::map<std::string, ChannelNoise>& channels, double wrench_force_N,
                       double wrench_moment_Nm) {
             NoiseModel noise;
             noise.wrench_force_N = wrench_force_N;
             noise.wrench_moment_Nm = wrench_moment_Nm;
             if (!(wrench_force_N > 0.0 && wrench_moment_Nm > 0.0)) {
               throw InputError("NoiseModel: wrench_force_N and wrench_moment_Nm must be positive");
             }
             noise.channel = specified_noise(SensorSigma{}).channel;
             std::size_t used = 0;
             for (std::size_t c = 0; c < kChannels; ++c) {
               const std::string name = kChannelTable[c].name;
               const auto found = channels.find(name);
               if (found == channels.end() && c < kPaperChannels) {
                 throw InputError("NoiseModel: channel " + name + " is missing; add it");
               }
               if (found == channels.end()) continue;
               noise.channel[c] = found->second;
               ++used;
             }
             if (used != channels.size()) {
               throw InputError("NoiseModel: channels must be among " + channel_list());
             }
             return noise;
           }),
           py::arg("channels"), py::arg("wrench_force_N"), py::arg("wrench_moment_Nm"),
           "A ChannelNoise for each channel; those of absolute sensors may be left out. "
           "Raises InputError otherwise.")
      .def_property_readonly(
          "channels",
          [](const NoiseModel& noise) {
            std::map<std::string, ChannelNoise> out;
            for (std::size_t c = 0; c < kChannels; ++c) {
              out[kChannelTable[c].name] = noise.channel[c];
            }
            return out;
          },
          "By name; a copy.")
      .def_readonly("wrench_force_N", &NoiseModel::wrench_force_N,
                    "What the balance itself is wrong by along each axis, beyond the load cells.")
      .def_readonly("wrench_moment_Nm", &NoiseModel::wrench_moment_Nm, "The same, moments.");
  module.def("specified_noise", &specified_noise, py::arg("sigma"),
             "What the robot file says (eq. 18): nothing averages out.");
  py::class_<GatedReading>(module, "GatedReading", "A reading that was left out of the fit.")
      .def_property_readonly(
          "reason", [](const GatedReading& g) { return std::string(to_string(g.reason)); },
          "'outlier' or 'slack'.")
      .def_readonly("time_s", &GatedReading::time_s)
      .def_property_readonly(
          "channel", [](const GatedReading& g) { return std::string(to_string(g.channel)); })
      .def_readonly("component", &GatedReading::component,
                    "Cable or angle, from 0; 0 for a whole balance.")
      .def_readonly("size", &GatedReading::size,
                    "Outlier: residual over its standard deviation; slack: the tension [N].");
}

}  // namespace cdprcal::python
