#include "cdprcal/diagnosis/smooth_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace cdprcal {
namespace {

/// Rests below which a random function and its noise are the same thing.
constexpr int kFewestRests = 5;
/// They bear 96 % of a walk's variance.
constexpr int kMostTerms = 5;

/// The first terms of a random walk from power-on, of unit variance on average over the run (Wiener
/// process): Σ z_t φ_t with z_t of unit variance, φ_t = 2 sin((t + ½)πu) / ((t + ½)π).
class Walk {
 public:
  Walk(double duration_s, int terms) : duration_s_(duration_s), terms_(terms) {}
  [[nodiscard]] int terms() const { return terms_; }
  /// Its terms φ_t.
  [[nodiscard]] Eigen::VectorXd at(const EffectContext& context) const {
    const double u = context.measurement.run_time_s / duration_s_;
    Eigen::VectorXd out(terms_);
    for (int t = 0; t < terms_; ++t) {
      const double wave = (t + 0.5) * std::numbers::pi;
      out[t] = 2.0 * std::sin(wave * u) / wave;
    }
    return out;
  }

 private:
  double duration_s_;
  int terms_;
};

/// Each channel, component by component, with a walk of its own.
class SmoothErrors final : public Effect {
 public:
  SmoothErrors(Walk walk, const DiagnosisModel& model) : walk_(walk) {
    info_.name = "smooth_errors";
    info_.equation = "reading* = reading + a random walk";
    info_.sentence = info_.remedy = info_.settle = "";
    info_.scope = EffectScope::run;
    // Of the tensions they are gains and biases in disguise, and weighed as these are.
    info_.of_load_cells = true;
    const auto add = [&](ParameterShape shape, Channel channel, double unit) {
      const double noise = model.noise[static_cast<std::size_t>(at_rest(channel))];
      // Of what nobody reads nothing is known.
      const double typical = std::isfinite(noise) && noise > 0.0 ? unit * noise : 1.0;
      info_.parameters.push_back({"amplitude", "", shape, typical, 1e9});
    };
    for (int t = 0; t < walk_.terms(); ++t) {
      add(ParameterShape::per_cable, Channel::length, 1.0);
      add(ParameterShape::per_cable, Channel::swivel, 1.0);
      add(ParameterShape::pair, Channel::roll_pitch, 1.0);
      add(ParameterShape::scalar, Channel::yaw, 1.0);
      // The balance's noise is relative to that of the load cells.
      add(ParameterShape::per_cable, Channel::balance, model.robot.sigma.tension_N);
    }
  }
  const EffectInfo& info() const override { return info_; }
  /// A channel's errors are of one size.
  std::vector<int> learnt_widths(int cables) const override {
    std::vector<int> out;
    for (int t = 0; t < walk_.terms(); ++t) {
      for (const auto& [channel, count] :
           {std::pair{0, cables}, {1, cables}, {2, 2}, {3, 1}, {4, cables}}) {
        out.insert(out.end(), static_cast<std::size_t>(count), channel);
      }
    }
    return out;
  }

  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    const Eigen::VectorXd change = by_component(context, values);
    const int n = context.state.cable_count;
    evaluation.length_m += change.head(n);
    evaluation.swivel_rad += change.segment(n, n);
    evaluation.roll_pitch_yaw_rad += change.segment<3>(2 * n);
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    tension_N -= by_component(context, values).tail(context.state.cable_count);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const int n = context.state.cable_count, of_readings = 2 * n + 3;
    const Eigen::VectorXd at = walk_.at(context);
    const Eigen::MatrixXd pull = structure_matrix(context.state);
    for (int t = 0; t < walk_.terms(); ++t) {
      const int begin = t * components(n);
      out.block(0, begin, of_readings, of_readings).diagonal().setConstant(at[t]);
      out.block(of_readings, begin + of_readings, 6, n) = -at[t] * pull;
    }
  }

 private:
  static int components(int cables) { return 3 * cables + 3; }
  /// Lengths, swivels, roll, pitch, yaw, tensions.
  [[nodiscard]] Eigen::VectorXd by_component(const EffectContext& context,
                                             const EffectValues& values) const {
    return values.reshaped(components(context.state.cable_count), walk_.terms()) *
           walk_.at(context);
  }

  Walk walk_;
  EffectInfo info_;
};

}  // namespace

std::shared_ptr<const Effect> smooth_errors(const DiagnosisModel& model) {
  double duration_s = 0.0;
  int fewest = std::numeric_limits<int>::max();
  for (const DiagnosisRun& run : model.runs) {
    int count = 0;
    for (const Measurement& m : run.measurements) {
      if (is_moving(m)) continue;
      duration_s = std::max(duration_s, m.run_time_s);
      ++count;
    }
    fewest = std::min(fewest, count);
  }
  if (fewest < kFewestRests || !(duration_s > 0.0)) return nullptr;
  return std::make_shared<SmoothErrors>(Walk(duration_s, std::min(kMostTerms, fewest - 2)), model);
}

bool is_smooth_errors(const Effect& effect) {
  return dynamic_cast<const SmoothErrors*>(&effect) != nullptr;
}

std::array<double, kRestGroups> size_in_readings(const DiagnosisModel& model,
                                                 const EffectTerm& term) {
  const int n = model.robot.cable_count();
  std::array<double, kRestGroups> squares{}, count{};
  const auto add = [&](Channel channel, const auto& change) {
    const auto c = static_cast<std::size_t>(at_rest(channel));
    for (const double v : change) squares[c] += v * v, count[c] += 1.0;
  };
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    const DiagnosisRun& run = model.runs[r];
    const EffectValues values = term.values.segment(term.begin_of(r, n), term.effect->size(n));
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      if (is_moving(run.measurements[i])) continue;
      const PlatformState state = platform_state(model.robot, run.poses[i]);
      const EffectContext context{model.robot, state, run.poses[i], run.measurements[i]};
      PoseEvaluation change;
      change.length_m = change.swivel_rad = CableVector::Zero(n);
      change.roll_pitch_yaw_rad.setZero();
      CableVector tension_N = CableVector::Zero(n);
      term.effect->add_to_readings(context, values, change);
      term.effect->correct_tension(context, values, tension_N);
      add(Channel::length, change.length_m);
      add(Channel::swivel, change.swivel_rad);
      add(Channel::roll_pitch, change.roll_pitch_yaw_rad.head<2>());
      add(Channel::yaw, change.roll_pitch_yaw_rad.tail<1>());
      add(Channel::balance, tension_N);
    }
  }
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    if (count[c] > 0.0) squares[c] = std::sqrt(squares[c] / count[c]);
  }
  return squares;
}

}  // namespace cdprcal
