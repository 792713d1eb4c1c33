// readings/: the canonical log, its segments and its equilibria.
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/equilibrium_mean.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/log.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/readings/rest_list.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "masked.hpp"
#include "people.hpp"
#include "sensors.hpp"

namespace cdprcal::python {
namespace {

LogMatrix or_absent(std::optional<Readings> values, Eigen::Index samples) {
  return values ? std::move(values->values) : LogMatrix(samples, 0);
}

Log make_log(Times time_s, std::optional<Readings> length_m, std::optional<Readings> swivel_rad,
             std::optional<Readings> tension_N, std::optional<Readings> roll_pitch_yaw_rad,
             std::optional<Readings> tension_setpoint_N, std::string source,
             const py::kwargs& absolute) {
  Log log;
  const Eigen::Index samples = time_s.values.size();
  log.source = std::move(source);
  log.time_s = std::move(time_s.values);
  log.length_m = or_absent(std::move(length_m), samples);
  log.swivel_rad = or_absent(std::move(swivel_rad), samples);
  log.tension_N = or_absent(std::move(tension_N), samples);
  log.tension_setpoint_N = or_absent(std::move(tension_setpoint_N), samples);
  log.roll_pitch_yaw_rad = or_absent(std::move(roll_pitch_yaw_rad), samples);
  for_each_absolute([&](const Sensor&, LogMatrix& values) { values.resize(samples, 0); }, log);
  set_absolute(absolute, log);
  validate(log);
  return log;
}

void register_log(py::module_& module) {
  // The arrays are read-only views of the log's own memory and keep the log alive.
  py::class_<Log> cls(
      module, "Log",
      "What a robot's own sensors read, one row a sample. Immutable: the arrays are "
      "read-only views of the log, which they keep alive. NaN, or no columns: that "
      "sensor is absent. Lengths, swivels and yaw carry unknown constant offsets.");
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    cls.def_property_readonly(
        kSensorTable[g].field().c_str(),
        [g](const Log& log) -> const LogMatrix& { return *log.groups()[g]; },
        describe(kSensorTable[g], "N, ").c_str());
  }
  cls.def(
         py::init(&make_log), py::kw_only(), py::arg("time_s"), py::arg("length_m") = py::none(),
         py::arg("swivel_rad") = py::none(), py::arg("tension_N") = py::none(),
         py::arg("roll_pitch_yaw_rad") = py::none(), py::arg("tension_setpoint_N") = py::none(),
         py::arg("source") = "log",
         "time_s [N] strictly increasing; per-cable arrays [N, n], roll_pitch_yaw_rad [N, 3]; more "
         "keywords: those of absolute sensors, by the names of the attributes. None: absent. "
         "`source` is what messages call it. Copies its input; what is masked is NaN. Raises InputError when shapes or "
         "times do not fit.")
      .def_readonly("source", &Log::source)
      .def_readonly("time_s", &Log::time_s, "[N] [s], strictly increasing.")
      .def_property_readonly("sample_count", &Log::sample_count)
      .def_property_readonly("cable_count", &Log::cable_count,
                             "Width of the widest per-cable group.")
      .def("__len__", &Log::sample_count)
      .def("__repr__", [](const Log& log) {
        return "Log(source='" + log.source +
               "', sample_count=" + std::to_string(log.sample_count()) +
               ", cable_count=" + std::to_string(log.cable_count()) + ")";
      });
  cls.def_static(
      "from_dataframe",
      [](const py::object& frame, const std::string& source) {
        return people("log_of")(frame, source).cast<Log>();
      },
      py::arg("frame"), py::arg("source") = "data frame",
      "From a pandas.DataFrame with the columns of a canonical log; the index is the time [s] when "
      "there is no column time_s. Raises InputError.");
  def_people(cls, "A pandas.DataFrame: a row a sample, the columns of the canonical log.", true);
  const py::call_guard<py::gil_scoped_release> without_gil;
  module.def(
      "read_log", [](const std::filesystem::path& path) { return read_log(path); }, py::arg("path"),
      without_gil, "Reads a canonical CSV log. Raises InputError 'file:line: column: …'.");
  module.def(
      "parse_log",
      [](const py::typing::Union<py::str, py::bytes>& text, const std::string& source) {
        const auto content =
            text.cast<std::string>();  // bytes as they are: the file may be damaged
        const py::gil_scoped_release without_lock;
        return parse_log(content, source);
      },
      py::arg("text"), py::arg("source"),
      "Parses the text of a canonical CSV log; `source` is what messages call it. Raises "
      "InputError 'source:line: column: …'.");
  module.def("format_log", &format_log, py::arg("log"), without_gil,
             "The canonical CSV text; parse_log gives back the same numbers.");
  module.def(
      "write_log", [](const Log& log, const std::filesystem::path& path) { write_log(log, path); },
      py::arg("log"), py::arg("path"), without_gil,
      "Writes the canonical CSV; read_log gives back the same numbers. Raises InputError "
      "when the file cannot be written.");
}

}  // namespace

