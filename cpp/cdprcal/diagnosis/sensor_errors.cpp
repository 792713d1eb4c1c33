#include "cdprcal/diagnosis/sensor_errors.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/model_residuals.hpp"
#include "cdprcal/estimation/mean_square.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Rests below which a random function and its noise are the same thing.
constexpr int kFewestRests = 5;
/// They bear 96 % of a walk's variance.
constexpr int kMostTimeTerms = 5;
/// Of three dimensions more are needed. As many as bear all but a thousandth of the variance, so
/// many at the most.
constexpr int kMostTerms = 16;
constexpr double kBorne = 0.999;
/// How far smooth errors reach, in root mean square distances of the rests from their middle: over
/// places, over time.
constexpr double kReaches[] = {0.5, 1.0, 2.0}, kReachesInTime[] = {0.25, 0.5, 1.0};

constexpr const char* kWandering = "wandering_errors";

/// The functions φ_t that make up a random one of unit variance, Σ z_t φ_t with z_t of unit
/// variance.
struct Basis {
  const char* name;
  int terms;
  std::function<Eigen::VectorXd(const Measurement&, const Pose&)> at;
  std::optional<double> reach_m = std::nullopt;  ///< of errors by place
};

/// The first terms of a random walk from power-on, of unit variance on average over the run (Wiener
/// process): φ_t = 2 sin((t + ½)πu) / ((t + ½)π).
Basis walk(double duration_s, int terms) {
  return {kWandering, terms, [=](const Measurement& m, const Pose&) {
            const double u = m.run_time_s / duration_s;
            Eigen::VectorXd out(terms);
            for (int t = 0; t < terms; ++t) {
              const double wave = (t + 0.5) * std::numbers::pi;
              out[t] = 2.0 * std::sin(wave * u) / wave;
            }
            return out;
          }};
}

/// Where something was read, a column a rest: a place [m], or a time [s].
using Points = Eigen::MatrixXd;
using PointOf = std::function<Eigen::VectorXd(const Measurement&, const Pose&)>;

/// The first terms of a Gaussian process with a squared-exponential kernel: the eigenvectors of its
/// covariance at the points that were visited, taken on between them (Nyström).
Basis smooth(const char* name, const Points& visited, const PointOf& point_of, double reach) {
  const auto near = [=](const Eigen::VectorXd& from) -> Eigen::VectorXd {
    return (-0.5 / (reach * reach) * (visited.colwise() - from).colwise().squaredNorm())
        .array()
        .exp();
  };
  const Eigen::Index count = visited.cols();
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i) covariance.col(i) = near(visited.col(i));
  const SymmetricEigen<Eigen::MatrixXd> found(covariance);  // in increasing order
  const auto most = std::min<Eigen::Index>(kMostTerms, count - 2);
  Eigen::Index terms = 1;
  while (terms < most && found.eigenvalues().tail(terms).sum() < kBorne * covariance.trace()) {
    ++terms;
  }
  const Eigen::VectorXd size = found.eigenvalues().tail(terms).cwiseMax(1e-9).cwiseSqrt();
  const Eigen::MatrixXd weights =
      found.eigenvectors().rightCols(terms) * size.cwiseInverse().asDiagonal();
  return {name, static_cast<int>(terms),
          [=](const Measurement& m, const Pose& pose) -> Eigen::VectorXd {
            return weights.transpose() * near(point_of(m, pose));
          }};
}

/// Root mean square distance of points from their middle.
double spread_of(const Points& points) {
  return std::sqrt((points.colwise() - points.rowwise().mean()).colwise().squaredNorm().mean());
}

/// One function a rest, which is 1 there and 0 at all others: rests are known by their times.
Basis each_rest(std::vector<double> times_s) {
  const auto count = static_cast<int>(times_s.size());
  return {"own_errors", count, [=](const Measurement& m, const Pose&) {
            Eigen::VectorXd out = Eigen::VectorXd::Zero(count);
            const auto nearest = std::ranges::min_element(
                times_s, {}, [&](double time_s) { return std::abs(time_s - m.run_time_s); });
            if (!is_moving(m)) out[nearest - times_s.begin()] = 1.0;
            return out;
          }};
}

/// Where the platform rested, run after run, and how many rests the shortest run has.
struct Rests {
  Points place_m;
  std::vector<double> times_s;  ///< in order, each once
  double duration_s = 0.0;
  int fewest = std::numeric_limits<int>::max();
};

