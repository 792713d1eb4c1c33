// synthetic/: readings and logs that the project makes itself, with known truth.
#include "cdprcal/synthetic/synthetic.hpp"

#include <optional>

#include "bindings.hpp"
#include "sensors.hpp"

namespace cdprcal::python {
namespace {

ReadingOffsets make_offsets(const Eigen::VectorXd& length_m, const Eigen::VectorXd& swivel_rad,
                            double yaw_rad) {
  const CableVector lengths = to_cable_vector(length_m, "length_m");
  return {lengths, to_cable_vector(swivel_rad, "swivel_rad", static_cast<int>(lengths.size())),
          yaw_rad};
}

void register_noise_and_offsets(py::module_& module) {
  py::class_<RandomNormal>(module, "RandomNormal",
                           "Normal random numbers that are the same on every platform.")
      .def(py::init<std::uint64_t>(), py::arg("seed"))
      .def("uniform", &RandomNormal::uniform, "In (0, 1).")
      .def("__call__", &RandomNormal::operator(), "Standard normal.");
  const ReadingNoise none;
  py::class_<ReadingNoise> cls(
      module, "ReadingNoise",
      "White noise of the readings, one sigma; 0: exact readings. Absolute "
      "sensors with NaN are not there. Immutable.");
  cls.def(py::init([](double length_m, double swivel_rad, double roll_pitch_rad, double yaw_rad,
                      double tension_N, const py::kwargs& absolute) {
            ReadingNoise noise;
            noise.length_m = length_m;
            noise.swivel_rad = swivel_rad;
            noise.roll_pitch_rad = roll_pitch_rad;
            noise.yaw_rad = yaw_rad;
            noise.tension_N = tension_N;
            set_absolute(absolute, noise);
            return noise;
          }),
          py::kw_only(), py::arg("length_m") = none.length_m,
          py::arg("swivel_rad") = none.swivel_rad, py::arg("roll_pitch_rad") = none.roll_pitch_rad,
          py::arg("yaw_rad") = none.yaw_rad, py::arg("tension_N") = none.tension_N,
          "More keywords: those of absolute sensors, by the names of the attributes.")
      .def_readonly("length_m", &ReadingNoise::length_m)
      .def_readonly("swivel_rad", &ReadingNoise::swivel_rad)
      .def_readonly("roll_pitch_rad", &ReadingNoise::roll_pitch_rad)
      .def_readonly("yaw_rad", &ReadingNoise::yaw_rad)
      .def_readonly("tension_N", &ReadingNoise::tension_N);
  def_absolute<ReadingNoise>(cls);
  module.def(
      "reading_noise", &reading_noise, py::arg("sigma"), py::arg("scale") = 1.0,
      py::arg("absolute") = false,
      "The sigma of a robot's sensors times `scale`; absolute: those of absolute sensors too.");
  py::class_<ReadingOffsets>(module, "ReadingOffsets",
                             "Constant offsets of the relative readings. Immutable.")
      .def(py::init(&make_offsets), py::kw_only(), py::arg("length_m"), py::arg("swivel_rad"),
           py::arg("yaw_rad") = 0.0, "length_m, swivel_rad [n].")
      .def_property_readonly(
          "length_m", [](const ReadingOffsets& o) { return o.length_m; }, "[n] [m].")
      .def_property_readonly(
          "swivel_rad", [](const ReadingOffsets& o) { return o.swivel_rad; }, "[n] [rad].")
      .def_readonly("yaw_rad", &ReadingOffsets::yaw_rad);
  module.def("random_offsets", &random_offsets, py::arg("cable_count"), py::arg("random"),
             "Random offsets: ±1 m, ±60°, ±180°.");
  module.def(
      "synthetic_measurement",
      [](const Robot& robot, const Pose& pose, const Eigen::VectorXd& tension_N, PoseKind kind,
         const ReadingOffsets& offsets, const ReadingNoise& noise, RandomNormal& random) {
        const int n = robot.cable_count();
        if (offsets.length_m.size() != n) {
          throw InputError("offsets: are for " + std::to_string(offsets.length_m.size()) +
                           " cables; the robot has " + std::to_string(n) + "; give one a cable");
        }
        return synthetic_measurement(robot, pose, to_cable_vector(tension_N, "tension_N", n), kind,
                                     offsets, noise, random);
      },
      py::arg("robot"), py::arg("pose"), py::arg("tension_N"), py::arg("kind"), py::arg("offsets"),
      py::arg("noise"), py::arg("random"),
      "Exact readings at a pose plus offsets and noise; tension_N [n]: the true tensions there.");
}

}  // namespace

void register_synthetic(py::module_& module) {
  register_noise_and_offsets(module);
  const SyntheticLogOptions usual;
  py::class_<SyntheticLogOptions>(module, "SyntheticLogOptions", "How a run is made.")
      .def(py::init([](double dwell_s, double move_s, double rate_Hz,
                       const std::optional<ReadingNoise>& noise, double wrench_force_N,
                       double wrench_moment_Nm, std::uint64_t seed) {
             return SyntheticLogOptions{
                 dwell_s,        move_s,           rate_Hz, noise.value_or(ReadingNoise{}),
                 wrench_force_N, wrench_moment_Nm, seed};
           }),
           py::kw_only(), py::arg("dwell_s") = usual.dwell_s, py::arg("move_s") = usual.move_s,
           py::arg("rate_Hz") = usual.rate_Hz, py::arg("noise") = py::none(),
           py::arg("wrench_force_N") = usual.wrench_force_N,
           py::arg("wrench_moment_Nm") = usual.wrench_moment_Nm, py::arg("seed") = usual.seed,
           "noise None: none. wrench_force_N, wrench_moment_Nm: what the balance is wrong by along "
           "each axis, drawn anew for every set-point.")
      .def_readwrite("dwell_s", &SyntheticLogOptions::dwell_s,
                     "At every set-point, the first included.")
      .def_readwrite("move_s", &SyntheticLogOptions::move_s,
                     "Fifth-degree transition between two set-points.")
      .def_readwrite("rate_Hz", &SyntheticLogOptions::rate_Hz)
      .def_property(
          "noise", [](const SyntheticLogOptions& options) { return options.noise; },
          [](SyntheticLogOptions& options, const ReadingNoise& noise) { options.noise = noise; })
      .def_readwrite("wrench_force_N", &SyntheticLogOptions::wrench_force_N)
      .def_readwrite("wrench_moment_Nm", &SyntheticLogOptions::wrench_moment_Nm)
      .def_readwrite("seed", &SyntheticLogOptions::seed);
  py::class_<SyntheticLog>(module, "SyntheticLog", "A log and its truth.")
      .def_readonly("log", &SyntheticLog::log)
      .def_readonly("poses", &SyntheticLog::poses,
                    "Truth, one Pose a sample; the first is the initial pose.");
  module.def(
      "synthetic_log",
      [](const Robot& robot, const std::vector<Eigen::VectorXd>& setpoints_N,
         const std::optional<SyntheticLogOptions>& options, const std::vector<Pose>& poses) {
        return synthetic_log(robot,
                             to_cable_vectors(setpoints_N, "setpoints_N", robot.cable_count()),
                             options.value_or(SyntheticLogOptions{}), poses);
      },
      py::arg("robot"), py::arg("setpoints_N"), py::arg("options") = py::none(),
      py::arg("poses") = std::vector<Pose>{}, py::call_guard<py::gil_scoped_release>(),
      "A quasi-static start-up run through tension set-points [poses][n] under perfect tension "
      "control; with poses, one a set-point, led there by the lengths of six cables and more. Raises "
      "InputError where there is no stable equilibrium.");
  module.def("fifth_degree", &fifth_degree, py::arg("fraction"),
             "Smooth 0 → 1 with zero speed and acceleration at both ends.");
  module.def("default_setpoints", &default_setpoints, py::arg("robot"), py::arg("nx"),
             py::arg("ny"), py::arg("nz"), py::call_guard<py::gil_scoped_release>(),
             "Tension set-points of an nx × ny × nz grid of equilibria, visited in a serpentine. "
             "Raises InputError for fewer than 3 cables and when no such grid is found.");
  module.def(
      "default_stops",
      [](const Robot& robot, int nx, int ny, int nz) {
        std::vector<Pose> poses;
        std::vector<Eigen::VectorXd> setpoints_N;
        for (const SyntheticStop& stop : default_stops(robot, nx, ny, nz)) {
          poses.push_back(stop.pose);
          setpoints_N.emplace_back(stop.tension_N);
        }
        return std::make_pair(setpoints_N, poses);
      },
      py::arg("robot"), py::arg("nx"), py::arg("ny"), py::arg("nz"),
      py::call_guard<py::gil_scoped_release>(),
      "As default_setpoints, with the poses: (setpoints_N, poses).");
}

}  // namespace cdprcal::python
