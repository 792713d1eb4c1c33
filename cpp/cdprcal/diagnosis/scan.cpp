#include "cdprcal/diagnosis/scan.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <numeric>

#include "cdprcal/acquisition/synthetic.hpp"

namespace cdprcal {
namespace {

/// All reduced rows stacked, projected off the nuisance unknowns.
struct Stacked {
  Eigen::VectorXd residual;      ///< M r
  Eigen::MatrixXd candidates;    ///< M C
  Eigen::MatrixXd nuisance_q;    ///< orthonormal basis of what M removes
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

/// Whitened sums of squares a channel of residuals given in reduced rows.
NoiseLevels squares(const DiagnosisSystem& system, const Stacked& stacked,
                    const Eigen::VectorXd& reduced) {
  NoiseLevels out{};
  for (std::size_t i = 0; i < system.poses.size(); ++i) {
    const PoseSystem& pose = system.poses[i];
    const Eigen::VectorXd rows =
        pose.projection *
        reduced.segment(stacked.begin[i], stacked.begin[i + 1] - stacked.begin[i]);
    for (Eigen::Index row = 0; row < rows.size(); ++row) {
      out[static_cast<std::size_t>(pose.channel[static_cast<std::size_t>(row)])] +=
          rows[row] * rows[row];
    }
  }
  return out;
}

/// −log of the likelihood maximised over each channel's noise, which its floor bounds from below.
/// `floor` in units of the present noise.
double profile(const NoiseLevels& squares, const NoiseLevels& freedom, const NoiseLevels& floor) {
  double total = 0.0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (freedom[c] < 1.0) continue;
    const double level = std::max(std::sqrt(squares[c] / freedom[c]), floor[c]);
    total += freedom[c] * std::log(level) + 0.5 * squares[c] / (level * level);
  }
  return total;
}

struct CandidateAlgebra {
  Eigen::Index begin, size;
  Eigen::LLT<Eigen::MatrixXd> llt;   ///< of I + 1
  Eigen::MatrixXd information;       ///< I
  double occam = 0.0;                ///< ½ log|I + 1|
};

}  // namespace

std::vector<CandidateScore> scan(const DiagnosisModel& model, const Candidates& candidates,
                                 const ScanOptions& options) {
  const DiagnosisSystem system = linearise(model, candidates);
  std::vector<CandidateScore> scores;
  if (!system.valid || candidates.empty()) return scores;
  const Stacked stacked = stack(system);
  const int n = model.robot.cable_count();
  NoiseLevels floor{};
  for (std::size_t c = 0; c < kChannels; ++c) floor[c] = model.floor[c] / model.noise[c];

  std::vector<CandidateAlgebra> algebra;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    CandidateAlgebra a;
    a.begin = system.layout.candidate_begin[k] - system.layout.nuisance();
    a.size = system.layout.candidate_size[k];
    const auto columns = stacked.candidates.middleCols(a.begin, a.size);
    a.information = columns.transpose() * columns;
    const Eigen::MatrixXd posterior =
        a.information + Eigen::MatrixXd::Identity(a.size, a.size);
    a.llt.compute(posterior);
    const Eigen::MatrixXd root = a.llt.matrixL();
    a.occam = root.diagonal().array().log().sum();
    algebra.push_back(std::move(a));
  }
  const auto evidence = [&](const CandidateAlgebra& a, const Eigen::VectorXd& residual,
                            double before, Eigen::VectorXd* values) {
    const auto columns = stacked.candidates.middleCols(a.begin, a.size);
    const Eigen::VectorXd estimate = -a.llt.solve(columns.transpose() * residual);
    if (values != nullptr) *values = estimate;
    const NoiseLevels after = squares(system, stacked, residual + columns * estimate);
    return before - profile(after, stacked.sums.freedom, floor) - 0.5 * estimate.squaredNorm() -
           a.occam;
  };

  const double before =
      profile(squares(system, stacked, stacked.residual), stacked.sums.freedom, floor);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const CandidateAlgebra& a = algebra[k];
    CandidateScore score;
    score.effect = candidates[k];
    Eigen::VectorXd values;
    score.log_evidence = evidence(a, stacked.residual, before, &values);
    const EffectValues typical = candidates[k]->typical(n);
    Eigen::VectorXd scale(a.size);
    for (Eigen::Index j = 0; j < a.size; ++j) scale[j] = typical[j % typical.size()];
    score.values = values.cwiseProduct(scale);
    const Eigen::MatrixXd covariance =
        a.llt.solve(Eigen::MatrixXd::Identity(a.size, a.size));
    score.deviation = covariance.diagonal().cwiseSqrt().cwiseProduct(scale);
    // A unit vector of size x typical gives S of x times the mean information on average.
    const double mean_information = a.information.trace() / static_cast<double>(a.size);
    score.visible = mean_information > 1.0;
    if (mean_information > 1e-12) {
      const double gain = 0.5 * mean_information * mean_information / (mean_information + 1.0);
      score.detectable =
          std::sqrt((3.0 + a.occam) / (gain * static_cast<double>(a.size)));
    }
    scores.push_back(std::move(score));
  }

  // How well the best of all candidates does on nothing but noise.
  RandomNormal random(options.seed);
  std::vector<double> best_by_chance;
  Eigen::VectorXd noise(stacked.residual.size());
  for (int draw = 0; draw < options.draws; ++draw) {
    for (double& v : noise) v = random();
    const Eigen::VectorXd residual =
        noise - stacked.nuisance_q * (stacked.nuisance_q.transpose() * noise);
    const double chance_before =
        profile(squares(system, stacked, residual), stacked.sums.freedom, floor);
    double best = -1e300;
    for (const CandidateAlgebra& a : algebra) {
      best = std::max(best, evidence(a, residual, chance_before, nullptr));
    }
    best_by_chance.push_back(best);
  }
  for (CandidateScore& score : scores) {
    const auto as_good =
        std::count_if(best_by_chance.begin(), best_by_chance.end(),
                      [&](double best) { return best >= score.log_evidence; });
    score.p_value = (1.0 + static_cast<double>(as_good)) / (1.0 + options.draws);
  }
  std::stable_sort(scores.begin(), scores.end(), [](const auto& a, const auto& b) {
    return a.log_evidence > b.log_evidence;
  });
  return scores;
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
