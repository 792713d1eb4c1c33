#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/model_fit.hpp"
#include "cdprcal/estimation/presence.hpp"

namespace cdprcal {
namespace {

std::vector<EstimatedRun> estimated_runs(ModelRows& rows) {
  std::vector<EstimatedRun> out;
  for (std::size_t r = 0; r < rows.model().runs.size(); ++r) {
    EstimatedRun& run = out.emplace_back(rows.run(r), rows.layout().accepted);
    run.poses = rows.poses(r);
    run.offsets = rows.offsets(r);
    for (int o = 0; o < run.offsets.size(); ++o) run.free_offsets.push_back(o);
  }
  return out;
}

/// ½ log|A| of what is measured of A, symmetric and positive semidefinite.
double half_log_determinant(const Eigen::MatrixXd& a) {
  constexpr double kUnmeasured = 1e-12;
  const Eigen::VectorXd scale = a.diagonal().cwiseMax(kLeastDiagonal).cwiseSqrt();
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const Eigen::VectorXd pivots =
      Eigen::MatrixXd(inverse.asDiagonal() * a * inverse.asDiagonal()).ldlt().vectorD();
  double sum = scale.array().log().sum();
  for (const double pivot : pivots) {
    if (pivot > kUnmeasured) sum += 0.5 * std::log(pivot);
  }
  return sum;
}

/// Below this share of a typical size a learnt width is nothing.
constexpr double kLeastWidth = 1e-3;

/// A prior's width that is being learnt.
struct LearntWidth {
  std::size_t term;
  int group;
  double squares;     ///< Σ of its values in their prior's σ
  double determined;  ///< of how many of its values the readings tell, not the prior
};
/// Those that the readings tell anything of. `spread`: of the common unknowns, the values last.
std::vector<LearntWidth> learnt_widths(const Eigen::MatrixXd& spread,
                                       const ValuePrecision& precision,
                                       const DiagnosisModel& model) {
  constexpr double kDetermined = 0.5;
  std::vector<LearntWidth> out;
  const Eigen::Index first = spread.rows() - precision.size();
  Eigen::Index value = 0;
  for (std::size_t k = 0; k < model.effects.size(); ++k) {
    const EffectTerm& term = model.effects[k];
    const Eigen::Index begin = value;
    value += term.values.size();
    if (term.learnt.size() == 0) continue;
    const std::vector<int> groups = term.effect->learnt_widths(model.robot.cable_count());
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(term.learnt.size()), determined = squares;
    for (Eigen::Index j = 0; j < term.values.size(); ++j) {
      const int g = groups[static_cast<std::size_t>(j) % groups.size()];
      const double own = precision[begin + j];
      squares[g] += own * term.values[j] * term.values[j];
      determined[g] += 1.0 - own * spread(first + begin + j, first + begin + j);
    }
    for (int g = 0; g < term.learnt.size(); ++g) {
      if (determined[g] < kDetermined || term.learnt[g] <= kLeastWidth) continue;
      out.push_back({k, g, squares[g], determined[g]});
    }
  }
  return out;
}

/// What learning the widths costs: below a tenth of a typical size (of the noise, for errors that
/// wander) they make no difference; from there to ten typical sizes each is as probable on a
/// logarithmic scale, and the readings tell it to 1/√(2γ) (MacKay 1992, eq. 4.12).
double log_cost_of(const std::vector<LearntWidth>& widths) {
  const double range = std::log(10.0 / 0.1);
  constexpr double kSeveral = 2.0;  // of fewer values it is their own scale, not a width
  double cost = 0.0;
  for (const LearntWidth& width : widths) {
    if (width.determined < kSeveral) continue;
    cost += std::log(range) - 0.5 * std::log(kPi / width.determined);
  }
  return cost;
}

/// Rows count offsets from the model, a model from its readings: the other sign.
void turn_offsets(const DiagnosisModel& model, Eigen::MatrixXd& matrix) {
  const Eigen::Index values = model.values().size();
  const Eigen::Index offsets = matrix.rows() - values;
  matrix.topRightCorner(offsets, values) *= -1.0;
  matrix.bottomLeftCorner(values, offsets) *= -1.0;
}

}  // namespace

Eigen::VectorXd prior_precision(const DiagnosisModel& model) {
  Eigen::VectorXd out(0);
  for (const EffectTerm& term : model.effects) {
    const EffectValues typical = term.effect->typical(model.robot);
    const std::vector<int> groups = term.learnt.size() > 0
                                        ? term.effect->learnt_widths(model.robot.cable_count())
                                        : std::vector<int>();
    const Eigen::Index begin = out.size();
    out.conservativeResize(begin + term.values.size());
    for (Eigen::Index j = 0; j < term.values.size(); ++j) {
      const Eigen::Index k = j % typical.size();
      const double width = groups.empty() ? 1.0 : term.learnt[groups[static_cast<std::size_t>(k)]];
      const double sigma = term.prior_scale * width * typical[k];
      out[begin + j] = 1.0 / (sigma * sigma);
    }
  }
  return out;
}

ModelEstimation::ModelEstimation(const DiagnosisModel& model)
    : ModelEstimation(model, std::make_unique<ModelRows>(model)) {}

ModelEstimation::ModelEstimation(const DiagnosisModel& model, std::unique_ptr<ModelRows> rows)
    : Estimation(estimated_runs(*rows), model.values(), prior_precision(model)),
      rows_(std::move(rows)) {}

bool ModelEstimation::prepare(std::size_t run, const PoseLanes& poses,
                              const Eigen::VectorXd& values) {
  rows_->set_values(run, values, poses);
  return true;
}

bool ModelFit::fit(int max_steps) {
  MinimiserOptions options;
  options.max_iterations = 12 * max_steps;
  options.max_steps = max_steps;
  options.function_tolerance = 1e-9;
  options.function_floor = 1.0;
  options.first_damping = 1e-9;
  options.least_promise = 0.01;  // nats: 0.14 σ; the balance's weight changes with the pose
  const MinimiserSummary summary = minimise(*this, options);
  if (!summary.usable) return false;
  for (std::size_t r = 0; r < runs().size(); ++r) {
    DiagnosisRun& run = model_.runs[r];
    for (std::size_t i = 0; i < run.poses.size(); ++i) run.poses[i] = runs()[r].poses[i];
    run.offsets = -runs()[r].offsets;
  }
  Eigen::Index begin = 0;
  for (EffectTerm& term : model_.effects) {
    term.values = values().segment(begin, term.values.size());
    begin += term.values.size();
  }
  return summary.converged;
}

ChannelSums ModelEstimation::channel_sums(const Eigen::MatrixXd& spread) {
  ChannelSums out;
  if (!spread.allFinite()) return out;
  out.valid = left_over(spread, [&](std::size_t r, std::size_t b, const double* left) {
    const RunRows& run = rows_->run(r);
    const RowLayout& at = run.layout();
    for (const std::size_t i : poses_of(b, run.poses())) {
      for (int s = 0; s < at.size(); ++s) {
        if (!run.has_row(i, s)) continue;
        const RowSlot& slot = at.slots[static_cast<std::size_t>(s)];
        const auto c = static_cast<std::size_t>(rows_->row(r, i, slot).channel);
        const double* const of =
            left + 2 * static_cast<std::size_t>(s) * lanes::kLanes + i % lanes::kLanes;
        out.squares[c] += of[0] * of[0];
        out.freedom[c] += std::max(0.0, of[lanes::kLanes]);
      }
    }
  });
  return out;
}

double ModelEstimation::log_evidence() {
  CommonSystem system;
  if (!linearise(false, kBarely, system)) return -std::numeric_limits<double>::infinity();
  double out = -system.cost - half_log_determinant(system.information);
  for (const double value : precision()) out += 0.5 * std::log(value);
  for (std::size_t r = 0; r < runs().size(); ++r) {
    const RunRows& run = rows_->run(r);
    for (std::size_t i = 0; i < run.poses(); ++i) {
      for (const int s : runs()[r].slots) {
        if (!run.has_row(i, s)) continue;
        const RowSlot& slot = run.layout().slots[static_cast<std::size_t>(s)];
        out -= std::log(rows_->row(r, i, slot).scale);
      }
    }
    out -= runs()[r].elimination.half_log_determinant(run.poses()) + rows_->motion_widening(r);
  }
  const auto learns = [](const EffectTerm& term) { return term.learnt.size() > 0; };
  if (std::ranges::any_of(rows_->model().effects, learns)) {
    out -= log_cost_of(learnt_widths(covariance(system), precision(), rows_->model()));
  }
  return out;
}

Eigen::MatrixXd covariance(const DiagnosisModel& model) {
  Eigen::MatrixXd out = ModelEstimation(model).covariance();
  turn_offsets(model, out);
  return out;
}

double penalised_cost(const DiagnosisModel& model) {
  CommonSystem system;
  return ModelEstimation(model).linearise(false, kBarely, system) ? system.cost : kNaN;
}

double log_evidence(const DiagnosisModel& model) { return ModelEstimation(model).log_evidence(); }

ChannelSums channel_sums(const DiagnosisModel& model) {
  ModelEstimation estimation(model);
  return estimation.channel_sums(estimation.covariance());
}

bool fit(DiagnosisModel& model, int max_steps) { return ModelFit(model).fit(max_steps); }

void start_noise(DiagnosisModel& model, const Signals& signals) {
  double samples = 0.0;
  int rests = 0;
  for (const DiagnosisRun& run : model.runs) {
    for (const Measurement& m : run.measurements) {
      if (is_moving(m)) continue;
      samples += m.samples;
      ++rests;
    }
  }
  model.rest_samples = rests > 0 ? samples / rests : 1.0;
  model.signals = signals;
  const bool reads = reads_tensions(model);
  const NoiseModel specified = specified_noise(model.robot.sigma);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double sigma = specified.channel[c].pose;
    const double least = 1e-3 * sigma;  // exact readings would be weighed infinitely
    const bool balance = c == static_cast<std::size_t>(at_rest(Channel::balance));
    const double unit = balance ? sigma : 1.0;  // its level is relative to its covariance
    model.floor[c] = std::max(std::sqrt(signals[c].variance(model.rest_samples)), least) / unit;
    model.noise[c] = sigma / unit;
    // Where no load cell has a say the balance fixes the poses so well that few sensors can tell
    // whether it is better than the robot file says.
    if (balance && !reads) model.floor[c] = 1.0;
    if (kChannelTable[c].of().is_inertial()) model.floor[c] = sigma;  // its bias stays
    if (!balance) {  // single readings in motion: groups of their own
      model.floor[c + kRestGroups] = std::max(signals[c].sigma, least);
      model.noise[c + kRestGroups] = sigma;
    }
  }
}

