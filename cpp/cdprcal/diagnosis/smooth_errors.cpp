#include "cdprcal/diagnosis/smooth_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "cdprcal/estimation/mean_square.hpp"

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
  [[nodiscard]] Eigen::VectorXd at(double run_time_s) const {
    const double u = run_time_s / duration_s_;
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

/// The channels that wander, in the order of a term's values: readings as ReadingRows has them,
/// then the load cells, whose errors the balance shows.
struct Part {
  Channel channel;
  ParameterShape shape;
};
constexpr Part kParts[] = {{Channel::length, ParameterShape::per_cable},
                           {Channel::swivel, ParameterShape::per_cable},
                           {Channel::roll_pitch, ParameterShape::pair},
                           {Channel::yaw, ParameterShape::scalar},
                           {Channel::balance, ParameterShape::per_cable}};

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
    for (int t = 0; t < walk_.terms(); ++t) {
      for (const auto& [channel, shape] : kParts) {
        const NoiseGroup group = at_rest(channel);
        const double noise =
            noise_unit(model.robot, group) * model.noise[static_cast<std::size_t>(group)];
        // Of what nobody reads nothing is known.
        const double typical = std::isfinite(noise) && noise > 0.0 ? noise : 1.0;
        info_.parameters.push_back({"amplitude", "", shape, typical, 1e9});
      }
    }
  }
  const EffectInfo& info() const override { return info_; }
  /// A channel's errors are of one size.
  std::vector<int> learnt_widths(int cables) const override {
    std::vector<int> out;
    for (int t = 0; t < walk_.terms(); ++t) {
      int group = 0;
      for (const Part& part : kParts) {
        out.insert(out.end(), static_cast<std::size_t>(entries(part.shape, cables)), group++);
      }
    }
    return out;
  }

  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    const int n = context.state.cable_count;
    const Eigen::VectorXd change = by_component(n, context.measurement, values);
    evaluation.length_m += change.head(n);
    evaluation.swivel_rad += change.segment(n, n);
    evaluation.roll_pitch_yaw_rad += change.segment<3>(2 * n);
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    const int n = context.state.cable_count;
    tension_N -= by_component(n, context.measurement, values).tail(n);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const int n = context.state.cable_count, of_readings = 2 * n + 3;
    const Eigen::VectorXd at = walk_.at(context.measurement.run_time_s);
    const Eigen::MatrixXd pull = structure_matrix(context.state);
    for (int t = 0; t < walk_.terms(); ++t) {
      const int begin = t * components(n);
      out.block(0, begin, of_readings, of_readings).diagonal().setConstant(at[t]);
      out.block(of_readings, begin + of_readings, 6, n) = -at[t] * pull;
    }
  }

  /// Root mean squares of what values add over the rests of a model, by channel.
  [[nodiscard]] std::array<double, kRestGroups> rms(const DiagnosisModel& model,
                                                    const EffectTerm& term) const {
    const int n = model.robot.cable_count();
    std::array<MeanSquare, kRestGroups> sums;
    for (std::size_t r = 0; r < model.runs.size(); ++r) {
      const EffectValues values = term.values.segment(term.begin_of(r, n), size(n));
      for (const Measurement& m : model.runs[r].measurements) {
        if (is_moving(m)) continue;
        const Eigen::VectorXd change = by_component(n, m, values);
        Eigen::Index begin = 0;
        for (const auto& [channel, shape] : kParts) {
          MeanSquare& sum = sums[static_cast<std::size_t>(at_rest(channel))];
          for (const double v : change.segment(begin, entries(shape, n))) sum.add(v);
          begin += entries(shape, n);
        }
      }
    }
    std::array<double, kRestGroups> out{};
    std::ranges::transform(sums, out.begin(), &MeanSquare::rms);
    return out;
  }

 private:
  static int components(int cables) { return 3 * cables + 3; }
  /// What all terms together add to each component of kParts.
  [[nodiscard]] Eigen::VectorXd by_component(int cables, const Measurement& m,
                                             const EffectValues& values) const {
    return values.reshaped(components(cables), walk_.terms()) * walk_.at(m.run_time_s);
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

std::optional<std::array<double, kRestGroups>> smooth_rms(const DiagnosisModel& model) {
  for (const EffectTerm& term : model.effects) {
    const auto* smooth = dynamic_cast<const SmoothErrors*>(term.effect.get());
    if (smooth != nullptr) return smooth->rms(model, term);
  }
  return std::nullopt;
}

}  // namespace cdprcal
