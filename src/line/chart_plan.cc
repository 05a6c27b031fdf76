// SPDX-License-Identifier: Apache-2.0
#include "line/chart_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Core>
#include <boost/math/special_functions/legendre.hpp>
#include <glog/logging.h>

#include "math/dense/lu.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The number of Gauss points. The kernel is a normal density with σ = λ in an interval that is
// about 6 sqrt(λ / 2) long. σ is at least twice the distance of the points, so run lengths up to
// 10^6 have eight correct digits. The number is even, so that no point is at 0.
int EwmaPoints(double lambda) { return 10 + 2 * static_cast<int>(7.0 / std::sqrt(lambda)); }
// Relative accuracy of limits. A run length is about 10 times less accurate.
constexpr double kLimitAccuracy = 1e-7;

struct Quadrature {
  VectorXd points, weights;
};

// Gauss-Legendre quadrature on -1...1.
Quadrature GaussLegendre(int count) {
  Quadrature rule{VectorXd(count), VectorXd(count)};
  Index at = 0;
  for (const double zero : boost::math::legendre_p_zeros<double>(count)) {
    const double slope = boost::math::legendre_p_prime(count, zero);
    for (const double point : {-zero, zero}) {
      rule.points[at] = point;
      rule.weights[at++] = 2.0 / ((1.0 - point * point) * slope * slope);
    }
  }
  return rule;
}

}  // namespace

double EwmaRunLength(double lambda, double width, double shift) {
  CHECK(lambda >= 0.01 && lambda <= 1.0) << "smoothing constant " << lambda;
  // Probability density, at `to`, of the EWMA's next value after the value `from`.
  const auto density = [&](double from, double to) {
    const double x = (to - (1.0 - lambda) * from) / lambda - shift;
    return std::exp(-0.5 * x * x) / (lambda * std::sqrt(2.0 * std::numbers::pi));
  };
  const double limit = width * std::sqrt(lambda / (2.0 - lambda));
  const Quadrature rule = GaussLegendre(EwmaPoints(lambda));
  const VectorXd points = limit * rule.points, weights = limit * rule.weights;
  const Index count = points.size();
  // Run lengths of EWMAs that start at the points: run = 1 + K W run (K: densities, W: weights).
  MatrixXd system = MatrixXd::Identity(count, count);
  for (Index row = 0; row < count; ++row) {
    for (Index col = 0; col < count; ++col) {
      system(row, col) -= density(points[row], points[col]) * weights[col];
    }
  }
  const VectorXd run = SolveByLu(system, VectorXd::Ones(count));
  double run_length = 1.0;
  for (Index k = 0; k < count; ++k) run_length += weights[k] * density(0.0, points[k]) * run[k];
  return run_length;
}

double EwmaWidth(double lambda, double run_length) {
  // The width is below `high`: single values exceed `high` once in two run lengths, and the EWMA
  // exceeds it less often.
  double low = 0.5, high = -NormalQuantile(0.25 / run_length);
  while (high - low > kLimitAccuracy * high) {
    const double middle = 0.5 * (low + high);
    (EwmaRunLength(lambda, middle) < run_length ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double C4(double n) {
  return std::sqrt(2.0 / (n - 1.0)) * std::exp(std::lgamma(0.5 * n) - std::lgamma(0.5 * (n - 1.0)));
}

double PredictiveWidth(double width, double dof) {
  return -StudentQuantile(NormalCdf(-width), dof);
}

double HotellingLimit(int dimension, double probability, double count, bool own) {
  const double p = dimension;
  if (!own) {
    return p * (count - 1.0) / (count - p) * FisherUpperQuantile(probability, p, count - p);
  }
  // The limit is (n - 1) times a beta(p / 2, (n - p - 1) / 2) quantile, computed by Fisher's F.
  const double rest = count - p - 1.0;
  const double f = p / rest * FisherUpperQuantile(probability, p, rest);
  return (count - 1.0) * f / (1.0 + f);
}

ChartPlan::ChartPlan(const ChartOptions& wanted, std::size_t charts) : options(wanted) {
  CHECK_GT(options.run_length_units, 1.0);
  const double sum = std::accumulate(options.shares.begin(), options.shares.end(), 0.0);
  // If shares were rounded to a few digits, their sum may slightly exceed 1.
  CHECK(sum > 0.0 && sum < 1.0 + 1e-6) << "shares sum to " << sum;
  for (const ChartKind kind : kChartKinds) {
    const auto place = static_cast<std::size_t>(kind);
    CHECK_GE(options.shares[place], 0.0) << NameOf(kind);
    // All rates sum to at most 1 / run length, so all charts together give no more false alarms,
    // however correlated they are.
    rates[place] = options.shares[place] / options.run_length_units;
    if (kind == ChartKind::kEwma) {
      rates[place] /= static_cast<double>(std::max<std::size_t>(charts, 1));
    }
  }
  if (Has(ChartKind::kEwma)) {
    ewma_width = EwmaWidth(options.ewma_lambda, 1.0 / RateOf(ChartKind::kEwma));
  }
}

ChartWriter::ChartWriter(ChartKind kind, int parameter, std::size_t count, int most)
    : skipped_(count - std::min(count, static_cast<std::size_t>(std::max(most, 0)))) {
  chart.kind = kind;
  chart.parameter = parameter;
  chart.points.reserve(count - skipped_);
}

void ChartWriter::Add(const ChartPoint& point, bool alarm) {
  if (skipped_ > 0) {
    --skipped_;
  } else {
    chart.points.push_back(point);
  }
  if (alarm && !in_alarm_) {
    ChartAlarm begun;
    begun.kind = chart.kind;
    begun.parameter = chart.parameter;
    begun.unit = point.unit;
    begun.value = point.value;
    begun.limit = point.value < point.lower ? point.lower : point.upper;
    alarms_.push_back(begun);
  }
  if (alarm) alarms_.back().last_unit = point.unit;
  in_alarm_ = alarm;
}

void ChartWriter::MoveTo(StationCharts* station) {
  station->charts.push_back(std::move(chart));
  station->alarms.insert(station->alarms.end(), alarms_.begin(), alarms_.end());
}

void AddNote(const std::string& sentence, StationCharts* station) {
  station->note += (station->note.empty() ? "" : "; ") + sentence;
}

}  // namespace truetriad::line