Rests rests_of(const DiagnosisModel& model) {
  Rests out;
  std::vector<Vector3> places;
  for (const DiagnosisRun& run : model.runs) {
    int count = 0;
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      if (is_moving(m)) continue;
      out.duration_s = std::max(out.duration_s, m.run_time_s);
      places.push_back(run.poses[i].position_m);
      out.times_s.push_back(m.run_time_s);
      ++count;
    }
    out.fewest = std::min(out.fewest, count);
  }
  out.place_m.resize(3, static_cast<Eigen::Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    out.place_m.col(static_cast<Eigen::Index>(i)) = places[i];
  }
  std::ranges::sort(out.times_s);
  const auto repeated = std::ranges::unique(out.times_s);
  out.times_s.erase(repeated.begin(), repeated.end());
  return out;
}

/// The channels that may be off, in the order of a term's values: readings as ReadingRows has them,
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

/// Of all kParts, one after another.
int all_components(int cables) { return 3 * cables + 3; }

/// Where a sensor's component stands among these.
int place_of(const OneSensor& sensor, int cables) {
  int begin = 0;
  for (const auto& [channel, shape] : kParts) {
    if (channel == sensor.channel) break;
    begin += entries(shape, cables);
  }
  return begin + sensor.component;
}

/// Each channel, component by component, with a random function of its own; or one component.
class SensorErrors final : public Effect {
 public:
  SensorErrors(Basis basis, const DiagnosisModel& model, std::optional<OneSensor> only = {},
               ErrorSize size = ErrorSize::any)
      : basis_(std::move(basis)), only_(only) {
    info_.name = basis_.name;
    info_.equation = "reading* = reading + a random function";
    info_.sentence = info_.remedy = info_.settle = "";
    info_.scope = EffectScope::run;
    // Of the tensions they are gains and biases in disguise, and weighed as these are.
    info_.of_load_cells = true;
    const NoiseModel specified = specified_noise(model.robot.sigma);
    for (int t = 0; t < basis_.terms; ++t) {
      for (const auto& [channel, shape] : kParts) {
        if (only_ && only_->channel != channel) continue;
        const NoiseGroup group = at_rest(channel);
        const double noise =
            noise_unit(model.robot, group) * model.noise[static_cast<std::size_t>(group)];
        // Of what nobody reads nothing is known.
        const double typical = std::isfinite(noise) && noise > 0.0 ? noise : 1.0;
        const ParameterShape of = only_ ? ParameterShape::scalar : shape;
        info_.parameters.push_back({"amplitude", "", of, typical, 1e9});
        if (t > 0 || size == ErrorSize::any) continue;
        widest_.push_back(specified.channel[static_cast<std::size_t>(group)].pose / typical);
      }
    }
  }
  const EffectInfo& info() const override { return info_; }
  [[nodiscard]] std::optional<double> reach_m() const { return basis_.reach_m; }
  [[nodiscard]] const std::optional<OneSensor>& only() const { return only_; }
  /// A channel's errors are of one size.
  std::vector<int> learnt_widths(int cables) const override {
    if (only_) return std::vector<int>(static_cast<std::size_t>(basis_.terms), 0);
    std::vector<int> out;
    for (int t = 0; t < basis_.terms; ++t) {
      int group = 0;
      for (const Part& part : kParts) {
        out.insert(out.end(), static_cast<std::size_t>(entries(part.shape, cables)), group++);
      }
    }
    return out;
  }

