#include "cdprcal/evidence/directions.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

/// s of all cables or all swivels at a pose, what its estimate may be off, and half of the range
/// that what came before power-on leaves it.
using Change =
    std::function<void(CableVector& s, const CableVector& error, const CableVector& open)>;

void change_measurement(const Change& change, bool swivels, Measurement& m) {
  CableVector& s = swivels ? m.swivel_direction : m.length_direction;
  const CableVector& error = swivels ? m.swivel_direction_error : m.length_direction_error;
  const CableVector& open = swivels ? m.swivel_direction_open : m.length_direction_open;
  if (s.size() == error.size() && s.size() == open.size()) change(s, error, open);
}

/// Whether anything in a model of this cost depends on the directions of its cables, or swivels.
bool depends(const DiagnosisModel& model, double cost, bool swivels) {
  DiagnosisModel other = model;
  for (DiagnosisRun& run : other.runs) {
    for (Measurement& m : run.measurements) {
      (swivels ? m.swivel_direction : m.length_direction).setConstant(0.5);
    }
  }
  const double there = penalised_cost(other);
  return std::isfinite(there) && there != cost;
}

}  // namespace

UncertainDirections uncertain_directions(const DiagnosisModel& model) {
  // A tension loop stirs the cables by tenths of a millimetre, against a turn-over of about one.
  constexpr double kLost = 0.1;
  const Eigen::VectorXd values = model.values();
  UncertainDirections out{Matrix6::Zero(), Eigen::VectorXd::Zero(values.size())};
  const double cost = penalised_cost(model);
  std::vector<bool> either;
  for (const bool swivels : {false, true}) {
    if (depends(model, cost, swivels)) either.push_back(swivels);
  }
  const auto add = [&](DiagnosisModel other) {
    fit(other, 1);  // as far as is linear
    const Vector6 shift = minus(other.runs.front().poses.front(), model.runs.front().poses.front());
    out.covariance += shift * shift.transpose();
    out.variance += (other.values() - values).cwiseAbs2();
  };
  const auto add_everywhere = [&](const Change& change) {
    DiagnosisModel other = model;
    for (DiagnosisRun& run : other.runs) {
      for (Measurement& m : run.measurements) {
        for (const bool swivels : either) change_measurement(change, swivels, m);
      }
    }
    add(std::move(other));
  };
  if (either.empty()) return out;
  add_everywhere([](CableVector& s, const CableVector& error, const CableVector&) { s += error; });
  add_everywhere([](CableVector& s, const CableVector&, const CableVector&) { s *= 1.0 - kLost; });
  // Each cable came from a side of its own, where a motion leaves what lags: the end of the range.
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    for (const bool swivels : either) {
      for (int i = 0; i < model.robot.cable_count(); ++i) {
        DiagnosisModel other = model;
        bool open_at_all = false;
        for (Measurement& m : other.runs[r].measurements) {
          change_measurement(
              [&](CableVector& s, const CableVector&, const CableVector& open) {
                s[i] += open[i];
                open_at_all |= open[i] != 0.0;
              },
              swivels, m);
        }
        if (open_at_all) add(std::move(other));
      }
    }
  }
  return out;
}

bool looks_at_directions(const Effect& effect, const DiagnosisModel& model) {
  const DiagnosisRun& run = model.runs.front();
  const PlatformState state = platform_state(model.robot, run.poses.front());
  const EffectValues typical = effect.typical(model.robot);
  const auto columns = [&](double direction) {
    Measurement m = run.measurements.front();
    m.length_direction.setConstant(model.robot.cable_count(), direction);
    m.swivel_direction.setConstant(model.robot.cable_count(), direction);
    Eigen::MatrixXd out =
        Eigen::MatrixXd::Zero(ReadingRows{model.robot.cable_count()}.size(), typical.size());
    effect.columns({model.robot, state, run.poses.front(), m}, EffectValues::Zero(typical.size()),
                   out);
    return Eigen::MatrixXd(out.array().isNaN().select(0.0, out));
  };
  return columns(1.0) != columns(-1.0);
}

}  // namespace cdprcal
