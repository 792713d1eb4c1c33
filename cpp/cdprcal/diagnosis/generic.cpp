#include "cdprcal/diagnosis/generic.hpp"

#include <algorithm>

#include "cdprcal/diagnosis/motion.hpp"
#include "cdprcal/diagnosis/turns.hpp"
#include "cdprcal/estimation/mean_square.hpp"

namespace cdprcal {
namespace {

enum class CovariateKind { time, position, tension, direction, itself };

constexpr const char* kTargets[] = {"length", "swivel", "roll_pitch", "yaw",
                                    "tension"};  // by Channel
constexpr const char* kCovariates[] = {"time", "pose", "tension", "direction", "reading"};

/// By Channel.
constexpr DependenceSize kSizes[] = {{3e-3, Yardstick::frame},
                                     {0.01, Yardstick::none},
                                     {0.01, Yardstick::none},
                                     {0.03, Yardstick::none},
                                     {4.0, Yardstick::weight}};

/// What the runs visited: x → (x − middle) / spread is of order one.
struct Scale {
  double middle = 0.0, spread = 1.0;
  [[nodiscard]] double operator()(double x) const { return (x - middle) / spread; }
};

struct VisitedPlaces {
  std::array<bool, 3> turns{};  ///< angles_that_vary
  Scale time;                   ///< to [−1, 1]
  std::array<Scale, 3> position;
  double tension_N = 1.0, tilt_rad = 1.0;      ///< root mean squares
  std::vector<Scale> tension, length, swivel;  ///< by cable
};

template <class Values>
Scale scale_of(const Values& values) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v, squares += v * v, ++count;
  }
  if (count < 2) return {};
  const double mean = sum / count;
  const double spread = std::sqrt(std::max(0.0, squares / count - mean * mean));
  return {mean, spread > 1e-9 ? spread : 1.0};
}

/// 1 where nothing of any size was added.
double size_of(const MeanSquare& values) {
  const double rms = values.rms();
  return rms > 1e-9 ? rms : 1.0;
}

/// Legendre polynomials P1 … P4: a smooth course over the run.
double legendre(int degree, double x) {
  switch (degree) {
    case 1:
      return x;
    case 2:
      return 0.5 * (3.0 * x * x - 1.0);
    case 3:
      return 0.5 * x * (5.0 * x * x - 3.0);
    default:
      return 0.125 * ((35.0 * x * x - 30.0) * x * x + 3.0);
  }
}

/// One dependence: `terms` functions of the covariate, for all cables alike or for each.
struct Form {
  Channel target;
  CovariateKind covariate;
  bool common;
  int terms;
};

class GenericEffect final : public Effect {
 public:
  GenericEffect(Form form, std::shared_ptr<const VisitedPlaces> visited, int number)
      : form_(form),
        visited_(std::move(visited)),
        name_(std::string("unexplained_") + kTargets[static_cast<int>(form.target)] + "_vs_" +
              kCovariates[static_cast<int>(form.covariate)] + "_" + std::to_string(number)) {
    info_.name = name_.c_str();
    info_.equation = "reading* = reading + functions of the covariate";
    const DependenceSize size = dependence_size(form.target);
    const bool alike = form.common || !of_a_cable(form.target);
    for (int t = 0; t < form.terms; ++t) {
      info_.parameters.push_back({"amplitude", "",
                                  alike ? ParameterShape::scalar : ParameterShape::per_cable,
                                  size.typical, 1e9, size.of});
    }
    info_.scope = EffectScope::run;
    // Of the tensions it is a gain or a bias in disguise, and weighed as these are.
    info_.of_load_cells = form.target == Channel::balance;
    info_.sentence = info_.remedy = info_.settle = "";
  }
  const EffectInfo& info() const override { return info_; }
  [[nodiscard]] GenericName generic() const {
    return {kTargets[static_cast<int>(form_.target)],
            kCovariates[static_cast<int>(form_.covariate)]};
  }

  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    if (form_.target == Channel::balance) return;
    const ReadingRows rows{context.state.cable_count};
    Eigen::MatrixXd by_value = Eigen::MatrixXd::Zero(rows.size(), values.size());
    columns(context, values, by_value);
    const Eigen::VectorXd change = by_value * values;
    for (int i = 0; i < rows.cables; ++i) {
      evaluation.length_m[i] += change[rows.length() + i];
      evaluation.swivel_rad[i] += change[rows.swivel() + i];
    }
    evaluation.roll_pitch_yaw_rad += change.segment<3>(rows.attitude());
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    if (form_.target != Channel::balance) return;
    for (int i = 0; i < context.state.cable_count; ++i) {
      for (int t = 0; t < form_.terms; ++t) {
        tension_N[i] -= values[column(i, t, context.state.cable_count)] * term(context, i, t);
      }
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    if (form_.target == Channel::yaw) {
      for (int t = 0; t < form_.terms; ++t) out(rows.attitude() + 2, t) = term(context, 0, t);
      return;
    }
    if (form_.target == Channel::roll_pitch) {
      // The first half of the terms acts on roll, the second on pitch.
      const int half = form_.terms / 2;
      for (int t = 0; t < form_.terms; ++t) {
        out(rows.attitude() + t / half, t) = term(context, 0, t % half);
      }
      return;
    }
    Eigen::MatrixXd by_cable = Eigen::MatrixXd::Zero(rows.cables, out.cols());
    for (int i = 0; i < rows.cables; ++i) {
      for (int t = 0; t < form_.terms; ++t) {
        by_cable(i, column(i, t, rows.cables)) = term(context, i, t);
      }
    }
    switch (form_.target) {
      case Channel::length:
        out.middleRows(rows.length(), rows.cables) = by_cable;
        break;
      case Channel::swivel:
        out.middleRows(rows.swivel(), rows.cables) = by_cable;
        break;
      default:
        out.middleRows<6>(rows.wrench()) = -wrench_by_tension(context.state, by_cable);
    }
  }

