#include "cdprcal/diagnosis/generic.hpp"

#include <map>

namespace cdprcal {
namespace {

enum class Target { length, swivel, roll_pitch, yaw, tension };
enum class Covariate { time, position, tension, direction };

constexpr const char* kTargets[] = {"length", "swivel", "roll_pitch", "yaw", "tension"};
constexpr const char* kCovariates[] = {"time", "pose", "tension", "direction"};

/// Typical size of the whole dependence over a run, in units of the sensor's σ of eq. 18.
constexpr double kTypical = 0.3;

class GenericEffect final : public Effect {
 public:
  GenericEffect(Target target, Covariate covariate)
      : target_(target),
        covariate_(covariate),
        name_(std::string("unexplained_") + kTargets[static_cast<int>(target)] + "_vs_" +
              kCovariates[static_cast<int>(covariate)]) {
    info_.name = name_.c_str();
    info_.equation = "reading* = reading + linear in the covariate";
    // Values are in units of the sensor's σ: the columns carry it.
    const bool per_cable = target != Target::roll_pitch && target != Target::yaw;
    const bool vector = covariate == Covariate::position;
    info_.parameters = {{"slope", "sigma",
                         per_cable ? (vector ? ParameterShape::per_cable_vector3
                                             : ParameterShape::per_cable)
                                   : (vector ? ParameterShape::vector3 : ParameterShape::scalar),
                         kTypical, 1e3}};
    info_.scope = EffectScope::run;
    info_.sentence = info_.remedy = info_.settle = "";
  }
  const EffectInfo& info() const override { return info_; }
  [[nodiscard]] GenericName generic() const {
    return {kTargets[static_cast<int>(target_)], kCovariates[static_cast<int>(covariate_)]};
  }

  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const SensorSigma& sigma = context.robot.sigma;
    const int width = covariate_ == Covariate::position ? 3 : 1;
    WrenchMatrix structure;
    if (target_ == Target::tension) structure = structure_matrix(context.state);
    if (target_ == Target::roll_pitch || target_ == Target::yaw) {
      const Vector3 x = covariate(context, 0);
      for (int j = 0; j < width; ++j) {
        if (target_ == Target::yaw) {
          out(rows.attitude() + 2, j) = sigma.attitude_rad * x[j];
        } else {
          out(rows.attitude(), j) = sigma.attitude_rad * x[j];
          out(rows.attitude() + 1, j) = sigma.attitude_rad * x[j];
        }
      }
      return;
    }
    for (int i = 0; i < rows.cables; ++i) {
      const Vector3 x = covariate(context, i);
      for (int j = 0; j < width; ++j) {
        const int column = width * i + j;
        if (target_ == Target::length) out(rows.length() + i, column) = sigma.length_m * x[j];
        if (target_ == Target::swivel) out(rows.swivel() + i, column) = sigma.swivel_rad * x[j];
        if (target_ == Target::tension) {
          out.col(column).segment<6>(rows.wrench()) =
              -sigma.tension_N * x[j] * structure.col(i);
        }
      }
    }
  }

 private:
  /// Of order one over a run.
  [[nodiscard]] Vector3 covariate(const EffectContext& context, int cable) const {
    const Measurement& m = context.measurement;
    switch (covariate_) {
      case Covariate::time: return Vector3::Constant(m.run_time_s / 100.0);
      case Covariate::position: return context.pose.position_m / 0.5;
      case Covariate::tension: {
        const double mean = context.robot.weight_N() / context.state.cable_count;
        const double value = m.tension_N[cable];
        return Vector3::Constant(std::isfinite(value) ? value / mean : 0.0);
      }
      case Covariate::direction: {
        const CableVector& s =
            target_ == Target::swivel ? m.swivel_direction : m.length_direction;
        return Vector3::Constant(s.size() > cable ? s[cable] : 0.0);
      }
    }
    return Vector3::Zero();
  }

  Target target_;
  Covariate covariate_;
  std::string name_;
  EffectInfo info_;
};

}  // namespace

const Candidates& generic_candidates() {
  static const Candidates candidates = [] {
    Candidates out;
    for (const Target target :
         {Target::length, Target::swivel, Target::roll_pitch, Target::yaw, Target::tension}) {
      for (const Covariate covariate :
           {Covariate::time, Covariate::position, Covariate::tension, Covariate::direction}) {
        const bool about_a_cable =
            covariate == Covariate::tension || covariate == Covariate::direction;
        if (about_a_cable && (target == Target::roll_pitch || target == Target::yaw)) continue;
        out.push_back(std::make_shared<GenericEffect>(target, covariate));
      }
    }
    return out;
  }();
  return candidates;
}

std::optional<GenericName> generic_name(const Effect& effect) {
  const auto* generic = dynamic_cast<const GenericEffect*>(&effect);
  if (generic == nullptr) return std::nullopt;
  return generic->generic();
}

}  // namespace cdprcal
