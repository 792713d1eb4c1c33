#include "cdprcal/evidence/scan.hpp"

#include <algorithm>
#include <numeric>
#include <string_view>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

/// Nats beyond the bound that cover what it leaves out: the noise is estimated, too.
constexpr double kFarAbove = 10.0;

/// The rows of a system, channel by channel, projected off the poses and the nuisance unknowns.
struct Stacked {
  Eigen::VectorXd residual;           ///< M r
  Eigen::MatrixXd candidates;         ///< M C
  Eigen::MatrixXd nuisance_q;         ///< orthonormal basis of what M removes beyond the poses
  std::vector<std::size_t> channels;  ///< those whose noise can be told
  std::vector<Eigen::Index> begin;    ///< of each of these channels' rows, and the end
  std::vector<Eigen::Index> order;    ///< row of the system behind each row
  ChannelSums sums;
};

/// Rows that belong to no channel of `used` come last.
std::vector<Eigen::Index> order_of(const DiagnosisSystem& system,
                                   const std::vector<std::size_t>& used,
                                   std::vector<Eigen::Index>& begin) {
  std::vector<Eigen::Index> order;
  const auto append = [&](auto belongs) {
    for (std::size_t row = 0; row < system.rows.size(); ++row) {
      if (belongs(static_cast<std::size_t>(system.rows[row].channel))) {
        order.push_back(static_cast<Eigen::Index>(row));
      }
    }
  };
  for (const std::size_t c : used) {
    begin.push_back(static_cast<Eigen::Index>(order.size()));
    append([c](std::size_t channel) { return channel == c; });
  }
  begin.push_back(static_cast<Eigen::Index>(order.size()));
  append([&](std::size_t channel) {
    return std::find(used.begin(), used.end(), channel) == used.end();
  });
  return order;
}

Stacked stack(const DiagnosisModel& model, const DiagnosisSystem& system) {
  Stacked out;
  out.sums = channel_sums(model);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (out.sums.freedom[c] >= 1.0) out.channels.push_back(c);
  }
  out.order = order_of(system, out.channels, out.begin);
  const Eigen::MatrixXd all = system.free_by_common(out.order, Eigen::all);
  const Eigen::VectorXd residual = system.free_residual(out.order);
  // The accepted effects' prior limits what they may absorb; their columns are removed all the
  // same: near their estimates the difference is far below one unit of evidence.
  out.nuisance_q = range_basis(all.leftCols(system.layout.nuisance()), 1e-9);
  const auto off_nuisance = [&](const auto& columns) -> Eigen::MatrixXd {
    return columns - out.nuisance_q * (out.nuisance_q.transpose() * columns);
  };
  out.residual = off_nuisance(residual);
  out.candidates = off_nuisance(all.rightCols(system.layout.candidates));
  return out;
}

/// −log of the likelihood maximised over each channel's noise, which its floor bounds from below:
/// of one channel, and of all. `squares`: whitened sums a channel; `floor` in units of the present
/// noise.
double profile(double squares, double freedom, double floor) {
  const double level = std::max(std::sqrt(squares / freedom), floor);
  return freedom * std::log(level) + 0.5 * squares / (level * level);
}
double profile(const NoiseLevels& squares, const NoiseLevels& freedom, const NoiseLevels& floor) {
  double total = 0.0;
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (freedom[c] >= 1.0) total += profile(squares[c], freedom[c], floor[c]);
  }
  return total;
}

/// Evidence for every candidate as a function of the projected residual alone. Moving a residual
/// along a candidate's columns changes its channels' sums of squares by products of the candidate's
/// own size: thousands of residuals go through in a few matrix products.
class EvidenceOf {
  /// The rows of a used channel.
  template <typename Matrix>
  [[nodiscard]] auto of_channel(const Matrix& rows, std::size_t used) const {
    return rows.middleRows(stacked_.begin[used], stacked_.begin[used + 1] - stacked_.begin[used]);
  }

 public:
  EvidenceOf(const DiagnosisSystem& system, const Stacked& stacked, const NoiseLevels& floor)
      : stacked_(stacked), floor_(floor) {
    const int base = system.layout.nuisance();
    for (std::size_t k = 0; k < system.layout.candidate_begin.size(); ++k) {
      Candidate a;
      a.begin = system.layout.candidate_begin[k] - base;
      a.size = system.layout.candidate_size[k];
      const auto own = stacked.candidates.middleCols(a.begin, a.size);
      a.information = own.transpose() * own;
      a.llt.compute(a.information + Eigen::MatrixXd::Identity(a.size, a.size));
      const Eigen::MatrixXd root = a.llt.matrixL();
      a.occam = root.diagonal().array().log().sum();
      for (std::size_t u = 0; u < stacked.channels.size(); ++u) {
        const auto rows = of_channel(own, u);
        a.squares.emplace_back(rows.transpose() * rows);
      }
      candidates_.push_back(std::move(a));
    }
  }

