#include "cdprcal/estimation/linearise.hpp"

#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal {

LinearisedProblem linearise(const CalibrationProblem& given, const std::vector<Pose>& poses,
                            const Eigen::VectorXd& errors) {
  const CalibrationProblem problem = completed(given, poses);
  Assembly assembly(problem, poses);
  if (errors.size() > 0) assembly.set_reference_errors(errors);
  assembly.poses().update_wrench_whitening(1.0);
  LinearisedProblem out;
  assembly.linearise(out.residual, out.jacobian);
  return out;
}

}  // namespace cdprcal
