// SPDX-License-Identifier: Apache-2.0
#include "planning/exchange.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "math/dense/cholesky.h"
#include "math/dense/products.h"
#include "problem/pose_node.h"

namespace truetriad {
namespace {

// A guard: sweeps end by kLeastGain.
constexpr int kMostExchangeSweeps = 30;
// An exchange must gain this share of what the pose it replaces is worth: less is rounding, and
// would let sweeps go round for ever.
constexpr double kLeastGain = 1e-6;
// Candidates that are tried by one product: so many that it is worth it, so few that it stays in
// the cache.
constexpr std::size_t kCandidatesAtOnce = 64;

}  // namespace

Candidates::Candidates(const std::vector<InformationRows>& poses) {
  first_.push_back(0);
  for (const InformationRows& rows : poses) first_.push_back(first_.back() + rows.rows());
  stacked_.resize(first_.back(), poses.empty() ? 0 : poses.front().cols());
  for (std::size_t c = 0; c < poses.size(); ++c) {
    stacked_.middleRows(first_[c], poses[c].rows()) = poses[c];
  }
}

double DesignCost(const Eigen::MatrixXd& information, const Eigen::MatrixXd& weights) {
  const Cholesky factor(information);
  if (weights.size() > 0) return factor.Solve(weights).trace();
  return -factor.LogDeterminant();
}

Vacancy::Vacancy(const Eigen::MatrixXd& information, const Eigen::MatrixXd& weights)
    : covariance_(Cholesky(information).Inverse()) {
  if (weights.size() > 0) weighted_ = Times(Times(covariance_, weights), covariance_);
}

double Vacancy::Gain(const InformationRows& rows) const { return Best(Candidates({rows})).gain; }

Vacancy::Choice Vacancy::Best(const Candidates& candidates) const {
  using Small =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoseRows, kMaxPoseRows>;
  Eigen::MatrixXd by_covariance;
  Eigen::MatrixXd by_weighted;
  Choice best;
  std::size_t begin = 0;
  while (begin < candidates.size()) {
    const std::size_t end = std::min(begin + kCandidatesAtOnce, candidates.size());
    const Eigen::Index first = candidates.first(begin);
    const auto batch = candidates.stacked().middleRows(first, candidates.first(end) - first);
    by_covariance.noalias() = batch * covariance_;
    if (weighted_.size() > 0) by_weighted.noalias() = batch * weighted_;
    for (std::size_t c = begin; c < end; ++c) {
      const auto rows = candidates.rows(c);
      const Eigen::Index at = candidates.first(c) - first;
      Small sum = by_covariance.middleRows(at, rows.rows()) * rows.transpose();
      sum.diagonal().array() += 1.0;
      const Eigen::LLT<Small> factor(sum);
      double gain = 0.0;
      if (weighted_.size() > 0) {
        const Small weighted = by_weighted.middleRows(at, rows.rows()) * rows.transpose();
        gain = factor.solve(weighted).trace();
      } else {
        gain = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
      }
      // Equals differ by rounding: the first of them, so that every machine picks the same.
      if (gain > best.gain * (1.0 + kLeastGain)) best = {c, gain};
    }
    begin = end;
  }
  return best;
}

Eigen::MatrixXd DesignInformation(const Eigen::MatrixXd& base,
                                  const Candidates& candidates,
                                  const Design& design) {
  Eigen::MatrixXd information = base;
  for (const std::size_t c : design) {
    information.noalias() += candidates.rows(c).transpose() * candidates.rows(c);
  }
  return information;
}

Design GreedyDesign(const Eigen::MatrixXd& base,
                    const Candidates& candidates,
                    const Eigen::MatrixXd& weights,
                    std::size_t count) {
  Design design;
  Eigen::MatrixXd information = base;
  while (design.size() < count) {
    const std::size_t best = Vacancy(information, weights).Best(candidates).candidate;
    information.noalias() += candidates.rows(best).transpose() * candidates.rows(best);
    design.push_back(best);
  }
  return design;
}

void ExchangeUntilSettled(const Eigen::MatrixXd& base,
                          const Candidates& candidates,
                          const Eigen::MatrixXd& weights,
                          Design* design) {
  bool improved = true;
  for (int sweep = 0; improved && sweep < kMostExchangeSweeps; ++sweep) {
    improved = false;
    for (std::size_t i = 0; i < design->size(); ++i) {
      // Summed anew: taking a pose out of a sum leaves rounding where it was the only one.
      Design others = *design;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const Vacancy vacancy(DesignInformation(base, candidates, others), weights);
      const Vacancy::Choice best = vacancy.Best(candidates);
      if (best.gain > vacancy.Gain(candidates.rows((*design)[i])) * (1.0 + kLeastGain)) {
        (*design)[i] = best.candidate;
        improved = true;
      }
    }
  }
}

}  // namespace truetriad
