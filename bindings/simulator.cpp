// simulator/ and startup/: a simulated robot, and the procedure that starts
// any robot.
#include "cdprcal/simulator/random_start.hpp"
#include "cdprcal/simulator/simulate_startup.hpp"

#include <optional>

#include "bindings.hpp"

namespace cdprcal::python {

namespace {

/// T(field=value, …): every keyword is a field.
template <class T>
T from_keywords(const py::kwargs& keywords) {
  py::object object = py::cast(T{});
  for (const auto& [key, value] : keywords) {
    if (!py::hasattr(object, key)) {
      throw py::type_error("no such field: " + py::cast<std::string>(key));
    }
    py::setattr(object, key, value);
  }
  return object.cast<T>();
}

/// A CableVector as an attribute of any length that fits; see to_cable_vector.
template <class T, class Class>
void cable_field(Class& type, const char* name, CableVector T::* field, const char* doc) {
  type.def_property(
      name, [field](const T& self) -> Eigen::VectorXd { return self.*field; },
      [field, name](T& self, const Eigen::VectorXd& values) {
        self.*field = to_cable_vector(values, name);
      },
      doc);
}

std::vector<CableVector> to_setpoints(const std::vector<Eigen::VectorXd>& rows) {
  std::vector<CableVector> out;
  for (const Eigen::VectorXd& row : rows) out.push_back(to_cable_vector(row, "setpoint_N"));
  return out;
}

std::vector<Eigen::VectorXd> to_arrays(const std::vector<CableVector>& vectors) {
  return {vectors.begin(), vectors.end()};
}

void bind_effects(py::module_& module) {
  py::class_<InjectedEffect>(module, "InjectedEffect",
                             "An imperfection of the simulated robot: name and values, its "
                             "parameters one after the other. Immutable.")
      .def(py::init([](std::string name, std::vector<double> values) {
             return InjectedEffect{std::move(name), std::move(values)};
           }),
           py::arg("name"), py::arg("values"))
      .def_readonly("name", &InjectedEffect::name)
      .def_readonly("values", &InjectedEffect::values)
      .def("__str__", [](const InjectedEffect& e) { return to_string(e); })
      .def("__repr__",
           [](const InjectedEffect& e) { return "InjectedEffect('" + to_string(e) + "')"; });
  module.def(
      "parse_injected_effect",
      [](const std::string& text, const std::optional<Robot>& robot) {
        return parse_injected_effect(text, robot ? robot->own_effects : OwnEffects{});
      },
      py::arg("text"), py::arg("robot") = py::none(),
      "Parses 'NAME=v1,v2,…'. `robot`: whose own effects are known too. Raises InputError naming "
      "the accepted effects, or the sizes of this one's parameters.");
  module.def(
      "expanded_effect",
      [](const InjectedEffect& effect, const Robot& robot) {
        return expanded(effect, robot.cable_count(), robot.own_effects);
      },
      py::arg("effect"), py::arg("robot"),
      "The same effect with scalars broadcast over the robot's cables. Raises InputError when the "
      "values do not fit.");
  module.def(
      "injectable_effects",
      [] {
        py::list rows;
        for (const InjectableEffect& effect : injectable_effects()) {
          py::list parameters;
          for (const ParameterLayout& p : effect.parameters) {
            constexpr const char* kShapes[] = {"scalar", "n", "3", "n,3", "2"};
            parameters.append(py::make_tuple(p.name, kShapes[static_cast<int>(p.shape)]));
          }
          py::dict row;
          row["name"] = effect.name;
          row["parameters"] = parameters;
          row["generator_only"] = effect.generator_only;
          row["description"] = effect.description;
          rows.append(row);
        }
        return rows;
      },
      "Everything that can be injected: dicts of name, parameters [(name, shape)], generator_only "
      "(not in the catalogue of the diagnosis), description.");
}

void bind_options(py::module_& module) {
  WordEnum<WinchMode>(module, "WinchMode",
                      "velocity: the drive follows a commanded speed. tension: it has its "
                      "own tension loop. torque: the motor pulls with a commanded tension.")
      .value("velocity", WinchMode::velocity)
      .value("tension", WinchMode::tension)
      .value("torque", WinchMode::torque)
      .finalize();
  py::class_<StrandOptions>(module, "StrandOptions", "Cables of the simulated robot.")
      .def(py::init(&from_keywords<StrandOptions>))
      .def_readwrite("axial_stiffness_N", &StrandOptions::axial_stiffness_N,
                     "EA; 0: 10 MN on irma4, and in proportion to the weight.")
      .def_readwrite("damping_ratio", &StrandOptions::damping_ratio);
  py::class_<PlatformDamping>(module, "PlatformDamping",
                              "E-folding times of a free oscillation [s]; inf: no damping.")
      .def(py::init(&from_keywords<PlatformDamping>))
      .def_readwrite("translation_decay_s", &PlatformDamping::translation_decay_s)
      .def_readwrite("rotation_decay_s", &PlatformDamping::rotation_decay_s);
  py::class_<WinchOptions>(module, "WinchOptions", "Drives of the simulated robot.")
      .def(py::init(&from_keywords<WinchOptions>))
      .def_readwrite("mode", &WinchOptions::mode)
      .def_readwrite("time_constant_s", &WinchOptions::time_constant_s)
      .def_readwrite("max_velocity_m_s", &WinchOptions::max_velocity_m_s)
      .def_readwrite("tension_gain_m_s_N", &WinchOptions::tension_gain_m_s_N)
      .def_readwrite("tension_noise_N", &WinchOptions::tension_noise_N,
                     "NaN: 0.2 N on irma4, and in proportion to the weight.")
      .def_readwrite("drum_radius_m", &WinchOptions::drum_radius_m)
      .def_readwrite("drum_inertia_kg_m2", &WinchOptions::drum_inertia_kg_m2)
      .def_readwrite("drum_damping_Nms", &WinchOptions::drum_damping_Nms);
  py::class_<SensorChannel>(module, "SensorChannel",
                            "One kind of sensor; noise (one sigma), resolution and bias in the "
                            "unit of the reading.")
      .def(py::init(&from_keywords<SensorChannel>))
      .def_readwrite("noise", &SensorChannel::noise)
      .def_readwrite("resolution", &SensorChannel::resolution)
      .def_readwrite("bias", &SensorChannel::bias)
      .def_readwrite("rate_Hz", &SensorChannel::rate_Hz)
      .def_readwrite("delay_s", &SensorChannel::delay_s);
  py::class_<SensorOptions>(module, "SensorOptions", "Sensors of the simulated robot.")
      .def(py::init(&from_keywords<SensorOptions>))
      .def_readwrite("length_m", &SensorOptions::length_m)
      .def_readwrite("swivel_rad", &SensorOptions::swivel_rad)
      .def_readwrite("tension_N", &SensorOptions::tension_N)
      .def_readwrite("roll_pitch_rad", &SensorOptions::roll_pitch_rad)
      .def_readwrite("yaw_rad", &SensorOptions::yaw_rad)
      .def_readwrite("specific_force_noise_m_s2", &SensorOptions::specific_force_noise_m_s2)
      .def_readwrite("specific_force_bias_m_s2", &SensorOptions::specific_force_bias_m_s2)
      .def_readwrite("angular_velocity_noise_rad_s", &SensorOptions::angular_velocity_noise_rad_s)
      .def_readwrite("angular_velocity_bias_rad_s", &SensorOptions::angular_velocity_bias_rad_s)
      .def_readwrite("random_offsets", &SensorOptions::random_offsets);
  module.def("perfect_sensors", &perfect_sensors,
             "Without noise, quantisation, bias, delay and offsets.");
  py::class_<SimulatorOptions>(module, "SimulatorOptions", "What the simulated robot is made of.")
      .def(py::init(&from_keywords<SimulatorOptions>))
      .def_readwrite("step_s", &SimulatorOptions::step_s)
      .def_readwrite("strand", &SimulatorOptions::strand)
      .def_readwrite("damping", &SimulatorOptions::damping)
      .def_readwrite("winch", &SimulatorOptions::winch)
      .def_readwrite("sensors", &SimulatorOptions::sensors)
      .def_readwrite("effects", &SimulatorOptions::effects)
      .def_readwrite("seed", &SimulatorOptions::seed);
}

void bind_robot_sample(py::module_& module) {
  py::class_<RobotSample> sample(
      module, "RobotSample", "Readings of a robot's drives and AHRS as they arrive; NaN: absent.");
  sample.def(py::init(&from_keywords<RobotSample>))
      .def_readwrite("time_s", &RobotSample::time_s, "The backend's clock, now.")
      .def_readwrite("roll_pitch_yaw_rad", &RobotSample::roll_pitch_yaw_rad)
      .def_readwrite("specific_force_m_s2", &RobotSample::specific_force_m_s2,
                     "Of an inertial unit, platform axes [3].")
      .def_readwrite("angular_velocity_rad_s", &RobotSample::angular_velocity_rad_s)
      .def_readwrite("drives_time_s", &RobotSample::drives_time_s,
                     "When lengths, swivels and tensions last arrived; NaN: now.")
      .def_readwrite("attitude_time_s", &RobotSample::attitude_time_s)
      .def_readwrite("drive_error", &RobotSample::drive_error,
                     "Not empty: a drive is not operational, and why.")
      .def_readwrite("host_error", &RobotSample::host_error,
                     "Not empty: this computer cannot go on (disk full), and why.")
      .def_readwrite("stop_requested", &RobotSample::stop_requested, "The operator wants to stop.");
  cable_field(sample, "length_m", &RobotSample::length_m, "[n], growing as cable is paid out.");
  cable_field(sample, "swivel_rad", &RobotSample::swivel_rad, "[n], or empty.");
  cable_field(sample, "tension_N", &RobotSample::tension_N, "[n]");
}

void bind_plant(py::module_& module) {
  py::class_<PlantEnergy>(
      module, "PlantEnergy",
      "Energy of the simulated plant by kind [J]: conserved without damping, friction and winches.")
      .def_readonly("kinetic_J", &PlantEnergy::kinetic_J)
      .def_readonly("gravity_J", &PlantEnergy::gravity_J)
      .def_readonly("pulled_J", &PlantEnergy::pulled_J)
      .def_readonly("elastic_J", &PlantEnergy::elastic_J)
      .def_readonly("drums_J", &PlantEnergy::drums_J)
      .def_readonly("wound_J", &PlantEnergy::wound_J)
      .def_property_readonly("total_J", &PlantEnergy::total_J);
  py::class_<PlantTruth>(module, "PlantTruth",
                         "What the sensors of the simulated robot do not say.")
      .def_readonly("time_s", &PlantTruth::time_s)
      .def_readonly("pose", &PlantTruth::pose)
      .def_readonly("twist", &PlantTruth::twist, "[6] of P: m/s, rad/s, world axes.")
      .def_property_readonly("tension_N",
                             [](const PlantTruth& t) -> Eigen::VectorXd { return t.tension_N; })
      .def_property_readonly("load_cell_N",
                             [](const PlantTruth& t) -> Eigen::VectorXd { return t.load_cell_N; })
      .def_property_readonly(
          "direction", [](const PlantTruth& t) -> Eigen::VectorXd { return t.direction; },
          "[n] direction of cable motion in [-1, 1]; +1 after paying out.")
      .def_readonly("energy", &PlantTruth::energy);
  py::class_<RestResult>(module, "RestResult", "Whether the robot could be put somewhere at rest.")
      .def_readonly("found", &RestResult::found)
      .def_readonly("reason", &RestResult::reason)
      .def_readonly("pose", &RestResult::pose)
      .def_property_readonly("tension_N",
                             [](const RestResult& r) -> Eigen::VectorXd { return r.tension_N; });
}

void bind_simulator_class(py::module_& module) {
  py::class_<Simulator>(module, "Simulator",
                        "A simulated robot on a virtual clock. The same seed, options and commands "
                        "give the same readings to the last bit.")
      .def(py::init<const Robot&, const SimulatorOptions&>(), py::arg("robot"),
           py::arg("options") = SimulatorOptions{})
      .def(
          "reset",
          [](Simulator& self, const Eigen::VectorXd& tension_N, const std::optional<Pose>& near) {
            return self.reset(to_cable_vector(tension_N, "tension_N"), near ? &*near : nullptr);
          },
          py::arg("tension_N"), py::arg("near") = py::none(),
          "At rest under these true tensions [N], n values > 0, at the equilibrium closest to `near`. "
          "Time, sensors and noise start over. When none is found nothing has changed.")
      .def(
          "reset_at", [](Simulator& self, const Pose& pose) { return self.reset(pose); },
          py::arg("pose"), "At rest with the cable lengths of this pose, winches locked.")
      .def(
          "reset_held",
          [](Simulator& self, const Pose& pose, const Eigen::VectorXd& tension_N) {
            return self.reset(pose, to_cable_vector(tension_N, "tension_N"));
          },
          py::arg("pose"), py::arg("tension_N"),
          "At rest at this very pose, held by the lengths of six cables and more, under the tensions "
          "in balance there that are closest to these [N].")
      .def(
          "command_velocity",
          [](Simulator& self, const Eigen::VectorXd& velocity_m_s) {
            self.command_velocity(to_cable_vector(velocity_m_s, "velocity_m_s"));
          },
          py::arg("velocity_m_s"), "Speeds of pay-out [m/s], n values.")
      .def(
          "command_tension",
          [](Simulator& self, const Eigen::VectorXd& tension_N) {
            self.command_tension(to_cable_vector(tension_N, "tension_N"));
          },
          py::arg("tension_N"), "Set-points of the drives' tension loops, or motor tensions [N].")
      .def(
          "command_each",
          [](Simulator& self, const Eigen::VectorXd& velocity_m_s, const Eigen::VectorXd& tension_N,
             const std::vector<bool>& by_tension) {
            self.command_each(to_cable_vector(velocity_m_s, "velocity_m_s"),
                              to_cable_vector(tension_N, "tension_N"), by_tension);
          },
          py::arg("velocity_m_s"), py::arg("tension_N"), py::arg("by_tension"),
          "Each drive by itself, n values each: True its tension, False its speed of pay-out.")
      .def("hold", &Simulator::hold, "Winches stopped and locked.")
      .def("advance", &Simulator::advance, py::arg("duration_s"),
           py::call_guard<py::gil_scoped_release>(),
           "Lets time pass. False: the platform ran into a pulley; the world stands still then.")
      .def_property_readonly("time_s", &Simulator::time_s)
      .def("read", &Simulator::read, "The latest readings.")
      .def("truth", &Simulator::truth)
      .def_property_readonly("offsets", &Simulator::offsets, "Constant offsets of the readings.")
      .def_property_readonly("crashed", &Simulator::crashed, "Why the world stands still; or ''.")
      .def("push", &Simulator::push, py::arg("velocity_m_s"), py::arg("body_rate_rad_s"),
           "Sets the platform moving: centre of mass [m/s, world], rate [rad/s, platform].");
}

void bind_startup_options(py::module_& module) {
  py::class_<TensionControlOptions>(module, "TensionControlOptions",
                                    "Tension loop over winches in velocity mode.")
      .def(py::init(&from_keywords<TensionControlOptions>))
      .def_readwrite("bandwidth", &TensionControlOptions::bandwidth)
      .def_readwrite("filter", &TensionControlOptions::filter)
      .def_readwrite("direction_error", &TensionControlOptions::direction_error)
      .def_readwrite("axial_stiffness_N", &TensionControlOptions::axial_stiffness_N)
      .def_readwrite("locked_bandwidth_1_s", &TensionControlOptions::locked_bandwidth_1_s);
  py::class_<RestOptions>(module, "RestOptions", "How rest is judged while it happens.")
      .def(py::init(&from_keywords<RestOptions>))
      .def_readwrite("window_s", &RestOptions::window_s)
      .def_readwrite("confidence", &RestOptions::confidence)
      .def_readwrite("tolerance", &RestOptions::tolerance, "In the sensor's sigma.");
  py::class_<WatchdogOptions>(module, "WatchdogOptions", "When the robot is stopped.")
      .def(py::init(&from_keywords<WatchdogOptions>))
      .def_readwrite("stale_s", &WatchdogOptions::stale_s)
      .def_readwrite("attitude_stale_s", &WatchdogOptions::attitude_stale_s)
      .def_readwrite("tension_s", &WatchdogOptions::tension_s)
      .def_readwrite("follow_s", &WatchdogOptions::follow_s)
      .def_readwrite("stuck_s", &WatchdogOptions::stuck_s)
      .def_readwrite("slack_share", &WatchdogOptions::slack_share)
      .def_readwrite("overload_share", &WatchdogOptions::overload_share)
      .def_readwrite("follow_share", &WatchdogOptions::follow_share)
      .def_readwrite("runaway_m", &WatchdogOptions::runaway_m)
      .def("slack_N", &WatchdogOptions::slack_N, py::arg("robot"),
           "Tension below which a cable of a robot is slack [N].");
  py::class_<StartUpPlan>(
      module, "StartUpPlan",
      "Tension set-points to visit, the first is tau_0; transition_s empty, or "
      "0 for one: derived from the robot; via: settle there and go on without "
      "measuring, empty: measure everywhere; pose: lengths lead the platform of "
      "six cables and more from one to the next, empty: tensions lead it.")
      .def(py::init([](const std::vector<Eigen::VectorXd>& setpoint_N,
                       std::vector<double> transition_s, std::vector<bool> via,
                       std::vector<Pose> pose) {
             return StartUpPlan{to_setpoints(setpoint_N), std::move(transition_s), std::move(via),
                                std::move(pose)};
           }),
           py::arg("setpoint_N"), py::arg("transition_s") = std::vector<double>{},
           py::arg("via") = std::vector<bool>{}, py::arg("pose") = std::vector<Pose>{})
      .def_property_readonly("setpoint_N",
                             [](const StartUpPlan& p) { return to_arrays(p.setpoint_N); })
      .def_readonly("transition_s", &StartUpPlan::transition_s)
      .def_readonly("via", &StartUpPlan::via)
      .def_readonly("pose", &StartUpPlan::pose);
  py::class_<StartUpOptions>(module, "StartUpOptions", "How the start-up is run.")
      .def(py::init(&from_keywords<StartUpOptions>))
      .def_readwrite("record_s", &StartUpOptions::record_s)
      .def_readwrite("measure_s", &StartUpOptions::measure_s)
      .def_readwrite("settle_timeout_s", &StartUpOptions::settle_timeout_s)
      .def_readwrite("wait_for_rest", &StartUpOptions::wait_for_rest,
                     "False: set-points are passed without waiting for rest there.")
      .def_readwrite("velocity_limit_m_s", &StartUpOptions::velocity_limit_m_s)
      .def_readwrite("control", &StartUpOptions::control)
      .def_readwrite("rest", &StartUpOptions::rest)
      .def_readwrite("watchdog", &StartUpOptions::watchdog);
}

void bind_startup(py::module_& module) {
  WordEnum<StartUpState>(module, "StartUpState", "State of the start-up.")
      .value("idle", StartUpState::idle)
      .value("recording", StartUpState::recording)
      .value("moving_to_start", StartUpState::moving_to_start)
      .value("moving", StartUpState::moving)
      .value("settling", StartUpState::settling)
      .value("measuring", StartUpState::measuring)
      .value("done", StartUpState::done)
      .value("holding", StartUpState::holding)
      .finalize();
  py::class_<StartUpCommand>(module, "StartUpCommand", "What to do until the next sample.")
      .def_readonly("state", &StartUpCommand::state)
      .def_readonly("reason", &StartUpCommand::reason, "Holding: why.")
      .def_property_readonly(
          "velocity_m_s", [](const StartUpCommand& c) -> Eigen::VectorXd { return c.velocity_m_s; },
          "[n] of pay-out, for drives in velocity mode.")
      .def_property_readonly(
          "tension_setpoint_N",
          [](const StartUpCommand& c) -> Eigen::VectorXd { return c.tension_setpoint_N; },
          "[n] for drives with a tension loop of their own, and for the log.")
      .def_readonly("by_tension", &StartUpCommand::by_tension,
                    "[n] for drives with a tension loop: True, the drive follows its tension "
                    "set-point; False, it must follow velocity_m_s.")
      .def_readonly("locked", &StartUpCommand::locked, "Winches must stand still.")
      .def_readonly("setpoint", &StartUpCommand::setpoint)
      .def_readonly("ripple", &StartUpCommand::ripple, "Motion over what rest allows.")
      .def_readonly("remaining_s", &StartUpCommand::remaining_s);
  py::class_<StartUpRest>(module, "StartUpRest", "One measured rest.")
      .def_readonly("setpoint", &StartUpRest::setpoint)
      .def_readonly("begin_s", &StartUpRest::begin_s)
      .def_readonly("end_s", &StartUpRest::end_s);
  py::class_<StartUp>(module, "StartUp",
                      "The start-up procedure: a pure function of samples, for any backend.")
      .def(py::init<const Robot&, StartUpPlan, const StartUpOptions&>(), py::arg("robot"),
           py::arg("plan"), py::arg("options") = StartUpOptions{})
      .def(
          "step", [](StartUp& self, const RobotSample& sample) { return self.step(sample); },
          py::arg("sample"), "Takes the sample and says what to do until the next.")
      .def("finish", &StartUp::finish,
           "What was measured is enough: the run ends done where it is, the winches stop and lock.")
      .def("go_on_with", &StartUp::go_on_with, py::arg("rest"),
           "Other stops (StartUpPlan) after the present set-point, or after the one being moved "
           "to. Raises InputError, and changes nothing, for what the constructor refuses and when "
           "the run has ended.")
      .def_property_readonly("finished", &StartUp::finished)
      .def_property_readonly("state", &StartUp::state)
      .def_property_readonly("reason", &StartUp::reason)
      .def_property_readonly("rests", &StartUp::rests)
      .def_property_readonly("velocity_limit_m_s", &StartUp::velocity_limit_m_s)
      .def_property_readonly("planned_duration_s", &StartUp::planned_duration_s);
}

void bind_run(py::module_& module) {
  py::class_<StartUpChange>(module, "StartUpChange", "One change of state.")
      .def_readonly("time_s", &StartUpChange::time_s)
      .def_readonly("state", &StartUpChange::state)
      .def_readonly("setpoint", &StartUpChange::setpoint);
  py::class_<StartUpRun>(module, "StartUpRun", "What happened in a simulated start-up.")
      .def_readonly("state", &StartUpRun::state)
      .def_readonly("reason", &StartUpRun::reason)
      .def_readonly("log", &StartUpRun::log)
      .def_readonly("truth", &StartUpRun::truth, "One a row of the log.")
      .def_property_readonly(
          "poses",
          [](const StartUpRun& run) {
            std::vector<Pose> poses;
            for (const PlantTruth& t : run.truth) poses.push_back(t.pose);
            return poses;
          },
          "True poses, one a row of the log.")
      .def_readonly("rests", &StartUpRun::rests)
      .def_readonly("rest_rows", &StartUpRun::rest_rows, "Rows of the log of each rest.")
      .def_readonly("changes", &StartUpRun::changes)
      .def_readonly("min_setpoint_N", &StartUpRun::min_setpoint_N)
      .def_readonly("max_setpoint_N", &StartUpRun::max_setpoint_N)
      .def_readonly("max_velocity_m_s", &StartUpRun::max_velocity_m_s)
      .def_readonly("max_tension_N", &StartUpRun::max_tension_N);
  module.def("random_start", &random_start, py::arg("robot"), py::arg("box"), py::arg("seed"),
             py::arg("tries") = 200, py::call_guard<py::gil_scoped_release>(),
             "Where a robot may hang at power-on: the SetPoint at a position drawn evenly from the "
             "Box, stable at constant tensions; the same for the same seed. None when `tries` "
             "positions were none. Raises InputError for robots without an inverse problem.");
  module.def(
      "parked_start", &parked_start, py::arg("robot"), py::arg("meant"), py::arg("seed"),
      py::arg("tries") = 200, py::call_guard<py::gil_scoped_release>(),
      "Where a robot of six cables and more may have been parked for a run that begins at the "
      "Pose `meant`: a SetPoint as near as people park by eye; the same for the same seed. "
      "None when `tries` poses were not wrench-feasible. Raises InputError for fewer cables.");
  module.def(
      "simulate_startup",
      [](const Robot& robot, const StartUpPlan& plan, const SimulatorOptions& simulator,
         const StartUpOptions& startup, double control_rate_Hz, double log_rate_Hz,
         const std::optional<Eigen::VectorXd>& initial_tension_N,
         const std::optional<Pose>& initial_pose, const py::object& progress) {
        StartUpRunOptions options;
        options.simulator = simulator;
        options.startup = startup;
        options.control_rate_Hz = control_rate_Hz;
        options.log_rate_Hz = log_rate_Hz;
        if (initial_tension_N) {
          options.initial_tension_N =
              to_cable_vector(*initial_tension_N, "initial_tension_N", robot.cable_count());
        }
        options.initial_pose = initial_pose;
        if (!progress.is_none()) {
          options.progress = [&progress](const StartUpCommand& command, const RobotSample& sample) {
            const py::gil_scoped_acquire gil;
            const py::object go_on = progress(command, sample);
            return go_on.is_none() || go_on.cast<bool>();
          };
        }
        const py::gil_scoped_release release;
        return simulate_startup(robot, plan, options);
      },
      py::arg("robot"), py::arg("plan"), py::kw_only(), py::arg("simulator") = SimulatorOptions{},
      py::arg("startup") = StartUpOptions{}, py::arg("control_rate_Hz") = 100.0,
      py::arg("log_rate_Hz") = 10.0, py::arg("initial_tension_N") = py::none(),
      py::arg("initial_pose") = py::none(), py::arg("progress") = py::none(),
      "The start-up procedure on the simulated robot. `progress(command, sample)` is called with "
      "every command; False stops the run as the operator would.");
}

}  // namespace

void bind_simulator(py::module_& module) {
  bind_effects(module);
  bind_options(module);
  bind_robot_sample(module);
  bind_plant(module);
  bind_simulator_class(module);
  bind_startup_options(module);
  bind_startup(module);
  bind_run(module);
}

}  // namespace cdprcal::python
