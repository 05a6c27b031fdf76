// SPDX-License-Identifier: Apache-2.0
#pragma once

// The parts of which ControlCharts consists.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "line/control_chart.h"

namespace truetriad::line {

/// Mean and variance of values added one by one.
struct RunningMoments {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;  // sum of squared deviations from the mean

  void Add(double value) {
    count += 1.0;
    const double step = value - mean;
    mean += step / count;
    squares += step * (value - mean);
  }
  double Variance() const { return squares / (count - 1.0); }
};

/// c4(n), the expected standard deviation of n normal values with σ = 1. n >= 2 may be a fraction.
double C4(double n);

/// Widens a limit of `width` known σ for a σ estimated with `dof` degrees of freedom, so that
/// values exceed the limit equally often on each side: Student's quantile t_dof(1 - Φ(-width)).
double PredictiveWidth(double width, double dof);

/// Sums of the weights of the units in an exponentially weighted moving average that began at 0.
class MovingWeights {
 public:
  explicit MovingWeights(double lambda) : lambda_(lambda) {}

  /// `own`: the added unit is one of those from which the process mean is estimated.
  void Add(bool own) {
    all_ += lambda_ * (1.0 - all_);
    own_ += lambda_ * ((own ? 1.0 : 0.0) - own_);
    squares_ += lambda_ * lambda_ - lambda_ * (2.0 - lambda_) * squares_;
  }
  void Restart() { all_ = own_ = squares_ = 0.0; }

  /// Variance of (average - all_ * mean of `count` units) if each unit has variance 1. It accounts
  /// exactly for the covariance of own units with the mean, so it is never negative.
  double Variance(double count) const { return squares_ + all_ * (all_ - 2.0 * own_) / count; }

 private:
  double lambda_;
  double all_ = 0.0, own_ = 0.0, squares_ = 0.0;  // sums: weights, own units' weights, squares
};

/// The limit that T^2 = d' S^-1 d / v over `dimension` parameters exceeds with `probability`. d: a
/// unit's deviation from the centre; v: the variance of d relative to that of single units; S: the
/// covariance of `count` units. If the unit is in S (`own`), the limit is a beta quantile. For
/// later units it is Fisher's quantile, and v includes 1 / count of the centre.
double HotellingLimit(int dimension, double probability, double count, bool own);

/// The false alarm rate of each chart of a station, and the limits that follow from it.
struct ChartPlan {
  /// `charts`: the number of parameters with charts of their own.
  ChartPlan(const ChartOptions& options, std::size_t charts);

  bool Has(ChartKind kind) const { return RateOf(kind) > 0.0; }
  /// False alarms per unit of one chart of this kind.
  double RateOf(ChartKind kind) const { return rates[static_cast<std::size_t>(kind)]; }

  ChartOptions options;
  std::array<double, kChartKindCount> rates{};
  double ewma_width = 0.0;  // EWMA limit in σ of the EWMA, known process; 0: no EWMA charts.
};

/// One parameter's values at one station.
struct ParameterValues {
  int parameter = 0;
  std::vector<int> units;      // units that have a value, in order; indices in LineData::units
  std::vector<double> values;  // one for each of `units`
  std::size_t baseline = 0;    // the first `baseline` values are the baseline
  bool own = false;            // all values are the baseline: phase I
  std::vector<bool> good;      // for each baseline value: whether it is no outlier
};

/// The baseline lags the last unit by this number of units. A shift of 1 σ is found within a fifth
/// of them, before shifted units join the baseline and mask the shift (see docs/line.md).
inline constexpr std::size_t kBaselineLag = 100;
/// Limits are recomputed when the baseline has grown by 5 %.
inline constexpr double kBaselineGrowth = 1.05;

/// Builds a chart point by point.
class ChartWriter {
 public:
  /// `count` points will be added. The last `most` of them are kept.
  ChartWriter(ChartKind kind, int parameter, std::size_t count, int most);

  /// Adds a point. Adjacent points with `alarm` belong to one alarm.
  void Add(const ChartPoint& point, bool alarm);
  bool in_alarm() const { return in_alarm_; }
  /// Sets the parameter that contributes most to the alarm that has just begun.
  void SetMost(int parameter) { alarms_.back().most = parameter; }

  void MoveTo(StationCharts* station);
  Chart chart;

 private:
  std::size_t skipped_;  // points still to be dropped before those that are kept
  bool in_alarm_ = false;
  std::vector<ChartAlarm> alarms_;
};

/// Appends a sentence to station->note.
void AddNote(const std::string& sentence, StationCharts* station);

/// Adds the chart of T^2 over the parameters `shared` to the station, with its alarms, a note, and
/// the list of dependent parameters. Either all or none of `shared` have a separate baseline. Units
/// of EWMA alarms that are already in `station` stay out of the baseline.
void DrawHotelling(const LineData& data,
                   std::vector<ParameterValues> shared,
                   const ChartPlan& plan,
                   StationCharts* station);

// Average run lengths: the mean number of points up to and including the first alarm of a chart
// with the given limits, for independent normal values with σ = 1.

/// EWMA z_i = λ x_i + (1 - λ) z_(i-1), z_0 = 0, alarm where |z_i| > width * sqrt(λ / (2 - λ)).
/// `shift`: mean of x from the first value on. Nyström's solution of the integral equation of
/// Crowder (1987). If limits start narrower and widen to this width, there are more early alarms:
/// at λ = 0.1 a run length of 500 units becomes 488 ± 2.4 (40,000 charts); a longer run length
/// loses less.
double EwmaRunLength(double lambda, double width, double shift = 0.0);

/// The width with which EwmaRunLength(lambda, width) = run_length; at least 0.5.
double EwmaWidth(double lambda, double run_length);

}  // namespace truetriad::line
