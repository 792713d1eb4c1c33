#include "cdprcal/diagnosis/model_residuals.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "cdprcal/estimation/model_fit.hpp"

namespace cdprcal {
namespace {

/// The smallest change of the tensions that would balance the platform best.
void add_tensions(const RunRows& run, std::size_t pose, const Pose& at, PoseResidual& out) {
  if (run.statics_of(pose) == StaticsModel::none || run.silent_rows(pose) > 0) return;
  const WrenchMatrix structure = structure_matrix(platform_state(run.robot(), at));
  out.tension_N = Eigen::MatrixXd(structure).completeOrthogonalDecomposition().solve(out.wrench);
}

/// Evaluates a pose whose neighbours in its batch cannot be evaluated; false: it is the one.
bool evaluate_alone(RunRows& run, std::size_t pose, const Pose& at) {
  PoseLanes everywhere(run.poses());
  for (std::size_t i = 0; i < run.poses(); ++i) everywhere.set(i, at);
  return run.evaluate(pose / lanes::kLanes, everywhere);
}

}  // namespace

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
        ModelResidual entry{r, run.measurements[i].run_time_s, {}};
        rows.run(r).write_residual(i, entry.residual);
        add_tensions(rows.run(r), i, run.poses[i], entry.residual);
        out.push_back(std::move(entry));
      }
    }
  }
  return out;
}

}  // namespace cdprcal