void register_readings(py::module_& module) {
  register_log(module);
  py::class_<SampleRange>(module, "SampleRange", "Half-open range of sample numbers. Immutable.")
      .def(py::init([](Eigen::Index begin, Eigen::Index end) { return SampleRange{begin, end}; }),
           py::arg("begin"), py::arg("end"))
      .def_readonly("begin", &SampleRange::begin)
      .def_readonly("end", &SampleRange::end)
      .def("__len__", &SampleRange::size)
      .def("__repr__", [](const SampleRange& range) {
        return "SampleRange(" + std::to_string(range.begin) + ", " + std::to_string(range.end) +
               ")";
      });
  module.def("segments", &segments, py::arg("log"), py::arg("gap_s") = 2.0,
             "Segments of a log: a gap longer than gap_s starts a new one. The last is the run. A "
             "list of rests (is_rest_list) is one segment.");
  module.def("is_rest_list", &is_rest_list, py::arg("log"), py::arg("gap_s") = 2.0,
             "Whether a log has at most 400 rows, no two of them within gap_s: each is then taken "
             "as the reading of one rest.");
  const DetectionOptions usual;
  py::class_<DetectionOptions>(module, "DetectionOptions",
                               "How equilibria are detected: rest is judged window by window.")
      .def(py::init([](double window_s, double confidence, double tolerance) {
             return DetectionOptions{window_s, confidence, tolerance};
           }),
           py::kw_only(), py::arg("window_s") = usual.window_s,
           py::arg("confidence") = usual.confidence, py::arg("tolerance") = usual.tolerance)
      .def_readwrite("window_s", &DetectionOptions::window_s,
                     "The platform must look at rest at least this long [s].")
      .def_readwrite("confidence", &DetectionOptions::confidence,
                     "Of the tests that 'nothing moves' is judged by.")
      .def_readwrite("tolerance", &DetectionOptions::tolerance,
                     "Motion that does not matter, in units of the sensor's sigma.");
  py::class_<Equilibrium>(module, "Equilibrium", "One interval at rest.")
      .def_readonly("samples", &Equilibrium::samples)
      .def_readonly("begin_s", &Equilibrium::begin_s)
      .def_readonly("end_s", &Equilibrium::end_s)
      .def("__repr__", [](const Equilibrium& e) {
        return "Equilibrium(begin_s=" + std::to_string(e.begin_s) +
               ", end_s=" + std::to_string(e.end_s) + ")";
      });
  module.def(
      "detect_equilibria",
      [](const Log& log, const std::optional<SampleRange>& range,
         const std::optional<SensorSigma>& sigma, const std::optional<DetectionOptions>& options) {
        const SampleRange all = range.value_or(SampleRange{0, log.sample_count()});
        require_within(all, log);
        return detect_equilibria(log, all, sigma.value_or(SensorSigma{}),
                                 options.value_or(DetectionOptions{}));
      },
      py::arg("log"), py::arg("range") = py::none(), py::arg("sigma") = py::none(),
      py::arg("options") = py::none(), py::call_guard<py::gil_scoped_release>(),
      "Equilibria in `range` of a log (None: all of it), in time order; sigma None is eq. 18. "
      "Absent channels do not vote. Raises InputError for a range outside the log and when neither "
      "lengths, swivels nor attitude are there to tell.");
  py::class_<EquilibriumMean>(module, "EquilibriumMean",
                              "Readings of a rest as one. Channels: lengths, swivels, tensions, "
                              "roll, pitch, yaw, then those of absolute sensors, as far as the "
                              "log has them; NaN: absent.")
      .def_readonly("mean", &EquilibriumMean::mean, "[c] m, rad, N.")
      .def_readonly("covariance", &EquilibriumMean::covariance, "[c, c] of the mean.")
      .def_readonly("effective_samples", &EquilibriumMean::effective_samples,
                    "[c] how many independent readings they are worth.");
  module.def("equilibrium_mean", &equilibrium_mean, py::arg("log"), py::arg("samples"),
             py::call_guard<py::gil_scoped_release>(),
             "The mean over an interval at rest and its covariance, in which correlated readings "
             "count as what they are. Raises InputError for a range outside the log.");
  module.def(
      "fresh_rows",
      [](const LogMatrix& readings, Eigen::Index begin, Eigen::Index end) {
        if (begin < 0 || begin > end || end > readings.rows()) {
          throw InputError("range: rows " + std::to_string(begin) + " to " + std::to_string(end) +
                           " asked for of " + std::to_string(readings.rows()) +
                           "; give some of these");
        }
        return fresh_rows(readings, {begin, end}).rows;
      },
      py::arg("readings"), py::arg("begin"), py::arg("end"),
      "Rows of readings [N, columns of one sensor] in which it read anew; all of them where none is "
      "held over several rows. Raises InputError for rows that are not there.");
  module.def("channel_noise", &channel_noise, py::arg("values"), py::arg("angles") = false,
             "White noise of a channel [N], in its unit, from second differences (robust to "
             "motion); NaN entries are passed over; 0 with fewer than three samples. angles: "
             "jumps of 2 pi are none.");
}

}  // namespace cdprcal::python