  std::vector<double> widest() const override { return widest_; }

  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    const int n = context.state.cable_count;
    const Eigen::VectorXd change = by_component(n, context.measurement, context.pose, values);
    evaluation.length_m += change.head(n);
    evaluation.swivel_rad += change.segment(n, n);
    evaluation.roll_pitch_yaw_rad += change.segment<3>(2 * n);
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    const int n = context.state.cable_count;
    tension_N -= by_component(n, context.measurement, context.pose, values).tail(n);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const int n = context.state.cable_count, of_readings = 2 * n + 3;
    const Eigen::VectorXd at = basis_.at(context.measurement, context.pose);
    const Eigen::MatrixXd pull = structure_matrix(context.state);
    const int first = only_ ? place_of(*only_, n) : 0;
    for (int t = 0; t < basis_.terms; ++t) {
      for (int k = 0; k < components(n); ++k) {
        const int component = first + k, column = t * components(n) + k;
        if (component < of_readings) {
          out(component, column) = at[t];
        } else {
          out.block(of_readings, column, 6, 1) = -at[t] * pull.col(component - of_readings);
        }
      }
    }
  }

  /// Root mean squares of what values add over the rests of a model, by channel.
  [[nodiscard]] std::array<double, kRestGroups> rms(const DiagnosisModel& model,
                                                    const EffectTerm& term) const {
    const int n = model.robot.cable_count();
    std::array<MeanSquare, kRestGroups> sums;
    for (std::size_t r = 0; r < model.runs.size(); ++r) {
      const EffectValues values = term.values.segment(term.begin_of(r, n), size(n));
      const DiagnosisRun& run = model.runs[r];
      for (std::size_t i = 0; i < run.measurements.size(); ++i) {
        const Measurement& m = run.measurements[i];
        if (is_moving(m)) continue;
        const Eigen::VectorXd change = by_component(n, m, run.poses[i], values);
        Eigen::Index begin = 0;
        for (const auto& [channel, shape] : kParts) {
          MeanSquare& sum = sums[static_cast<std::size_t>(at_rest(channel))];
          for (int k = 0; k < entries(shape, n); ++k) {
            if (!only_ || begin + k == place_of(*only_, n)) sum.add(change[begin + k]);
          }
          begin += entries(shape, n);
        }
      }
    }
    std::array<double, kRestGroups> out{};
    std::ranges::transform(sums, out.begin(), &MeanSquare::rms);
    return out;
  }

  /// Of one sensor: at which rest of the only run errors are large, where that is one.
  [[nodiscard]] std::optional<double> only_rest_s(const DiagnosisModel& model,
                                                  const EffectTerm& term, double like) const {
    const int n = model.robot.cable_count();
    if (!only_ || model.runs.size() != 1) return std::nullopt;
    const DiagnosisRun& run = model.runs.front();
    MeanSquare all;
    double largest = 0.0, at_s = kNaN;
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      if (is_moving(m)) continue;
      const double error = by_component(n, m, run.poses[i], term.values)[place_of(*only_, n)];
      all.add(error);
      if (std::abs(error) > largest) largest = std::abs(error), at_s = m.run_time_s;
    }
    constexpr double kByChance = 0.99;
    const double others = std::max(1.0, all.count - 1.0);
    const double most = like * like * chi_square_quantile(kByChance, others);
    if (!(largest > 0.0) || all.sum - largest * largest > most) return std::nullopt;
    return at_s;
  }

 private:
  [[nodiscard]] int components(int cables) const { return only_ ? 1 : all_components(cables); }
  /// What all terms together add to each component of kParts.
  [[nodiscard]] Eigen::VectorXd by_component(int cables, const Measurement& m, const Pose& pose,
                                             const EffectValues& values) const {
    const Eigen::VectorXd own =
        values.reshaped(components(cables), basis_.terms) * basis_.at(m, pose);
    if (!only_) return own;
    Eigen::VectorXd out = Eigen::VectorXd::Zero(all_components(cables));
    out[place_of(*only_, cables)] = own[0];
    return out;
  }

  Basis basis_;
  std::optional<OneSensor> only_;
  std::vector<double> widest_;
  EffectInfo info_;
};

}  // namespace

Candidates smooth_errors(const DiagnosisModel& model, ErrorSize size) {
  const Rests rests = rests_of(model);
  if (rests.fewest < kFewestRests) return {};
  Candidates out;
  const auto add = [&](const char* name, const Points& visited, const PointOf& point_of,
                       std::span<const double> reaches, bool of_place) {
    const double spread = spread_of(visited);
    for (const double times : reaches) {
      const double reach = times * spread;
      if (!(reach > 0.0)) continue;
      Basis basis = smooth(name, visited, point_of, reach);
      if (of_place) basis.reach_m = reach;
      out.push_back(std::make_shared<SensorErrors>(std::move(basis), model, std::nullopt, size));
    }
  };
  add(
      "place_errors", rests.place_m,
      [](const Measurement&, const Pose& pose) { return pose.position_m; }, kReaches, true);
  add(
      kWandering,
      Eigen::Map<const Eigen::RowVectorXd>(rests.times_s.data(), std::ssize(rests.times_s)),
      [](const Measurement& m, const Pose&) { return Eigen::VectorXd::Constant(1, m.run_time_s); },
      kReachesInTime, false);
  return out;
}