 private:
  static bool of_a_cable(Channel target) {
    return target == Channel::length || target == Channel::swivel || target == Channel::balance;
  }
  [[nodiscard]] int column(int cable, int t, int cables) const {
    return form_.common ? t : t * cables + cable;
  }

  /// The t-th function of the covariate, of order one over the runs. What a geometric reading
  /// should be stands for the reading: where the platform hardly turns, or not at all, readings
  /// differ by their noise, and what is left of them depends on that.
  [[nodiscard]] double term(const EffectContext& context, int cable, int t) const {
    const Measurement& m = context.measurement;
    const auto c = static_cast<std::size_t>(cable);
    switch (form_.covariate) {
      case CovariateKind::time:  // nothing yet at the start of the run
        return legendre(t + 1, visited_->time(m.run_time_s)) - legendre(t + 1, -1.0);
      case CovariateKind::position: {
        const auto x = [&](int axis) {
          return visited_->position[static_cast<std::size_t>(axis)](context.pose.position_m[axis]);
        };
        if (t < 3) return x(t);
        if (t < 6) return x(t - 3) * x(t - 3) - 1.0;
        return x(t - 6) * x((t - 5) % 3);
      }
      case CovariateKind::tension:
        return bent(visited_->tension[c](m.tension_of_laws_N()[cable]), t);
      case CovariateKind::direction: {
        return value_or_zero(
            form_.target == Channel::swivel ? m.swivel_direction : m.length_direction, cable);
      }
      case CovariateKind::itself:
        break;
    }
    switch (form_.target) {
      case Channel::length:
        return bent(visited_->length[c](context.state.cable[c].length_m), t);
      case Channel::swivel:
        return bent(visited_->swivel[c](context.state.cable[c].swivel_rad), t);
      // Absolute readings have a true zero.
      case Channel::balance: {
        const double x = finite(m.tension_of_laws_N()[cable] / visited_->tension_N);
        return t == 0 ? x : x * x;
      }
      case Channel::roll_pitch:
        return turns(t) ? attitude(context)[t] / visited_->tilt_rad : 0.0;
      case Channel::yaw: {
        const double yaw = attitude(context)[2];
        return t == 0 ? std::sin(yaw) : std::cos(yaw);
      }
      default:
        return 0.0;
    }
  }
  [[nodiscard]] bool turns(int angle) const {
    return visited_->turns[static_cast<std::size_t>(angle)];
  }
  static Vector3 attitude(const EffectContext& context) {
    return euler_from_rotation(context.state.rotation, context.robot.euler_convention);
  }
  static double finite(double x) { return std::isfinite(x) ? x : 0.0; }
  static double bent(double x, int t) { return finite(t == 0 ? x : x * x - 1.0); }

  Form form_;
  std::shared_ptr<const VisitedPlaces> visited_;
  std::string name_;
  EffectInfo info_;
};

