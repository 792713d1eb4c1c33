#include "cdprcal/diagnosis/model_residuals.hpp"

#include <Eigen/QR>

namespace cdprcal {
std::vector<ModelResidual> model_residuals(const DiagnosisModel& model) {
  std::vector<ModelResidual> out;
  const int n = model.robot.cable_count();
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const ActiveEffects active = model.active(r);
    const Robot robot = with_effects(model.robot, active);
    const DiagnosisRun& run = model.runs[r];
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      const bool rests = m.in_balance();
      PoseEvaluation e;
      evaluate_pose(robot, m, run.poses[i], rests ? StaticsModel::wrench : StaticsModel::none, {},
                    active, false, e);
      if (!e.valid) continue;
      ModelResidual entry{r, m.run_time_s, {}};
      PoseResidual& residual = entry.residual;
      residual.length_m = e.length_m + run.offsets.head(n) - m.length_m;
      residual.swivel_rad =
          (e.swivel_rad + run.offsets.segment(n, n) - m.swivel_rad).unaryExpr(&wrap_angle);
      residual.roll_pitch_yaw_rad = e.roll_pitch_yaw_rad - m.roll_pitch_yaw_rad;
      residual.roll_pitch_yaw_rad[2] += run.offsets[2 * n];
      residual.roll_pitch_yaw_rad = residual.roll_pitch_yaw_rad.unaryExpr(&wrap_angle).eval();
      residual.absolute_yaw_rad = wrap_angle(e.absolute_yaw_rad - m.absolute_yaw_rad);
      residual.direct_length_m = m.direct_length_m.size() == n
                                     ? CableVector(e.direct_length_m - m.direct_length_m)
                                     : CableVector::Constant(n, kNaN);
      residual.position_m = run.poses[i].position_m - m.position_m;
      residual.tension_N = CableVector::Constant(n, kNaN);
      if (rests) {
        residual.wrench = e.wrench;
        const WrenchMatrix structure = structure_matrix(platform_state(robot, run.poses[i]));
        residual.tension_N =
            Eigen::MatrixXd(structure).completeOrthogonalDecomposition().solve(e.wrench);
      }
      out.push_back(std::move(entry));
    }
  }
  return out;
}

}  // namespace cdprcal
