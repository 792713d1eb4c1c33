#include "cdprcal/diagnosis/scan.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <numeric>

#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

/// Nats beyond the bound that cover what it leaves out: the noise is estimated, too.
constexpr double kFarAbove = 10.0;

/// All reduced rows stacked, projected off the nuisance unknowns.
struct Stacked {
  Eigen::VectorXd residual;         ///< M r
  Eigen::MatrixXd candidates;       ///< M C
  Eigen::MatrixXd nuisance_q;       ///< orthonormal basis of what M removes
  std::vector<Eigen::Index> begin;  ///< first row of each pose
  ChannelSums sums;
};

Stacked stack(const DiagnosisSystem& system) {
  Stacked out;
  Eigen::Index rows = 0;
  for (const PoseSystem& pose : system.poses) {
    out.begin.push_back(rows);
    rows += pose.reduced.size();
  }
  out.begin.push_back(rows);
  const int nuisance = system.layout.nuisance();
  Eigen::MatrixXd all(rows, system.layout.size());
  Eigen::VectorXd residual(rows);
  for (std::size_t i = 0; i < system.poses.size(); ++i) {
    const Eigen::Index size = out.begin[i + 1] - out.begin[i];
    all.middleRows(out.begin[i], size) = system.poses[i].reduced_by_common;
    residual.segment(out.begin[i], size) = system.poses[i].reduced;
  }
  // The accepted effects' prior limits what they may absorb; their columns are removed all the
  // same: near their estimates the difference is far below one unit of evidence.
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(all.leftCols(nuisance));
  qr.setThreshold(1e-9);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(rows, qr.rank());
  out.nuisance_q = q;
  out.residual = residual - q * (q.transpose() * residual);
  const auto candidates = all.rightCols(system.layout.candidates);
  out.candidates = candidates - q * (q.transpose() * candidates);
  out.sums = channel_sums(system);
  return out;
}

/// −log of the likelihood maximised over each channel's noise, which its floor bounds from below.
/// `squares`: whitened sums a channel; `floor` in units of the present noise.
double profile(const NoiseLevels& squares, const NoiseLevels& freedom, const NoiseLevels& floor) {
  double total = 0.0;
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (freedom[c] < 1.0) continue;
    const double level = std::max(std::sqrt(squares[c] / freedom[c]), floor[c]);
    total += freedom[c] * std::log(level) + 0.5 * squares[c] / (level * level);
  }
  return total;
}

