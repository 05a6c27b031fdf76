// SPDX-License-Identifier: Apache-2.0
#include "verdict/term_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "math/dense/cholesky.h"
#include "math/dense/eigenvalues.h"
#include "math/dense/products.h"

namespace truetriad {
namespace {

// Of what an entry would be known to if all else were known: less is not seen apart from the rest.
constexpr double kSeenApart = 1e-6;
// A direction of a term that shows is off by so many σ.
constexpr double kShownSigmas = 3.0;

}  // namespace

std::optional<Conditional> ConditionOn(const Eigen::MatrixXd& information,
                                       const Eigen::VectorXd& gradient,
                                       const std::vector<Eigen::Index>& base,
                                       const std::vector<Eigen::Index>& extra) {
  const Eigen::VectorXd scale = information.diagonal()(base).cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::MatrixXd across = information(base, extra);
  const Cholesky factor(scale.asDiagonal() * information(base, base) * scale.asDiagonal());
  if (!factor.is_positive()) return std::nullopt;
  Conditional given;
  given.gain = scale.asDiagonal() * factor.Solve(scale.asDiagonal() * across);
  given.information = information(extra, extra) - TransposeTimes(across, given.gain);
  given.gradient = gradient(extra) - given.gain.transpose() * gradient(base);
  given.full = information.diagonal()(extra);
  return given;
}

TermSearch::TermSearch(Conditional given)
    : given_(std::move(given)), information_(given_.information), gradient_(given_.gradient) {}

void TermSearch::AllowFor(const std::vector<Eigen::Index>& at, const Eigen::VectorXd& sigmas) {
  if (at.empty()) return;
  const auto count = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd entries = Eigen::MatrixXd::Zero(information_.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i) entries(at[static_cast<std::size_t>(i)], i) = 1.0;
  const Eigen::MatrixXd prior = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  allowed_ = at;
  allowed_covariance_ = Cholesky(information_(at, at) + prior).Inverse();
  allowed_sizes_ = SetAside(entries, prior);
  Append(entries, prior);
}

std::vector<Eigen::Index> TermSearch::AllowedOf(const std::vector<Eigen::Index>& at) const {
  std::vector<Eigen::Index> places;
  for (const Eigen::Index entry : at) {
    const auto found = std::find(allowed_.begin(), allowed_.end(), entry);
    if (found == allowed_.end()) return {};
    places.push_back(found - allowed_.begin());
  }
  return places;
}

Eigen::MatrixXd TermSearch::CovarianceBy(const std::vector<Eigen::Index>& at) const {
  const std::vector<Eigen::Index> places = AllowedOf(at);
  const Eigen::MatrixXd gain = given_.gain(Eigen::all, at);
  const Eigen::VectorXd sizes = allowed_sizes_(places);
  const Eigen::MatrixXd unknown = allowed_covariance_(places, places) + sizes * sizes.transpose();
  return Times(gain, unknown * gain.transpose());
}

ScoreTest TermSearch::Test(const std::vector<Eigen::Index>& at) const {
  const std::vector<Eigen::Index> seen = SeenOf(at);
  ScoreTest test;
  if (seen.empty()) return test;
  const Cholesky factor(information_(seen, seen));
  if (!factor.is_positive()) return test;
  test.chi2 = gradient_(seen).dot(factor.SolveVector(gradient_(seen)));
  test.rank = static_cast<int>(seen.size());
  return test;
}

std::optional<double> TermSearch::KappaOf(const std::vector<Eigen::Index>& at,
                                          const SharedLayout& layout,
                                          const Eigen::ArrayXd& variances) const {
  const auto largest = [&](const Eigen::MatrixXd& moved) {
    return std::sqrt((variances > 0.0)
                         .select(moved.rowwise().squaredNorm().array() / variances, 0.0)
                         .maxCoeff());
  };
  if (const std::vector<Eigen::Index> places = AllowedOf(at); !places.empty()) {
    const Cholesky left(allowed_covariance_(places, places));
    return largest(layout.basis * given_.gain(Eigen::all, at) * left.Root());
  }
  const std::vector<Eigen::Index> seen = SeenOf(at);
  if (seen.empty()) return std::nullopt;
  const Cholesky factor(information_(seen, seen));
  if (!factor.is_positive()) return std::nullopt;
  return largest(layout.basis * given_.gain(Eigen::all, seen) *
                 factor.Root().transpose().inverse());
}

double TermSearch::SizeOf(const std::vector<Eigen::Index>& at) const {
  const std::vector<Eigen::Index> seen = SeenOf(at);
  return Cholesky(information_(seen, seen)).SolveVector(gradient_(seen)).norm();
}

Eigen::VectorXd TermSearch::SetAside(const Eigen::MatrixXd& directions,
                                     const Eigen::MatrixXd& prior) {
  const Eigen::MatrixXd across = Times(information_, directions);
  const Cholesky factor(TransposeTimes(directions, across) + prior);
  const Eigen::VectorXd sizes = factor.SolveVector(directions.transpose() * gradient_);
  gradient_ -= across * sizes;
  information_ -= Times(across, factor.Solve(across.transpose()));
  return sizes;
}

Eigen::VectorXd TermSearch::TakeIn(const std::vector<Eigen::Index>& at) {
  const Directions directions = DirectionsOf(SeenOf(at));
  const Eigen::MatrixXd& shown = directions.shown;
  const Eigen::VectorXd step = SetAside(shown, Eigen::MatrixXd::Zero(shown.cols(), shown.cols()));
  // Those that do not show are as large as those that do, as far as the readings allow it: axes
  // of one sensor are of one make.
  const double size2 = (shown * step).squaredNorm() / static_cast<double>(shown.cols());
  Append(shown, Eigen::MatrixXd::Zero(shown.cols(), shown.cols()));
  Append(directions.hidden, TransposeTimes(directions.hidden, directions.hidden) / size2);
  return given_.gain * (shown * step);
}

Eigen::MatrixXd TermSearch::Covariance() const {
  const Eigen::MatrixXd gain = Times(given_.gain, taken_);
  const Cholesky factor(TransposedCongruence(taken_, given_.information) + prior_);
  const Eigen::VectorXd moved = gain * factor.SolveVector(taken_.transpose() * given_.gradient);
  return moved * moved.transpose() + Times(gain, factor.Solve(gain.transpose()));
}

std::vector<Eigen::Index> TermSearch::SeenOf(const std::vector<Eigen::Index>& at) const {
  std::vector<Eigen::Index> seen;
  for (const Eigen::Index i : at) {
    if (information_(i, i) > kSeenApart * given_.full[i]) seen.push_back(i);
  }
  return seen;
}

// Of some entries, each scaled by what it would be known to: shown are those that are off by so
// many σ, the clearest in any case.
TermSearch::Directions TermSearch::DirectionsOf(const std::vector<Eigen::Index>& at) const {
  const Eigen::VectorXd scale = given_.full(at).cwiseSqrt().cwiseInverse();
  const SymmetricEigen spectrum =
      EigenOfSymmetric(scale.asDiagonal() * information_(at, at) * scale.asDiagonal());
  const Eigen::VectorXd along =
      TransposeTimesVector(spectrum.vectors, scale.cwiseProduct(gradient_(at)));
  const Eigen::VectorXd z2 = along.cwiseAbs2().cwiseQuotient(spectrum.values.cwiseMax(1e-300));
  const double least = std::min(kShownSigmas * kShownSigmas, z2.maxCoeff());
  Directions directions{Eigen::MatrixXd(information_.rows(), 0),
                        Eigen::MatrixXd(information_.rows(), 0)};
  for (Eigen::Index i = 0; i < z2.size(); ++i) {
    Eigen::MatrixXd& into = z2[i] < least ? directions.hidden : directions.shown;
    into.conservativeResize(Eigen::NoChange, into.cols() + 1);
    into.rightCols(1).setZero();
    for (std::size_t k = 0; k < at.size(); ++k) {
      const auto entry = static_cast<Eigen::Index>(k);
      into(at[k], into.cols() - 1) = scale[entry] * spectrum.vectors(entry, i);
    }
  }
  return directions;
}

void TermSearch::Append(const Eigen::MatrixXd& directions, const Eigen::MatrixXd& prior) {
  const Eigen::Index before = taken_.cols(), more = directions.cols();
  taken_.conservativeResize(information_.rows(), before + more);
  taken_.rightCols(more) = directions;
  prior_.conservativeResizeLike(Eigen::MatrixXd::Zero(before + more, before + more));
  prior_.bottomRightCorner(more, more) = prior;
}

}  // namespace truetriad
