// readings/noise, calibration/refine: how much readings may be wrong, and which were left out.
#include <map>

#include "bindings.hpp"
#include "cdprcal/calibration/refine.hpp"

namespace cdprcal::python {
namespace {

/// Channels by name, as in NoiseModel.
std::vector<std::string> channel_names() {
  std::vector<std::string> names;
  for (int c = 0; c < kChannels; ++c) names.emplace_back(to_string(static_cast<Channel>(c)));
  return names;
}

}  // namespace

void register_noise(py::module_& module) {
  py::class_<ChannelNoise>(module, "ChannelNoise", "Noise of one channel, two components.")
      .def(py::init([](double pose, double sample) { return ChannelNoise{pose, sample}; }),
           py::arg("pose"), py::arg("sample") = 0.0)
      .def_readonly("pose", &ChannelNoise::pose,
                    "sigma shared by all samples of a pose: does not average out.")
      .def_readonly("sample", &ChannelNoise::sample, "White sigma from sample to sample.")
      .def("sigma", &ChannelNoise::sigma, py::arg("samples"), "Of the mean of so many samples.");
  py::class_<NoiseModel>(module, "NoiseModel",
                         "Noise by channel: length [m], swivel, roll_pitch, yaw [rad], balance "
                         "(of a tension) [N], absolute_yaw [rad], direct_length, position [m].")
      .def(
          py::init([](const std::map<std::string, ChannelNoise>& channels, double wrench_force_N,
                      double wrench_moment_Nm) {
            NoiseModel noise;
            noise.wrench_force_N = wrench_force_N;
            noise.wrench_moment_Nm = wrench_moment_Nm;
            if (!(wrench_force_N > 0.0 && wrench_moment_Nm > 0.0)) {
              throw InputError("NoiseModel: wrench_force_N and wrench_moment_Nm must be positive");
            }
            const std::vector<std::string> names = channel_names();
            noise.channel = specified_noise(SensorSigma{}).channel;
            std::size_t used = 0;
            for (std::size_t c = 0; c < names.size(); ++c) {
              const auto found = channels.find(names[c]);
              if (found == channels.end() && c < kPaperChannels) {
                throw InputError("NoiseModel: channel " + names[c] + " is missing; add it");
              }
              if (found == channels.end()) continue;
              noise.channel[c] = found->second;
              ++used;
            }
            if (used != channels.size()) {
              throw InputError(
                  "NoiseModel: channels must be among length, swivel, roll_pitch, yaw, balance, "
                  "absolute_yaw, direct_length and position");
            }
            return noise;
          }),
          py::arg("channels"), py::arg("wrench_force_N"), py::arg("wrench_moment_Nm"),
          "A ChannelNoise for each channel; absolute_yaw, direct_length and position may be left out. "
          "Raises InputError otherwise.")
      .def_property_readonly(
          "channels",
          [](const NoiseModel& noise) {
            std::map<std::string, ChannelNoise> out;
            const std::vector<std::string> names = channel_names();
            for (std::size_t c = 0; c < names.size(); ++c) out[names[c]] = noise.channel[c];
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