  struct Candidate {
    Eigen::Index begin, size;
    Eigen::MatrixXd information;           ///< I
    Eigen::LLT<Eigen::MatrixXd> llt;       ///< of I + 1
    double occam = 0.0;                    ///< ½ log|I + 1|
    std::vector<Eigen::MatrixXd> squares;  ///< own columns' sums of squares, a used channel
  };
  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }

  /// log evidence [candidate × residual] of residuals given as columns, projected off poses and
  /// nuisance unknowns. `values` takes each candidate's estimate for the first residual.
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::MatrixXd& residuals,
                                           std::vector<Eigen::VectorXd>* values = nullptr) const {
    const Eigen::Index count = residuals.cols();
    const std::size_t used = stacked_.channels.size();
    std::vector<Eigen::MatrixXd> cross;  // Cᵀr of each channel
    std::vector<Eigen::RowVectorXd> squares;
    for (std::size_t u = 0; u < used; ++u) {
      cross.emplace_back(of_channel(stacked_.candidates, u).transpose() * of_channel(residuals, u));
      squares.emplace_back(of_channel(residuals, u).colwise().squaredNorm());
    }
    const Eigen::Index rest = stacked_.begin.back();
    Eigen::MatrixXd scores = stacked_.candidates.bottomRows(residuals.rows() - rest).transpose() *
                             residuals.bottomRows(residuals.rows() - rest);
    for (const Eigen::MatrixXd& part : cross) scores += part;
    Eigen::RowVectorXd before(count);
    NoiseLevels sums{};
    const auto profile_of = [&](const std::vector<Eigen::RowVectorXd>& by_channel, Eigen::Index j) {
      for (std::size_t u = 0; u < used; ++u) sums[stacked_.channels[u]] = by_channel[u][j];
      return profile(sums, stacked_.sums.freedom, floor_);
    };
    for (Eigen::Index j = 0; j < count; ++j) before[j] = profile_of(squares, j);
    Eigen::MatrixXd out(static_cast<Eigen::Index>(candidates_.size()), count);
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const Candidate& a = candidates_[k];
      const Eigen::MatrixXd estimate = -a.llt.solve(scores.middleRows(a.begin, a.size));
      std::vector<Eigen::RowVectorXd> after(used);
      for (std::size_t u = 0; u < used; ++u) {
        const auto own = cross[u].middleRows(a.begin, a.size);
        after[u] = squares[u] + (estimate.array() * (2.0 * own + a.squares[u] * estimate).array())
                                    .colwise()
                                    .sum()
                                    .matrix();
      }
      for (Eigen::Index j = 0; j < count; ++j) {
        out(static_cast<Eigen::Index>(k), j) =
            before[j] - profile_of(after, j) - 0.5 * estimate.col(j).squaredNorm() - a.occam;
      }
      if (values != nullptr) values->push_back(estimate.col(0));
    }
    return out;
  }

 private:
  const Stacked& stacked_;
  NoiseLevels floor_;
  std::vector<Candidate> candidates_;
};

/// White noise off the poses: each pose's own directions taken out of its rows.
class NoiseOffPoses {
 public:
  NoiseOffPoses(const DiagnosisSystem& system, const Stacked& stacked) : stacked_(stacked) {
    const Eigen::Index rows = system.residual.size();
    basis_.resize(rows, 6);
    for (const DiagnosisSystem::PoseRange& pose : system.poses) {
      const Eigen::MatrixXd q = range_basis(system.by_pose.middleRows(pose.begin, pose.size));
      basis_.middleRows(pose.begin, pose.size).setZero();
      basis_.block(pose.begin, 0, pose.size, q.cols()) = q;
      poses_.push_back(pose);
    }
  }
  [[nodiscard]] Eigen::MatrixXd operator()(RandomNormal& random, Eigen::Index count) const {
    Eigen::MatrixXd noise(basis_.rows(), count);
    for (double& v : noise.reshaped()) v = random();
    for (const DiagnosisSystem::PoseRange& pose : poses_) {
      const auto q = basis_.middleRows(pose.begin, pose.size);
      auto own = noise.middleRows(pose.begin, pose.size);
      const Eigen::MatrixXd along = q.transpose() * own;
      own.noalias() -= q * along;
    }
    Eigen::MatrixXd out = noise(stacked_.order, Eigen::all);
    const Eigen::MatrixXd along = stacked_.nuisance_q.transpose() * out;
    out.noalias() -= stacked_.nuisance_q * along;
    return out;
  }

 private:
  const Stacked& stacked_;
  Eigen::Matrix<double, Eigen::Dynamic, 6> basis_;
  std::vector<DiagnosisSystem::PoseRange> poses_;
};

