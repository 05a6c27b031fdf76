// SPDX-License-Identifier: Apache-2.0
#include "line/chart_plan.h"

#include <algorithm>
#include <numeric>

#include <glog/logging.h>

#include "line/run_length.h"
#include "math/distributions.h"

namespace truetriad::line {
namespace {

bool IsOfOneParameter(ChartKind kind) {
  return kind != ChartKind::kHotelling && kind != ChartKind::kMewma;
}

// Exceeded on either side with `probability`.
double WidthOf(double probability) { return -NormalQuantile(0.5 * probability); }

}  // namespace

ChartPlan::ChartPlan(const ChartOptions& wanted, std::size_t charts) : options(wanted) {
  CHECK_GT(options.run_length_units, 1.0);
  CHECK_GE(options.subgroup_units, 2);
  const double sum = std::accumulate(options.shares.begin(), options.shares.end(), 0.0);
  // A sum of shares that are rounded to a few digits.
  CHECK(sum > 0.0 && sum < 1.0 + 1e-6) << "shares sum to " << sum;
  for (const ChartKind kind : kChartKinds) {
    const auto place = static_cast<std::size_t>(kind);
    CHECK_GE(options.shares[place], 0.0) << NameOf(kind);
    // The rates of all charts add up to at most 1 / run length however they depend on each other.
    rates[place] = options.shares[place] / options.run_length_units;
    if (IsOfOneParameter(kind))
      rates[place] /= static_cast<double>(std::max<std::size_t>(charts, 1));
  }
  if (Has(ChartKind::kEwma)) {
    ewma_width = EwmaWidth(options.ewma_lambda, 1.0 / RateOf(ChartKind::kEwma));
  }
  if (Has(ChartKind::kIndividuals)) single_width = WidthOf(RateOf(ChartKind::kIndividuals));
  if (Has(ChartKind::kMovingRange)) range_width = WidthOf(RateOf(ChartKind::kMovingRange));
}

double ChartPlan::MewmaLimitOf(int dimension) {
  const auto [at, is_new] = mewma_limits_.try_emplace(dimension);
  if (is_new) {
    at->second = MewmaLimit(dimension, options.mewma_lambda, 1.0 / RateOf(ChartKind::kMewma));
  }
  return at->second;
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
