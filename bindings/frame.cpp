// frame/: pulleys, offsets and scale of a frame that nobody measured.
#include "cdprcal/frame/frame.hpp"

#include "bindings.hpp"

namespace cdprcal::python {
namespace {

void register_frame_parts(py::module_& module) {
  WordEnum<FrameStatus>(module, "FrameStatus", "How find_frame ended.")
      .value("converged", FrameStatus::converged)
      .value("not_converged", FrameStatus::not_converged)
      .value("unobservable", FrameStatus::unobservable)
      .finalize();
  py::class_<Estimate>(module, "Estimate", "One number and its standard deviation. Immutable.")
      .def_readonly("value", &Estimate::value)
      .def_readonly("sigma", &Estimate::sigma)
      .def("__repr__", [](const Estimate& e) {
        return "Estimate(" + std::to_string(e.value) + " ± " + std::to_string(e.sigma) + ")";
      });
  py::class_<LeftOutPose>(module, "LeftOutPose",
                          "A pose whose readings do not fit the frame. Immutable.")
      .def_readonly("log", &LeftOutPose::log, "Which log, from 0.")
      .def_readonly("sample", &LeftOutPose::sample, "Its row, from 0; of a rest the first one.")
      .def_readonly("cable", &LeftOutPose::cable,
                    "The one whose reading is off, from 0; -1: no single one.")
      .def_readonly("error_m", &LeftOutPose::error_m, "By which it is; NaN: no single one.");
}

void register_frame_result(py::module_& module) {
  py::class_<FrameResult>(module, "FrameResult",
                          "Where the pulleys of a frame are. Look at status first. Immutable.")
      .def_readonly("status", &FrameResult::status)
      .def_readonly("reason", &FrameResult::reason, "One sentence.")
      .def_readonly("corrected", &FrameResult::corrected,
                    "The robot with these pulleys and their position_sigma_m.")
      .def_property_readonly(
          "anchors_m", [](const FrameResult& r) { return to_rows(r.anchors_m); },
          "Pulley positions in the world [n, 3]; what fixes the world is said by gauge.")
      .def_property_readonly(
          "anchors_sigma_m", [](const FrameResult& r) { return to_rows(r.anchors_sigma_m); },
          "Their standard deviations [n, 3], lack of fit included; 0 where gauge fixes them.")
      .def_property_readonly(
          "covariance", [](const FrameResult& r) { return r.covariance; },
          "Of all positions, one pulley after the other [3n, 3n] [m²].")
      .def_readonly("gauge", &FrameResult::gauge, "What fixes the frame in the world, in words.")
      .def_readonly("offset_m", &FrameResult::offset_m,
                    "Reading minus whole length: none, one for all cables, or one a cable.")
      .def_readonly("scale", &FrameResult::scale,
                    "Readings a metre - 1 [1], where a tracker shows it; else None.")
      .def_readonly(
          "own_scale", &FrameResult::own_scale,
          "Readings a metre of each cable beside the mean of all [1]: none, or one a cable.")
      .def_readonly(
          "stiffness_N", &FrameResult::stiffness_N,
          "EA of the cables, where tensions are read, NaN where they do not tell it; else None.")
      .def_readonly("off_plane_m", &FrameResult::off_plane_m,
                    "How far belts run outside the plane, where readings show it; else None.")
      .def_readonly("weight_N", &FrameResult::weight_N,
                    "Of the platform, from the tensions; None without.")
      .def_readonly("rms_m", &FrameResult::rms_m, "Of the lengths' residuals.")
      .def_readonly("held_out_rms_m", &FrameResult::held_out_rms_m,
                    "Of poses that the frame was not fitted to, a fifth at a time.")
      .def_readonly("noise_m", &FrameResult::noise_m, "Of one length, from the residuals.")
      .def_readonly("lack_of_fit", &FrameResult::lack_of_fit,
                    "By which σ are larger than those of independent readings, since residuals of "
                    "neighbouring poses hang together.")
      .def_readonly("not_determined", &FrameResult::not_determined, "In words.")
      .def_readonly("next", &FrameResult::next, "Which poses would tell more, in words.")
      .def_readonly("left_out", &FrameResult::left_out, "List of LeftOutPose.")
      .def_readonly("poses", &FrameResult::poses, "Of the poses that were kept.")
      .def_readonly("residual_m", &FrameResult::residual_m,
                    "Model minus reading of the lengths [n] at each of them.")
      .def_readonly("iterations", &FrameResult::iterations)
      .def_readonly("solve_time_s", &FrameResult::solve_time_s)
      .def("__repr__", [](const FrameResult& r) {
        return "FrameResult(" + std::string(to_string(r.status)) + ": " + r.reason + ")";
      });
}

}  // namespace

void register_frame(py::module_& module) {
  register_frame_parts(module);
  register_frame_result(module);
  module.def(
      "find_frame",
      [](const Robot& robot, const std::vector<Log>& logs, const std::string& offset,
         const std::string& scale, const std::string& poses, bool leave_out, bool off_plane) {
        FrameOptions options;
        options.offset = parse_length_offset(offset);
        options.scale = parse_length_scale(scale);
        options.poses = parse_frame_poses(poses);
        options.leave_out = leave_out;
        options.off_plane = off_plane;
        const py::gil_scoped_release released;
        return find_frame(robot, logs, options);
      },
      py::arg("robot"), py::arg("logs"), py::kw_only(), py::arg("offset") = "common",
      py::arg("scale") = "common", py::arg("poses") = "automatic", py::arg("leave_out") = true,
      py::arg("off_plane") = true,
      "Pulley positions, offsets and scale from the poses of one or more logs of one robot. "
      "offset: what whole lengths may be wrong by: 'none', 'common' or 'each'. scale: whether "
      "readings a metre are 'common' to all cables or 'each' cable's own. poses: 'samples', "
      "'rests', or 'automatic'. leave_out: poses that do not belong, named in left_out. "
      "off_plane: whether belts of a planar robot may run outside the plane. Raises InputError for "
      "logs that do not fit the robot or hold no lengths.");
}

}  // namespace cdprcal::python