/// How well the best of all candidates does on nothing but noise, `draws` times.
Eigen::VectorXd best_by_chance(const EvidenceOf& evidence, const NoiseOffPoses& noise,
                               const ScanOptions& options) {
  constexpr Eigen::Index kBatch = 128;
  RandomNormal random(options.seed);
  Eigen::VectorXd best(options.draws);
  for (Eigen::Index begin = 0; begin < options.draws; begin += kBatch) {
    const Eigen::Index count = std::min<Eigen::Index>(kBatch, options.draws - begin);
    best.segment(begin, count) = evidence(noise(random, count)).colwise().maxCoeff();
  }
  return best;
}

/// The size, in typical sizes, from which on four of five would be found: effects of random
/// directions, in noise, against the evidence and the chance that acceptance asks for.
class Detectable {
 public:
  Detectable(const Stacked& stacked, const NoiseLevels& floor, std::size_t candidates)
      : stacked_(stacked), floor_(floor), candidates_(static_cast<double>(candidates)) {}

  [[nodiscard]] double size_of(const EvidenceOf::Candidate& a) const {
    constexpr int kDraws = 40;
    constexpr std::ptrdiff_t kFourOfFive = kDraws * 4 / 5;
    if (!(a.information.trace() > 1e-12 * static_cast<double>(a.size))) return kNaN;
    // The chance is shared among the candidates.
    const double least_energy = chi_square_quantile(
        1.0 - kShareAtRest * kFamilyWiseChance / candidates_, static_cast<double>(a.size));
    RandomNormal random(1);
    std::vector<double> sizes;
    for (int k = 0; k < kDraws; ++k) {
      Eigen::VectorXd direction(a.size);
      for (double& v : direction) v = random();
      direction *= std::sqrt(static_cast<double>(a.size)) / direction.norm();
      sizes.push_back(least_size(a, direction, random(), least_energy));
    }
    std::nth_element(sizes.begin(), sizes.begin() + kFourOfFive, sizes.end());
    return sizes[kFourOfFive] < kLargest ? sizes[kFourOfFive] : kNaN;
  }

 private:
  /// Of an effect in this direction, where the noise adds `noise` (of unit variance) along it and
  /// chance would make less than `least_energy`.
  [[nodiscard]] double least_size(const EvidenceOf::Candidate& a, const Eigen::VectorXd& direction,
                                  double noise, double least_energy) const {
    constexpr int kHalvings = 30;
    std::vector<double> squares;  // of the signature, a used channel
    for (const Eigen::MatrixXd& own : a.squares) squares.push_back(direction.dot(own * direction));
    const double all = direction.dot(a.information * direction);
    const auto found = [&](double size) {
      const double amplitude = std::max(0.0, size * std::sqrt(all) + noise);
      const double energy = amplitude * amplitude, share = energy / all;
      if (energy < least_energy) return false;
      double evidence = -0.5 * size * size * direction.squaredNorm() - a.occam, told = 0.0;
      for (std::size_t u = 0; u < squares.size(); ++u) {
        const std::size_t c = stacked_.channels[u];
        const double freedom = stacked_.sums.freedom[c];
        evidence += profile(freedom + share * squares[u], freedom, floor_[c]) -
                    profile(freedom, freedom, floor_[c]);
        told += squares[u];
      }
      evidence += 0.5 * share * std::max(0.0, all - told);
      return evidence > kLeastEvidence;
    };
    // Of far too large values the prior disapproves: the first size that would be found.
    double above = 1e-6;
    while (above < kLargest && !found(above)) above *= 1.5;
    if (!(above < kLargest)) return kLargest;
    double below = above / 1.5;
    for (int k = 0; k < kHalvings && above - below > 1e-4 * above; ++k) {
      const double middle = 0.5 * (below + above);
      (found(middle) ? above : below) = middle;
    }
    return above;
  }

  static constexpr double kLargest = 1e9;
  const Stacked& stacked_;
  NoiseLevels floor_;
  double candidates_;
};

}  // namespace

namespace {

Candidates untried_between(const DiagnosisModel& model, Shows least, Shows most) {
  Candidates out = effects_of(model.robot);
  std::erase_if(out, [&](const auto& effect) {
    // By name: one of each log stands for that of them all.
    const auto same = [&](const EffectTerm& term) {
      return std::string_view(term.effect->info().name) == effect->info().name;
    };
    const bool taken = std::ranges::any_of(model.effects, same);
    return taken || effect->info().on_request || effect->shows() < least || effect->shows() > most;
  });
  return out;
}

}  // namespace

Candidates untried(const DiagnosisModel& model) {
  return untried_between(model, Shows::at_rest,
                         balances_in_motion(model) ? Shows::in_moving_balance : Shows::at_rest);
}