std::optional<Refit> likeliest_smooth_errors(const DiagnosisModel& model, ErrorSize size) {
  DiagnosisModel start = model;
  if (size == ErrorSize::specified) {
    // Noise of one channel may have grown to stand for errors of another.
    const NoiseModel specified = specified_noise(model.robot.sigma);
    for (std::size_t c = 0; c < kRestGroups; ++c) {
      const double unit = noise_unit(model.robot, static_cast<NoiseGroup>(c));
      start.noise[c] = std::min(start.noise[c], specified.channel[c].pose / unit);
    }
  }
  const Candidates reaches = smooth_errors(start, size);
  std::vector<Refit> refits = EvidenceAgainst(model).refits(
      scan(start, reaches, {.draws = 0}), static_cast<int>(reaches.size()),
      [&](const CandidateScore& s) { return size == ErrorSize::any || s.log_evidence > 0.0; },
      start);
  if (refits.empty() || !(refits.front().log_evidence > 0.0)) return std::nullopt;
  return std::move(refits.front());
}

std::shared_ptr<const Effect> wandering_errors(const DiagnosisModel& model, ErrorSize size) {
  const Rests rests = rests_of(model);
  if (rests.fewest < kFewestRests || !(rests.duration_s > 0.0)) return nullptr;
  return std::make_shared<SensorErrors>(
      walk(rests.duration_s, std::min(kMostTimeTerms, rests.fewest - 2)), model, std::nullopt,
      size);
}

namespace {

/// Mean squares of what a model leaves of each component of kParts at rests.
std::vector<MeanSquare> residuals_of(const DiagnosisModel& model) {
  const int n = model.robot.cable_count();
  std::vector<MeanSquare> out(static_cast<std::size_t>(all_components(n)));
  for (const ModelResidual& entry : model_residuals(model)) {
    if (is_moving(model.runs[entry.run].measurements[entry.pose])) continue;
    const PoseResidual& left = entry.residual;
    std::size_t component = 0;
    const auto add = [&](const auto& values, int count) {
      for (int k = 0; k < count; ++k, ++component) {
        if (k < values.size()) out[component].add(values[k]);
      }
    };
    add(left.length_m, n);
    add(left.swivel_rad, n);
    add(left.roll_pitch_yaw_rad, 3);
    add(left.tension_N, n);
  }
  return out;
}

}  // namespace

int sensors_with_like(const DiagnosisModel& model) {
  return all_components(model.robot.cable_count()) - 1;  // but the yaw's
}

Candidates own_errors(const DiagnosisModel& model, double larger) {
  const Rests rests = rests_of(model);
  if (rests.fewest < kFewestRests) return {};
  const int n = model.robot.cable_count();
  const std::vector<MeanSquare> left = residuals_of(model);
  Candidates out;
  std::size_t begin = 0;
  for (const auto& [channel, shape] : kParts) {
    const auto count = static_cast<std::size_t>(entries(shape, n));
    const auto square = [&](std::size_t k) { return std::pow(left[begin + k].rms(), 2); };
    for (std::size_t k = 0; k < count && count > 1; ++k) {  // of one its noise is its own already
      double others = 0.0, read = 0.0;
      for (std::size_t j = 0; j < count; ++j) {
        if (j == k || !std::isfinite(square(j))) continue;
        others += square(j);
        read += 1.0;
      }
      if (!(square(k) * read > larger * others)) continue;  // NaN: not read
      const OneSensor sensor{channel, static_cast<int>(k)};
      out.push_back(std::make_shared<SensorErrors>(each_rest(rests.times_s), model, sensor));
    }
    begin += count;
  }
  return out;
}

namespace {

const SensorErrors* as_sensor_errors(const Effect& effect) {
  return dynamic_cast<const SensorErrors*>(&effect);
}

}  // namespace

bool is_wandering_errors(const Effect& effect) {
  const SensorErrors* const errors = as_sensor_errors(effect);
  return errors && !errors->only() && !errors->reach_m();
}

std::optional<OneSensor> sensor_of_errors(const Effect& effect) {
  const SensorErrors* const errors = as_sensor_errors(effect);
  return errors ? errors->only() : std::nullopt;
}

std::optional<double> reach_of_errors_m(const Effect& effect) {
  const SensorErrors* const errors = as_sensor_errors(effect);
  return errors ? errors->reach_m() : std::nullopt;
}

std::string words_of_smooth(const Effect& errors) {
  return reach_of_errors_m(errors) ? "errors that change with the place"
                                   : "errors that wander with time";
}

std::array<double, kRestGroups> rms_of_errors(const DiagnosisModel& model, const EffectTerm& term) {
  return dynamic_cast<const SensorErrors&>(*term.effect).rms(model, term);
}

std::optional<double> only_rest_s(const DiagnosisModel& model, const EffectTerm& term,
                                  double like) {
  return dynamic_cast<const SensorErrors&>(*term.effect).only_rest_s(model, term, like);
}

}  // namespace cdprcal
