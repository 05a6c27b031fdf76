// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_theory.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>

namespace truetriad {
namespace {

/// If the ratio of two factors is larger, they share so little of the spectrum that their estimates
/// count as independent: for white noise the correlation is below 0.03.
constexpr std::int64_t kWidestRatio = 24;
/// A covariance is evaluated at this many lags per smaller factor, on the scale of which it is
/// smooth. Chosen finer for the variance of one factor's estimate, which determines its degrees of
/// freedom.
constexpr std::int64_t kLagsPerFactor = 8, kLagsPerFactorItself = 16;

/// Calls `add(w_a w_b, b n - a m)` for all a and b.
template <typename Add>
void ForEachPair(std::int64_t m, std::int64_t n, const Add& add) {
  for (std::int64_t a = -1; a <= 1; ++a) {
    for (std::int64_t b = -1; b <= 1; ++b) {
      add((a == 0 ? -2.0 : 1.0) * (b == 0 ? -2.0 : 1.0), b * n - a * m);
    }
  }
}

/// Generalised autocovariances of the summed reading, without that of quantisation, a delta.
NoiseStrengths Autocovariance(double lag) {
  const double t = std::abs(lag);
  if (t == 0.0) return NoiseStrengths::Zero();
  return {
      0.0, -t / 2.0, t * t * std::log(t) / (2.0 * std::numbers::pi), (t * t * t - t) / 12.0, 0.0};
}

/// E[d_m(t) d_n(t + lag)] / (2 m n), without quantisation. At m = n and lag 0 this is the Allan
/// variance.
NoiseStrengths Smooth(std::int64_t m, std::int64_t n, std::int64_t lag) {
  NoiseStrengths sum = NoiseStrengths::Zero();
  ForEachPair(m, n, [&](double weight, std::int64_t shift) {
    sum += weight * Autocovariance(static_cast<double>(lag + shift));
  });
  return sum / (2.0 * static_cast<double>(m) * static_cast<double>(n));
}

/// Integral of the product of two triangles of area one and half-widths m <= n that begin together:
/// the wide one rises as u / n^2 until n, then falls.
double TriangleOverlap(double m, double n) {
  const double beyond = std::max(0.0, 2.0 * m - n);
  return m / (n * n) - beyond * beyond * beyond / (3.0 * m * m * n * n);
}

/// Covariance of the mean second differences of factors m <= n in a stretch, divided by m^2 n^2 and
/// multiplied by the numbers of both second differences at stride 1. It equals the covariance of
/// the reading's change from one end to the other, with each end averaged over a triangle. For
/// flicker only the leading order is computed; the contribution of quantisation is negligible.
NoiseStrengths ChangeOverStretch(double m, double n, double span) {
  return {0.0,
          2.0 * TriangleOverlap(m, n),
          (1.0 + std::log(1.0 + span / n)) / std::numbers::pi,
          span,
          0.0};
}

NoiseForm CovarianceForm(const AllanFactor& fine, const AllanFactor& coarse) {
  const auto m = static_cast<double>(fine.m), n = static_cast<double>(coarse.m);
  const auto stretches = static_cast<double>(coarse.stretches);
  const double coarse_terms = static_cast<double>(coarse.terms) / stretches;
  // Centres of the second differences of a stretch cover its length less two factors.
  const double coarse_span = (coarse_terms - 1.0) * static_cast<double>(coarse.stride);
  const double fine_span = coarse_span + 2.0 * (n - m);
  const auto pairs_at = [&](std::int64_t lag) {
    const double overlap = (fine_span + coarse_span) / 2.0 - static_cast<double>(std::abs(lag));
    return std::clamp(overlap / static_cast<double>(coarse.stride) + 1.0, 0.0, coarse_terms);
  };

  NoiseForm form = NoiseForm::Zero();
  const std::int64_t lags = fine.m == coarse.m ? kLagsPerFactorItself : kLagsPerFactor;
  const std::int64_t step = std::max<std::int64_t>(fine.m / lags / fine.stride, 1) * fine.stride;
  const double lags_a_step = static_cast<double>(step) / static_cast<double>(fine.stride);
  // The covariances of white noise and walk end at lag m + n; that of flicker has fallen to 2 % at
  // twice this lag.
  for (std::int64_t lag = 0; lag <= 2 * (fine.m + coarse.m); lag += step) {
    const double count = pairs_at(lag);
    if (count <= 0.0) break;
    const NoiseStrengths covariance = Smooth(fine.m, coarse.m, lag);
    form += (lag == 0 ? 1.0 : 2.0) * lags_a_step * count * covariance * covariance.transpose();
  }
  std::map<std::int64_t, double> quantisation;  // It differs from zero at few lags only.
  ForEachPair(fine.m, coarse.m, [&](double weight, std::int64_t shift) {
    quantisation[-shift] += weight / (2.0 * m * n);
  });
  for (const auto& [lag, value] : quantisation) {
    const NoiseStrengths covariance = Smooth(fine.m, coarse.m, lag);
    form.row(kQuantisation) += pairs_at(lag) * value * covariance.transpose();
    form.col(kQuantisation) += pairs_at(lag) * value * covariance;
    form(kQuantisation, kQuantisation) += pairs_at(lag) * value * value;
  }
  form *= 2.0 * stretches / (static_cast<double>(fine.terms) * static_cast<double>(coarse.terms));

  const double starts = static_cast<double>(fine.terms * fine.stride) *
                        static_cast<double>(coarse.terms * coarse.stride);
  const NoiseStrengths with_ramp =
      0.5 * stretches * m * m * n * n / starts * ChangeOverStretch(m, n, coarse_span);
  form.row(kRamp) += with_ramp.transpose();
  form.col(kRamp) += with_ramp;
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
  for (auto fine = factors.begin(); fine != factors.end(); ++fine) {
    std::vector<NoiseForm>& row = forms_.emplace_back();
    for (auto coarse = fine; coarse != factors.end(); ++coarse) {
      if (coarse->m > kWidestRatio * fine->m) break;
      row.push_back(CovarianceForm(*fine, *coarse));
    }
  }
}

Eigen::MatrixXd AllanCovariance::Matrix(Eigen::Index begin,
                                        Eigen::Index end,
                                        const NoiseStrengths& strengths) const {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(end - begin, end - begin);
  for (Eigen::Index i = begin; i < end; ++i) {
    const std::vector<NoiseForm>& row = forms_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = i; j < std::min(end, i + static_cast<Eigen::Index>(row.size())); ++j) {
      matrix(i - begin, j - begin) = matrix(j - begin, i - begin) =
          strengths.dot(row[static_cast<std::size_t>(j - i)] * strengths);
    }
  }
  return matrix;
}

}  // namespace truetriad
