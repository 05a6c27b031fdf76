// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_theory.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>

namespace truetriad {
namespace {

constexpr std::array<double, 3> kSecondDifference = {1.0, -2.0, 1.0};
constexpr auto kQuantisationRow = static_cast<int>(NoiseTerm::kQuantisation);
constexpr auto kR = static_cast<int>(NoiseTerm::kRamp);
/// Factors further apart than this share so little of the spectrum that their estimates are
/// independent: for white noise the correlation is below 0.03.
constexpr std::int64_t kWidestRatio = 24;
/// Lags a factor: the covariances are smooth on the scale of the smaller factor. Finer where a
/// factor meets itself, since degrees of freedom come from there.
constexpr std::int64_t kLagsPerFactor = 8;
constexpr std::int64_t kLagsPerFactorItself = 16;

/// Generalised autocovariances of the summed reading; the delta of quantisation is treated apart.
NoiseStrengths Autocovariance(double lag) {
  const double t = std::abs(lag);
  NoiseStrengths g = NoiseStrengths::Zero();
  if (t == 0.0) return g;
  g[static_cast<int>(NoiseTerm::kWhite)] = -t / 2.0;
  g[static_cast<int>(NoiseTerm::kFlicker)] = t * t * std::log(t) / (2.0 * std::numbers::pi);
  g[static_cast<int>(NoiseTerm::kWalk)] = (t * t * t - t) / 12.0;
  return g;
}

/// E[d_m(t) d_n(t + lag)] / (2 m n), without quantisation: at m = n and lag 0 the Allan variance.
NoiseStrengths Smooth(std::int64_t m, std::int64_t n, std::int64_t lag) {
  NoiseStrengths sum = NoiseStrengths::Zero();
  for (std::int64_t a = -1; a <= 1; ++a) {
    for (std::int64_t b = -1; b <= 1; ++b) {
      sum += kSecondDifference[static_cast<std::size_t>(a + 1)] *
             kSecondDifference[static_cast<std::size_t>(b + 1)] *
             Autocovariance(static_cast<double>(lag + b * n - a * m));
    }
  }
  return sum / (2.0 * static_cast<double>(m) * static_cast<double>(n));
}

/// The same of quantisation alone: not zero only at few lags.
std::map<std::int64_t, double> Quantisation(std::int64_t m, std::int64_t n) {
  std::map<std::int64_t, double> at_lag;
  for (std::int64_t a = -1; a <= 1; ++a) {
    for (std::int64_t b = -1; b <= 1; ++b) {
      at_lag[a * m - b * n] += kSecondDifference[static_cast<std::size_t>(a + 1)] *
                               kSecondDifference[static_cast<std::size_t>(b + 1)] /
                               (2.0 * static_cast<double>(m) * static_cast<double>(n));
    }
  }
  return at_lag;
}

/// Integral of the product of two triangles of area one and half-widths m <= n that begin together.
double TriangleOverlap(double m, double n) {
  // The integrand is made of two parabolas; the midpoint rule leaves a per mille.
  constexpr int kOverlapSteps = 32;
  double sum = 0.0;
  for (int i = 0; i < kOverlapSteps; ++i) {
    const double u = 2.0 * m * (i + 0.5) / kOverlapSteps;
    sum += (m - std::abs(u - m)) / (m * m) * (n - std::abs(u - n)) / (n * n);
  }
  return sum * 2.0 * m / kOverlapSteps;
}

/// Covariance of the mean second differences of factors m <= n in a stretch, over m^2 n^2, times
/// the second differences of both: that of the reading's change from one end to the other, each end
/// averaged over a triangle. Flicker to leading order; quantisation has next to none.
NoiseStrengths ChangeOverStretch(double m, double n, double span) {
  NoiseStrengths covariance = NoiseStrengths::Zero();
  covariance[static_cast<int>(NoiseTerm::kWhite)] = 2.0 * TriangleOverlap(m, n);
  covariance[static_cast<int>(NoiseTerm::kFlicker)] =
      (1.0 + std::log(1.0 + span / n)) / std::numbers::pi;
  covariance[static_cast<int>(NoiseTerm::kWalk)] = span;
  return covariance;
}

Eigen::Matrix<double, kNoiseTerms, kNoiseTerms> CovarianceForm(const AllanFactor& fine,
                                                               const AllanFactor& coarse) {
  const auto stretches = static_cast<double>(coarse.stretches);
  const double coarse_terms = static_cast<double>(coarse.terms) / stretches;
  // Centres of the second differences of a stretch cover its length less two factors.
  const double coarse_span = (coarse_terms - 1.0) * static_cast<double>(coarse.stride);
  const double fine_span = coarse_span + 2.0 * static_cast<double>(coarse.m - fine.m);
  const auto pairs_at = [&](std::int64_t lag) {
    const double overlap = (fine_span + coarse_span) / 2.0 - static_cast<double>(std::abs(lag));
    return std::clamp(overlap / static_cast<double>(coarse.stride) + 1.0, 0.0, coarse_terms);
  };

  Eigen::Matrix<double, kNoiseTerms, kNoiseTerms> form =
      Eigen::Matrix<double, kNoiseTerms, kNoiseTerms>::Zero();
  const std::int64_t lags = fine.m == coarse.m ? kLagsPerFactorItself : kLagsPerFactor;
  const std::int64_t step = std::max<std::int64_t>(fine.m / lags / fine.stride, 1) * fine.stride;
  const double lags_a_step = static_cast<double>(step) / static_cast<double>(fine.stride);
  // White noise and walk end at the sum of the factors; flicker falls to 2 % at twice that.
  for (std::int64_t lag = 0; lag <= 2 * (fine.m + coarse.m); lag += step) {
    const double count = pairs_at(lag);
    if (count <= 0.0) break;
    const NoiseStrengths covariance = Smooth(fine.m, coarse.m, lag);
    form += (lag == 0 ? 1.0 : 2.0) * lags_a_step * count * covariance * covariance.transpose();
  }
  for (const auto& [lag, value] : Quantisation(fine.m, coarse.m)) {
    NoiseStrengths covariance = Smooth(fine.m, coarse.m, lag);
    form.row(kQuantisationRow) += pairs_at(lag) * value * covariance.transpose();
    form.col(kQuantisationRow) += pairs_at(lag) * value * covariance;
    form(kQuantisationRow, kQuantisationRow) += pairs_at(lag) * value * value;
  }
  form *= 2.0 * stretches / (static_cast<double>(fine.terms) * static_cast<double>(coarse.terms));

  const auto m = static_cast<double>(fine.m), n = static_cast<double>(coarse.m);
  const double starts = static_cast<double>(fine.terms * fine.stride) *
                        static_cast<double>(coarse.terms * coarse.stride);
  const NoiseStrengths with_ramp =
      0.5 * stretches * m * m * n * n / starts * ChangeOverStretch(m, n, coarse_span);
  form.row(kR) += with_ramp.transpose();
  form.col(kR) += with_ramp;
  return form;
}

}  // namespace

NoiseStrengths UnitAllanVariance(double m) {
  return {3.0 / (m * m),
          1.0 / m,
          2.0 * std::numbers::ln2 / std::numbers::pi,
          m / 3.0 + 1.0 / (6.0 * m),
          m * m / 2.0};
}

AllanCovariance::AllanCovariance(const std::vector<AllanFactor>& factors) {
  for (std::size_t i = 0; i < factors.size(); ++i) {
    diagonal_.push_back(CovarianceForm(factors[i], factors[i]));
    for (std::size_t j = i + 1; j < factors.size(); ++j) {
      if (factors[j].m > kWidestRatio * factors[i].m) break;
      pairs_.push_back({static_cast<Eigen::Index>(i),
                        static_cast<Eigen::Index>(j),
                        CovarianceForm(factors[i], factors[j])});
    }
  }
}

double AllanCovariance::Variance(Eigen::Index i, const NoiseStrengths& strengths) const {
  return strengths.dot(diagonal_[static_cast<std::size_t>(i)] * strengths);
}

Eigen::MatrixXd AllanCovariance::Matrix(Eigen::Index begin,
                                        Eigen::Index end,
                                        const NoiseStrengths& strengths) const {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(end - begin, end - begin);
  for (Eigen::Index i = begin; i < end; ++i) {
    matrix(i - begin, i - begin) = Variance(i, strengths);
  }
  for (const Pair& pair : pairs_) {
    if (pair.i < begin || pair.j >= end) continue;
    const double covariance = strengths.dot(pair.form * strengths);
    matrix(pair.i - begin, pair.j - begin) = covariance;
    matrix(pair.j - begin, pair.i - begin) = covariance;
  }
  return matrix;
}

}  // namespace truetriad