std::shared_ptr<const VisitedPlaces> places_visited_by(const DiagnosisModel& model) {
  auto out = std::make_shared<VisitedPlaces>();
  const auto n = static_cast<std::size_t>(model.robot.cable_count());
  out->turns = angles_that_vary(model);
  double last_s = 0.0;
  std::array<std::vector<double>, 3> position;
  MeanSquare tilt, pull;
  std::vector<std::vector<double>> tension(n), length(n), swivel(n);
  for (const DiagnosisRun& run : model.runs) {
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      last_s = std::max(last_s, m.run_time_s);
      for (std::size_t a = 0; a < 3; ++a) {
        position[a].push_back(run.poses[i].position_m[static_cast<Eigen::Index>(a)]);
      }
      const PlatformState state = platform_state(model.robot, run.poses[i]);
      const Vector3 angles = euler_from_rotation(state.rotation, model.robot.euler_convention);
      for (const double angle : {angles[0], angles[1]}) tilt.add(angle);
      for (std::size_t c = 0; c < n; ++c) {
        const auto cable = static_cast<Eigen::Index>(c);
        tension[c].push_back(m.tension_of_laws_N()[cable]);
        pull.add(m.tension_of_laws_N()[cable]);
        length[c].push_back(state.cable[c].length_m);
        swivel[c].push_back(state.cable[c].swivel_rad);
      }
    }
  }
  if (last_s > 0.0) out->time = {0.5 * last_s, 0.5 * last_s};
  for (std::size_t a = 0; a < 3; ++a) out->position[a] = scale_of(position[a]);
  out->tilt_rad = size_of(tilt);
  out->tension_N = size_of(pull);
  for (std::size_t c = 0; c < n; ++c) {
    out->tension.push_back(scale_of(tension[c]));
    out->length.push_back(scale_of(length[c]));
    out->swivel.push_back(scale_of(swivel[c]));
  }
  return out;
}

constexpr bool kCommon = true, kEach = false;
constexpr Form kForms[] = {
    {Channel::length, CovariateKind::time, kCommon, 4},
    {Channel::length, CovariateKind::time, kEach, 2},
    {Channel::length, CovariateKind::position, kEach, 3},
    {Channel::length, CovariateKind::tension, kCommon, 1},
    {Channel::length, CovariateKind::tension, kEach, 2},
    {Channel::length, CovariateKind::direction, kEach, 1},
    {Channel::length, CovariateKind::itself, kEach, 2},
    {Channel::swivel, CovariateKind::time, kEach, 2},
    {Channel::swivel, CovariateKind::position, kEach, 3},
    {Channel::swivel, CovariateKind::tension, kEach, 1},
    {Channel::swivel, CovariateKind::direction, kEach, 1},
    {Channel::swivel, CovariateKind::itself, kEach, 2},
    {Channel::roll_pitch, CovariateKind::time, kCommon, 6},
    {Channel::roll_pitch, CovariateKind::position, kCommon, 6},
    {Channel::roll_pitch, CovariateKind::itself, kCommon, 4},
    {Channel::yaw, CovariateKind::time, kCommon, 4},
    {Channel::yaw, CovariateKind::position, kCommon, 9},
    {Channel::yaw, CovariateKind::itself, kCommon, 2},
    {Channel::balance, CovariateKind::time, kCommon, 4},
    {Channel::balance, CovariateKind::time, kEach, 2},
    {Channel::balance, CovariateKind::position, kEach, 3},
    {Channel::balance, CovariateKind::itself, kCommon, 2},
    {Channel::balance, CovariateKind::itself, kEach, 2},
    {Channel::balance, CovariateKind::direction, kEach, 1},
};

}  // namespace

DependenceSize dependence_size(Channel channel) {
  return kSizes[static_cast<std::size_t>(channel)];
}

Candidates generic_candidates(const DiagnosisModel& model) {
  const std::shared_ptr<const VisitedPlaces> visited = places_visited_by(model);
  Candidates out;
  int number = 0;
  const bool in_motion = balances_in_motion(model);
  for (const Form& form : kForms) {
    ++number;
    if (form.covariate == CovariateKind::itself) {
      const auto& [roll, pitch, yaw] = visited->turns;
      if (in_motion || (form.target == Channel::roll_pitch && !roll && !pitch) ||
          (form.target == Channel::yaw && !yaw)) {
        continue;
      }
    }
    out.push_back(std::make_shared<GenericEffect>(form, visited, number));
  }
  return out;
}

std::optional<GenericName> generic_name(const Effect& effect) {
  const auto* generic = dynamic_cast<const GenericEffect*>(&effect);
  if (generic == nullptr) return std::nullopt;
  return generic->generic();
}

}  // namespace cdprcal
