// SPDX-License-Identifier: Apache-2.0
#include "line/chart_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glog/logging.h>

#include "line/run_length.h"
#include "math/distributions.h"

namespace truetriad::line {

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
  // (n - 1) times a beta(p / 2, (n - p - 1) / 2), which is a function of Fisher's F.
  const double rest = count - p - 1.0;
  const double f = p / rest * FisherUpperQuantile(probability, p, rest);
  return (count - 1.0) * f / (1.0 + f);
}

ChartPlan::ChartPlan(const ChartOptions& wanted, std::size_t charts) : options(wanted) {
  CHECK_GT(options.run_length_units, 1.0);
  const double sum = std::accumulate(options.shares.begin(), options.shares.end(), 0.0);
  // A sum of shares that are rounded to a few digits.
  CHECK(sum > 0.0 && sum < 1.0 + 1e-6) << "shares sum to " << sum;
  for (const ChartKind kind : kChartKinds) {
    const auto place = static_cast<std::size_t>(kind);
    CHECK_GE(options.shares[place], 0.0) << NameOf(kind);
    // The rates of all charts add up to at most 1 / run length however they depend on each other.
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