/// Evidence for every candidate as a function of the reduced residual alone. Sums of squares by
/// channel are quadratic forms rᵀW_c r, so that moving r along a candidate's columns costs products
/// of the candidate's own size: thousands of residuals go through in a few matrix products.
class EvidenceOf {
 public:
  EvidenceOf(const DiagnosisSystem& system, const Stacked& stacked, const NoiseLevels& floor)
      : stacked_(stacked), floor_(floor) {
    for (std::size_t c = 0; c < kNoiseGroups; ++c) {
      if (stacked.sums.freedom[c] >= 1.0) used_.push_back(c);
    }
    for (const PoseSystem& pose : system.poses) rows_.push_back(rows_of(pose));
    const Eigen::MatrixXd& columns = stacked.candidates;
    for (std::size_t u = 0; u < used_.size(); ++u) weighted_.push_back(by_channel(columns, u));
    const int base = system.layout.nuisance();
    for (std::size_t k = 0; k < system.layout.candidate_begin.size(); ++k) {
      Candidate a;
      a.begin = system.layout.candidate_begin[k] - base;
      a.size = system.layout.candidate_size[k];
      const auto own = columns.middleCols(a.begin, a.size);
      a.information = own.transpose() * own;
      a.llt.compute(a.information + Eigen::MatrixXd::Identity(a.size, a.size));
      const Eigen::MatrixXd root = a.llt.matrixL();
      a.occam = root.diagonal().array().log().sum();
      for (const Eigen::MatrixXd& w : weighted_) {
        a.squares.push_back(own.transpose() * w.middleCols(a.begin, a.size));
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

  /// log evidence [candidate × residual] of residuals given as columns, projected off the nuisance
  /// unknowns. `values` takes each candidate's estimate for the first residual.
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::MatrixXd& residuals,
                                           std::vector<Eigen::VectorXd>* values = nullptr) const {
    const Eigen::Index count = residuals.cols();
    const Eigen::MatrixXd scores = stacked_.candidates.transpose() * residuals;
    std::vector<Eigen::MatrixXd> cross;  // C^T W_c r
    std::vector<Eigen::RowVectorXd> squares;
    for (std::size_t u = 0; u < used_.size(); ++u) {
      cross.push_back(weighted_[u].transpose() * residuals);
      squares.push_back(squares_of(residuals, u));
    }
    Eigen::RowVectorXd before(count);
    NoiseLevels sums{};
    for (Eigen::Index j = 0; j < count; ++j) {
      for (std::size_t u = 0; u < used_.size(); ++u) sums[used_[u]] = squares[u][j];
      before[j] = profile(sums, stacked_.sums.freedom, floor_);
    }
    Eigen::MatrixXd out(static_cast<Eigen::Index>(candidates_.size()), count);
    for (std::size_t k = 0; k < candidates_.size(); ++k) {
      const Candidate& a = candidates_[k];
      const Eigen::MatrixXd estimate = -a.llt.solve(scores.middleRows(a.begin, a.size));
      std::vector<Eigen::RowVectorXd> after(used_.size());
      for (std::size_t u = 0; u < used_.size(); ++u) {
        const auto own = cross[u].middleRows(a.begin, a.size);
        after[u] = squares[u] + (estimate.array() * (2.0 * own + a.squares[u] * estimate).array())
                                    .colwise()
                                    .sum()
                                    .matrix();
      }
      for (Eigen::Index j = 0; j < count; ++j) {
        for (std::size_t u = 0; u < used_.size(); ++u) sums[used_[u]] = after[u][j];
        out(static_cast<Eigen::Index>(k), j) = before[j] -
                                               profile(sums, stacked_.sums.freedom, floor_) -
                                               0.5 * estimate.col(j).squaredNorm() - a.occam;
      }
      if (values != nullptr) values->push_back(estimate.col(0));
    }
    return out;
  }

 private:
  /// W_c times columns of reduced rows.
  [[nodiscard]] Eigen::MatrixXd by_channel(const Eigen::MatrixXd& columns, std::size_t used) const {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(columns.rows(), columns.cols());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Eigen::Index size = stacked_.begin[i + 1] - stacked_.begin[i];
      const Eigen::MatrixXd& rows = rows_[i][used];
      out.middleRows(stacked_.begin[i], size).noalias() =
          rows.transpose() * (rows * columns.middleRows(stacked_.begin[i], size));
    }
    return out;
  }
  [[nodiscard]] Eigen::RowVectorXd squares_of(const Eigen::MatrixXd& residuals,
                                              std::size_t used) const {
    Eigen::RowVectorXd out = Eigen::RowVectorXd::Zero(residuals.cols());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Eigen::Index size = stacked_.begin[i + 1] - stacked_.begin[i];
      out +=
          (rows_[i][used] * residuals.middleRows(stacked_.begin[i], size)).colwise().squaredNorm();
    }
    return out;
  }
  /// A projection's rows that belong to each used channel.
  [[nodiscard]] std::vector<Eigen::MatrixXd> rows_of(const PoseSystem& pose) const {
    const PoseProjection projection = pose.projection();
    std::vector<Eigen::MatrixXd> out;
    for (const std::size_t c : used_) {
      std::vector<Eigen::Index> own;
      for (std::size_t row = 0; row < pose.channel.size(); ++row) {
        if (static_cast<std::size_t>(pose.channel[row]) == c) {
          own.push_back(static_cast<Eigen::Index>(row));
        }
      }
      out.push_back(projection(own, Eigen::all));
    }
    return out;
  }

  const Stacked& stacked_;
  NoiseLevels floor_;
  std::vector<std::size_t> used_;
  std::vector<std::vector<Eigen::MatrixXd>> rows_;  ///< a pose, a used channel: rows_of
  std::vector<Eigen::MatrixXd> weighted_;           ///< W_c C, a used channel
  std::vector<Candidate> candidates_;
};

