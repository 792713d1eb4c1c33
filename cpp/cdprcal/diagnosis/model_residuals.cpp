#include "cdprcal/diagnosis/model_residuals.hpp"

#include <algorithm>
#include <array>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/text_effect.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/model_fit.hpp"

namespace cdprcal {
namespace {

/// The smallest change of the tensions that would balance the platform best, moments over the
/// characteristic length.
void add_tensions(const RunRows& run, std::size_t pose, const Pose& at, PoseResidual& out) {
  if (run.statics_of(pose) == StaticsModel::none || run.silent_rows(pose) > 0) return;
  const WrenchMatrix structure = structure_matrix(platform_state(run.robot(), at));
  Vector6 scale;
  scale << Vector3::Ones(), Vector3::Constant(1.0 / characteristic_length_m(run.robot()));
  out.tension_N = least_norm(Eigen::MatrixXd(scale.asDiagonal() * structure),
                             Eigen::VectorXd(scale.cwiseProduct(out.wrench)));
}

/// Evaluates a pose whose neighbours in its batch cannot be evaluated; false: it is the one.
bool evaluate_alone(RunRows& run, std::size_t pose, const Pose& at) {
  PoseLanes everywhere(run.poses());
  for (std::size_t i = 0; i < run.poses(); ++i) everywhere.set(i, at);
  return run.evaluate(pose / lanes::kLanes, everywhere);
}

/// What the model leaves of the readings that a formula adds to; empty: it adds to none.
Eigen::VectorXd residual_of(const std::string& to, const PoseResidual& residual) {
  if (to == "length_m") return residual.length_m;
  if (to == "swivel_rad") return residual.swivel_rad;
  if (to == "tension_N") return residual.tension_N;
  constexpr std::array<const char*, 3> kAngles{"roll_rad", "pitch_rad", "yaw_rad"};
  for (std::size_t a = 0; a < kAngles.size(); ++a) {
    if (to != kAngles[a]) continue;
    return residual.roll_pitch_yaw_rad.segment<1>(static_cast<Eigen::Index>(a));
  }
  return {};
}

}  // namespace

std::optional<Course> formula_course(const DiagnosisModel& model, std::size_t k) {
  if (k >= model.effects.size()) {
    throw InputError("effect: " + std::to_string(k) + " asked for, but the model has " +
                     std::to_string(model.effects.size()) + "; give one of these, counted from 0");
  }
  const EffectTerm& term = model.effects[k];
  const int n = model.robot.cable_count();
  Course out;
  for (const ModelResidual& entry : model_residuals(model)) {
    const DiagnosisRun& run = model.runs[entry.run];
    const Robot robot = with_effects(model.robot, model.active(entry.run));
    const PlatformState state = platform_state(robot, run.poses[entry.pose]);
    const EffectContext context{robot, state, run.poses[entry.pose], run.measurements[entry.pose]};
    const EffectValues values =
        term.values.segment(term.begin_of(entry.run, n), term.effect->size(n));
    for (int cable = 0; cable < n; ++cable) {
      const auto point = formula_at(*term.effect, context, values, cable);
      if (!point) return std::nullopt;
      const Eigen::VectorXd residual = residual_of(point->to, entry.residual);
      if (residual.size() == 0) return std::nullopt;
      out.to = point->to;
      out.variable = point->variable;
      const double left = residual[point->per_cable ? cable : 0];
      out.points.push_back(
          {entry.run, point->per_cable ? cable : -1, point->x, point->added, point->added - left});
      if (!point->per_cable) break;
    }
  }
  return out;
}

std::vector<ModelResidual> model_residuals(const DiagnosisModel& model) {
  std::vector<ModelResidual> out;
  out.reserve(static_cast<std::size_t>(model.pose_count()));
  ModelRows rows(model);
  const Eigen::VectorXd values = model.values();
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const DiagnosisRun& run = model.runs[r];
    const PoseLanes poses = rows.poses(r);
    rows.set_values(r, values, poses);
    rows.run(r).set_offsets(rows.offsets(r).data());
    for (std::size_t b = 0; b < rows.run(r).batches(); ++b) {
      const bool valid = rows.run(r).evaluate(b, poses);
      for (const std::size_t i : poses_of(b, run.poses.size())) {
        if (!valid && !evaluate_alone(rows.run(r), i, run.poses[i])) continue;
        ModelResidual entry{r, i, run.measurements[i].run_time_s, {}};
        rows.run(r).write_residual(i, entry.residual);
        add_tensions(rows.run(r), i, run.poses[i], entry.residual);
        out.push_back(std::move(entry));
      }
    }
  }
  return out;
}

}  // namespace cdprcal
