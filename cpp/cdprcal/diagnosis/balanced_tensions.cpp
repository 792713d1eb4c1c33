#include "cdprcal/diagnosis/balanced_tensions.hpp"

#include "cdprcal/diagnosis/model_residuals.hpp"

namespace cdprcal {

DiagnosisModel with_balanced_tensions(DiagnosisModel model) {
  for (const ModelResidual& entry : model_residuals(model)) {
    Measurement& m = model.runs[entry.run].measurements[entry.pose];
    if (!m.in_balance() || m.moves() || entry.residual.tension_N.size() != m.tension_N.size()) {
      continue;
    }
    m.balanced_tension_N = m.tension_N - entry.residual.tension_N;
  }
  fit_with_noise(model);
  return model;
}

}  // namespace cdprcal