namespace {

/// What the robot file says of a group's noise, in the units of NoiseLevels.
double specified_level(const NoiseModel& specified, std::size_t group) {
  const std::size_t channel = group % kRestGroups;
  const bool relative = channel == static_cast<std::size_t>(Channel::balance);
  return relative ? 1.0 : specified.channel[channel].pose;
}

/// Where less than one degree of freedom is left the robot file speaks for the missing part: an
/// earlier model, of fewer effects, may have left any level. By ratios, since it may be far wider
/// than what the readings bear out.
double take_noise(const ChannelSums& sums, DiagnosisModel& model) {
  const NoiseModel specified = specified_noise(model.robot.sigma);
  double change = 0.0;
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    const double freedom = sums.freedom[c];
    if (!(freedom > 0.0)) continue;  // no rows
    const double known = std::min(1.0, freedom);
    const double estimate = model.noise[c] * std::sqrt(sums.squares[c] / freedom);
    const double level =
        std::max(model.floor[c],
                 std::pow(estimate, known) * std::pow(specified_level(specified, c), 1.0 - known));
    change = std::max(change, std::abs(std::log(level / model.noise[c])));
    model.noise[c] = level;
  }
  return change;
}

/// Widths of priors that are learnt: each group's sum of squares over what the readings determine
/// of its values, the counterpart of take_noise (MacKay 1992, eq. 4.9). `spread`: of the common
/// unknowns; `precision`: of the priors as they were. Returns the largest relative change.
double take_widths(const Eigen::MatrixXd& spread, const ValuePrecision& precision,
                   DiagnosisModel& model) {
  double change = 0.0;
  for (EffectTerm& term : model.effects) {
    const std::vector<int> groups = term.effect->learnt_widths(model.robot.cable_count());
    if (!groups.empty() && term.learnt.size() == 0) {
      term.learnt.setOnes(*std::ranges::max_element(groups) + 1);
      const std::vector<double> widest = term.effect->widest();
      if (!widest.empty()) term.learnt = Eigen::VectorXd::Map(widest.data(), term.learnt.size());
    }
  }
  for (const LearntWidth& width : learnt_widths(spread, precision, model)) {
    double& present = model.effects[width.term].learnt[width.group];
    const std::vector<double> widest = model.effects[width.term].effect->widest();
    const double most = widest.empty() ? std::numeric_limits<double>::infinity()
                                       : widest[static_cast<std::size_t>(width.group)];
    const double next = std::clamp(present * std::sqrt(width.squares / width.determined),
                                   kLeastWidth, std::max(most, kLeastWidth));
    change = std::max(change, std::abs(std::log(next / present)));
    present = next;
  }
  return change;
}

}  // namespace