/// How well the best of all candidates does on nothing but noise, `draws` times.
Eigen::VectorXd best_by_chance(const EvidenceOf& evidence, const Stacked& stacked,
                               const ScanOptions& options) {
  constexpr Eigen::Index kBatch = 128;
  RandomNormal random(options.seed);
  Eigen::VectorXd best(options.draws);
  for (Eigen::Index begin = 0; begin < options.draws; begin += kBatch) {
    const Eigen::Index count = std::min<Eigen::Index>(kBatch, options.draws - begin);
    Eigen::MatrixXd noise(stacked.residual.size(), count);
    for (double& v : noise.reshaped()) v = random();
    noise -= stacked.nuisance_q * (stacked.nuisance_q.transpose() * noise);
    best.segment(begin, count) = evidence(noise).colwise().maxCoeff();
  }
  return best;
}

/// Size in typical sizes whose evidence would reach 3 on average.
double detectable_size(const EvidenceOf::Candidate& a) {
  // A unit vector of size x typical gives S of x times the mean information on average.
  const double mean = a.information.trace() / static_cast<double>(a.size);
  if (!(mean > 1e-12)) return kNaN;
  const double gain = 0.5 * mean * mean / (mean + 1.0);
  return std::sqrt((3.0 + a.occam) / (gain * static_cast<double>(a.size)));
}

}  // namespace

std::vector<CandidateScore> scan(const DiagnosisModel& model, const Candidates& candidates,
                                 const ScanOptions& options) {
  const DiagnosisSystem system = linearise(model, candidates);
  std::vector<CandidateScore> scores;
  if (!system.valid || candidates.empty()) return scores;
  const Stacked stacked = stack(system);
  const int n = model.robot.cable_count();
  NoiseLevels floor{};
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    floor[c] = model.floor[c] / model.noise[c];  // NaN of groups without readings: not asked for
  }
  const EvidenceOf evidence(system, stacked, floor);
  std::vector<Eigen::VectorXd> values;
  const Eigen::VectorXd log_evidence = evidence(stacked.residual, &values);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const EvidenceOf::Candidate& a = evidence.candidates()[k];
    CandidateScore score;
    score.effect = candidates[k];
    score.log_evidence = log_evidence[static_cast<Eigen::Index>(k)];
    const EffectValues typical = candidates[k]->typical(n);
    Eigen::VectorXd scale(a.size);
    for (Eigen::Index j = 0; j < a.size; ++j) scale[j] = typical[j % typical.size()];
    score.values = values[k].cwiseProduct(scale);
    const Eigen::MatrixXd spread = a.llt.solve(Eigen::MatrixXd::Identity(a.size, a.size));
    score.deviation = spread.diagonal().cwiseSqrt().cwiseProduct(scale);
    score.visible = a.information.trace() > static_cast<double>(a.size);
    score.detectable = detectable_size(a);
    scores.push_back(std::move(score));
  }
  std::stable_sort(scores.begin(), scores.end(),
                   [](const auto& a, const auto& b) { return a.log_evidence > b.log_evidence; });
  if (options.draws < 1) return scores;

  const Eigen::VectorXd chance = best_by_chance(evidence, stacked, options);
  for (CandidateScore& score : scores) {
    const auto as_good = (chance.array() >= score.log_evidence).count();
    score.p_value = (1.0 + static_cast<double>(as_good)) / (1.0 + options.draws);
  }
  return scores;
}

bool beyond_chance(const CandidateScore& score, std::size_t candidates, int draws) {
  // On noise alone a Bayes factor is 1 on average, so that it exceeds e^E with probability e^-E at
  // most (Markov), and one of K does with K e^-E.
  return score.log_evidence > kFarAbove + std::log(static_cast<double>(candidates) * (1.0 + draws));
}

std::vector<double> imitation(const DiagnosisModel& model, const CandidateScore& winner,
                              const Candidates& candidates) {
  Candidates all = candidates;
  all.push_back(winner.effect);
  const DiagnosisSystem system = linearise(model, all);
  std::vector<double> shares(candidates.size(), 0.0);
  if (!system.valid) return shares;
  const Stacked stacked = stack(system);
  const int n = model.robot.cable_count();
  const int base = system.layout.nuisance();
  const EffectValues typical = winner.effect->typical(n);
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
    const Eigen::VectorXd estimate = posterior.llt().solve(columns.transpose() * signature);
    shares[k] = 1.0 - (signature - columns * estimate).squaredNorm() / total;
  }
  return shares;
}

}  // namespace cdprcal