Candidates untried(const DiagnosisModel& model, Shows shows) {
  return untried_between(model, shows, shows);
}

std::vector<CandidateScore> scan(const DiagnosisModel& model, const Candidates& candidates,
                                 const ScanOptions& options) {
  const DiagnosisSystem system = linearise(model, candidates);
  std::vector<CandidateScore> scores;
  if (!system.valid || candidates.empty()) return scores;
  const Stacked stacked = stack(model, system);
  NoiseLevels floor{};
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    floor[c] = model.floor[c] / model.noise[c];  // NaN of groups without readings: not asked for
  }
  const EvidenceOf evidence(system, stacked, floor);
  const Detectable detectable(stacked, floor, candidates.size());
  std::vector<Eigen::VectorXd> values;
  const Eigen::VectorXd log_evidence = evidence(stacked.residual, &values);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const EvidenceOf::Candidate& a = evidence.candidates()[k];
    CandidateScore score;
    score.effect = candidates[k];
    score.log_evidence = log_evidence[static_cast<Eigen::Index>(k)];
    const EffectValues typical = candidates[k]->typical(model.robot);
    Eigen::VectorXd scale(a.size);
    for (Eigen::Index j = 0; j < a.size; ++j) scale[j] = typical[j % typical.size()];
    score.values = values[k].cwiseProduct(scale);
    const Eigen::MatrixXd spread = a.llt.solve(Eigen::MatrixXd::Identity(a.size, a.size));
    score.deviation = spread.diagonal().cwiseSqrt().cwiseProduct(scale);
    score.visible = a.information.trace() > static_cast<double>(a.size);
    if (options.limits) score.detectable = detectable.size_of(a);
    scores.push_back(std::move(score));
  }
  std::stable_sort(scores.begin(), scores.end(),
                   [](const auto& a, const auto& b) { return a.log_evidence > b.log_evidence; });
  if (options.draws < 1) return scores;

  const Eigen::VectorXd chance = best_by_chance(evidence, NoiseOffPoses(system, stacked), options);
  for (CandidateScore& score : scores) {
    const auto as_good = (chance.array() >= score.log_evidence).count();
    score.p_value = (1.0 + static_cast<double>(as_good)) / (1.0 + options.draws);
  }
  return scores;
}

void scan_in_parts(const DiagnosisModel& model, const Candidates& candidates, std::size_t at_a_time,
                   const std::function<void(CandidateScore&&)>& take) {
  for (std::size_t begin = 0; begin < candidates.size(); begin += at_a_time) {
    const auto from = candidates.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto count = static_cast<std::ptrdiff_t>(std::min(at_a_time, candidates.size() - begin));
    for (CandidateScore& score : scan(model, Candidates(from, from + count), {.draws = 0})) {
      take(std::move(score));
    }
  }
}

double chance_at_most(double log_evidence, std::size_t candidates) {
  return std::min(1.0, std::exp(-log_evidence) * static_cast<double>(candidates));
}

bool beyond_chance(const CandidateScore& score, std::size_t candidates, int draws) {
  return score.log_evidence > kFarAbove + std::log(static_cast<double>(candidates) * (1.0 + draws));
}

std::vector<double> imitation(const DiagnosisModel& model, const CandidateScore& winner,
                              const Candidates& candidates) {
  Candidates all = candidates;
  all.push_back(winner.effect);
  const DiagnosisSystem system = linearise(model, all);
  std::vector<double> shares(candidates.size(), 0.0);
  if (!system.valid) return shares;
  const Stacked stacked = stack(model, system);
  const int base = system.layout.nuisance();
  const EffectValues typical = winner.effect->typical(model.robot);
  Eigen::VectorXd values = winner.values;
  for (Eigen::Index j = 0; j < values.size(); ++j) values[j] /= typical[j % typical.size()];
  const Eigen::VectorXd signature =
      stacked.candidates.middleCols(system.layout.candidate_begin.back() - base,
                                    system.layout.candidate_size.back()) *
      values;
  const double total = signature.squaredNorm();
  if (!(total > 0.0)) return shares;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Eigen::MatrixXd columns = stacked.candidates.middleCols(
        system.layout.candidate_begin[k] - base, system.layout.candidate_size[k]);
    // Under the rival's own prior: an imitation by absurd values does not count.
    Eigen::MatrixXd posterior = columns.transpose() * columns;
    posterior.diagonal().array() += 1.0;
    const Eigen::VectorXd product = columns.transpose() * signature;
    const Eigen::VectorXd estimate = Cholesky<Eigen::MatrixXd>(posterior).solve(product);
    shares[k] = 1.0 - (signature - columns * estimate).squaredNorm() / total;
  }
  return shares;
}

}  // namespace cdprcal