double estimate_noise(DiagnosisModel& model) {
  const ChannelSums sums = channel_sums(model);
  return sums.valid ? take_noise(sums, model) : 0.0;
}

bool fit_with_noise(DiagnosisModel& model) {
  constexpr int kMostRounds = 15;
  bool settled = false;
  ModelFit fit(model);
  for (int round = 0; round < kMostRounds; ++round) {
    settled = fit.fit(kMostFitSteps);
    // Of a fit that did not settle, too: its residuals tell how far it is off.
    const Eigen::MatrixXd spread = fit.covariance();
    const ChannelSums sums = fit.channel_sums(spread);
    if (!sums.valid) break;
    const double change =
        std::max(take_noise(sums, model), take_widths(spread, fit.precision(), model));
    fit.weigh();
    if (!settled || change < 0.01) break;
  }
  return settled;
}

Eigen::MatrixXd DiagnosisSystem::pose_by_rows(const PoseRange& pose) const {
  return pseudo_inverse(Eigen::MatrixXd(by_pose.middleRows(pose.begin, pose.size)));
}

Matrix6 initial_pose_covariance(const DiagnosisModel& model, std::size_t run) {
  const DiagnosisSystem system = linearise(model);
  if (!system.valid) return Matrix6::Constant(kNaN);
  const Eigen::MatrixXd common = covariance(model);
  for (const DiagnosisSystem::PoseRange& pose : system.poses) {
    if (pose.run != run || pose.pose != 0) continue;
    // δζ = −A⁺(r + C δx): its own readings' noise, and what the common unknowns pass on.
    const Eigen::MatrixXd inverse = system.pose_by_rows(pose);
    const Eigen::MatrixXd passed = inverse * system.by_common.middleRows(pose.begin, pose.size);
    return inverse * inverse.transpose() + passed * common * passed.transpose();
  }
  return Matrix6::Constant(kNaN);
}

}  // namespace cdprcal
