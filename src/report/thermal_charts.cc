// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "report/charts.h"
#include "report/content.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

namespace truetriad {
namespace {

std::vector<SweepWindow> WindowsOf(const Calibration& calibration, Triad triad) {
  std::vector<SweepWindow> windows;
  for (const SweepWindow& window : calibration.quality.sweep.windows) {
    if (window.triad == triad) windows.push_back(window);
  }
  return windows;
}

std::string AxisTitle(Triad triad, int axis) { return TriadTitle(triad) + ' ' + AxisLetter(axis); }

/// 40 columns over the range of temperature; 11 rows, one per tenth of the range of rates and ends.
constexpr int kColumns = 40, kRows = 11;

/// The bias of an axis over temperature (columns) and rate of temperature (rows, highest first).
class BiasSurface {
 public:
  BiasSurface(const std::vector<SweepWindow>& windows, const TriadCalibration& sensor, int axis)
      : degc_{sensor.thermal->range_degc[0], sensor.thermal->range_degc[1]} {
    for (const SweepWindow& window : windows) rates_.Add(window.rate_degcps);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        if (!WasReached(windows, column, row)) continue;
        const double bias =
            ModelAtTemperature(sensor.model, *sensor.thermal, Degc(column), Rate(row)).bias[axis];
        cells_.push_back({column, row, bias});
        values_.Add(bias);
      }
    }
  }

  /// The length of a frame's side, including its padding, in which `cells` cells touch each other.
  static double Reach(int cells) { return (1.0 + 2.0 * kLayout.room) * kLayout.cell * (cells - 1); }

  const Range& values() const { return values_; }
  double middle() const { return 0.5 * (values_.low + values_.high); }

  void Draw(const std::string& title, const std::string& unit, Svg* svg) const {
    const Frame::Box box{.width = Reach(kColumns), .height = Reach(kRows)};
    Frame frame(*svg, box, degc_, rates_);
    svg->Rectangle(box.left, box.top, box.width, box.height, "track");
    frame.Draw(title, "°C; up: °C/s");
    // All cells of a shade are one path, since a page has thousands of cells.
    constexpr int kShades = 20;  // On each side of the middle; more shades could not be told apart.
    std::map<int, Points> shades;
    for (const auto& [column, row, bias] : cells_) {
      const double share = 2.0 * (bias - middle()) / values_.span();
      shades[static_cast<int>(std::lround(kShades * share))].emplace_back(
          frame.X(Degc(column)) - 0.5 * kLayout.cell, frame.Y(Rate(row)) - 0.5 * kLayout.cell);
    }
    for (const auto& [shade, corners] : shades) {
      const double share = static_cast<double>(shade) / kShades;
      svg->Cells(corners,
                 kLayout.cell,
                 share < 0.0 ? "minus" : "plus",
                 (std::abs(shade) + 1.0) / (kShades + 1.0),  // Opacity 0 means not reached.
                 "about " + Significant(middle() + 0.5 * share * values_.span(), 4) + " " + unit);
    }
  }

 private:
  struct Cell {
    int column, row;
    double bias;
  };

  double Degc(int column) const { return degc_.low + degc_.span() * column / (kColumns - 1.0); }
  double Rate(int row) const { return rates_.high - rates_.span() * row / (kRows - 1.0); }

  /// A cell is drawn only if a window of the sweep lies within 1/20 of the temperature range and
  /// 1/8 of the range of rates.
  bool WasReached(const std::vector<SweepWindow>& windows, int column, int row) const {
    return std::any_of(windows.begin(), windows.end(), [&](const SweepWindow& window) {
      return std::abs(window.degc - Degc(column)) < degc_.span() / 20.0 &&
             std::abs(window.rate_degcps - Rate(row)) < rates_.span() / 8.0;
    });
  }

  Range degc_, rates_, values_;
  std::vector<Cell> cells_;
};

/// The bias of one axis that the temperature terms give at constant temperature.
class BiasCurve {
 public:
  BiasCurve(const Calibration& calibration, Triad triad, int axis)
      : sensor_(*calibration.sensors[triad]),
        covariance_(calibration.covariance),
        name_(TriadName(triad)),
        axis_(axis) {}

  double Value(double degc) const {
    return ModelAtTemperature(sensor_.model, *sensor_.thermal, degc, 0.0).bias[axis_];
  }

  double Sigma(double degc) const {
    const ThermalTerms& thermal = *sensor_.thermal;
    const std::string axis(1, AxisLetter(axis_));
    Derivatives terms = {{name_ + ".bias." + axis, 1.0}};
    for (std::size_t i = 1; i <= thermal.bias.size(); ++i) {
      terms.emplace_back(name_ + ".thermal.bias." + std::to_string(i) + "." + axis,
                         std::pow(degc - thermal.reference_degc, static_cast<double>(i)));
    }
    return SigmaOf(covariance_, terms).value_or(0.0);
  }

 private:
  const TriadCalibration& sensor_;
  const NamedCovariance& covariance_;
  std::string name_;
  int axis_ = 0;
};

}  // namespace

Drawing SweepFitDrawing(const Calibration& calibration, Triad triad, int axis) {
  if (!calibration.sensors[triad]) return {};
  const std::string unit = DisplayUnit(calibration.sensors[triad]->input_unit);
  const std::string name = AxisTitle(triad, axis);
  // Heating and cooling branches are drawn separately.
  const Series warming{Series::Kind::kDots, "dots warming"},
      cooling{Series::Kind::kDots, "dots cooling"};
  Panel left{name + ", bias, " + unit,
             "°C",
             {{.kind = Series::Kind::kBand}, warming, cooling, {.style = "fit"}}};
  Panel right{"residual, " + unit, "min", {warming, cooling}};
  for (const SweepWindow& window : WindowsOf(calibration, triad)) {
    const double fit = window.fit_raw[axis], read = window.bias_raw[axis];
    const std::size_t branch = window.rate_degcps < 0.0 ? 1 : 0;
    left.series[0].Add(window.degc, fit, 2.0 * window.fit_sigma_raw[axis]);
    left.series[1 + branch].Add(window.degc, read);
    left.series[3].Add(window.degc, fit);
    right.series[branch].Add(window.time_s / 60.0, read - fit);
  }
  return {Chart(name + ": bias and fit", {left, right}),
          "Left: windows (dots; orange: warming, blue: cooling) and the fit (line) with ±2σ "
          "(shaded) against the thermometer. Right: residual over time."};
}

bool FollowsThePast(const Calibration& calibration, Triad triad, int axis) {
  constexpr double kLongLag = 0.02;  // Share of the sweep: less than a column (1/40).
  const std::vector<SweepWindow> windows = WindowsOf(calibration, triad);
  const auto& sensor = calibration.sensors[triad];
  if (windows.empty() || !sensor || !sensor->thermal) return false;
  const double limit_s = kLongLag * (windows.back().time_s - windows.front().time_s);
  const ThermalTerms& thermal = *sensor->thermal;
  const auto is_long = [&](const std::optional<Eigen::Vector3d>& lag_s) {
    return lag_s && (*lag_s)[axis] > limit_s;
  };
  return is_long(thermal.element_lag_s) || is_long(thermal.rate_lag_s);
}

Drawing SweepSurfaceDrawing(const Calibration& calibration, Triad triad, int axis) {
  const std::vector<SweepWindow> windows = WindowsOf(calibration, triad);
  const auto& sensor = calibration.sensors[triad];
  const bool has_rates = sensor && sensor->thermal && sensor->thermal->rate.any();
  if (windows.empty() || !has_rates || FollowsThePast(calibration, triad, axis)) return {};
  const BiasSurface surface(windows, *sensor, axis);
  const std::string unit = DisplayUnit(sensor->input_unit);
  const std::string name = AxisTitle(triad, axis);
  Svg svg(kLayout.width,
          kLayout.top + BiasSurface::Reach(kRows) + kLayout.bottom,
          name + ": bias over temperature and rate");
  surface.Draw(name + ", bias over temperature and rate: orange " +
                   Significant(surface.values().low, 3) + ", pale " +
                   Significant(surface.middle(), 3) + ", blue " +
                   Significant(surface.values().high, 3) + " " + unit,
               unit,
               &svg);
  return {svg.Finish(),
          "Bias from the thermal terms at the temperatures and rates that the sweep covered."};
}

std::vector<TemperatureSetting> SettingsOf(const Calibration& calibration, Triad triad) {
  std::vector<TemperatureSetting> settings;
  if (!calibration.sensors[triad] || !calibration.sensors[triad]->thermal) return settings;
  for (const TemperatureSetting& setting : calibration.quality.rests.temperature_settings) {
    if (setting.triad == triad) settings.push_back(setting);
  }
  return settings;
}

Drawing SoakDrawing(const Calibration& calibration, Triad triad, int axis) {
  const std::vector<TemperatureSetting> settings = SettingsOf(calibration, triad);
  if (settings.size() < 2) return {};
  constexpr int kCurve = 80;  // 80 points make the curve look smooth.
  const BiasCurve curve(calibration, triad, axis);
  const std::string name = AxisTitle(triad, axis);
  const Series band{Series::Kind::kBand}, line{Series::Kind::kLine, "fit"},
      dots{Series::Kind::kDots, "dots"};
  Panel left{name + ", bias, " + DisplayUnit(calibration.sensors[triad]->input_unit),
             "°C",
             {band, line, dots}};
  Panel right{"residual", "°C", {band, line, {Series::Kind::kBars}, dots}};
  const Eigen::Vector2d& span = calibration.sensors[triad]->thermal->range_degc;
  for (int i = 0; i <= kCurve; ++i) {
    const double degc = span[0] + (span[1] - span[0]) * i / kCurve;
    const double bias = curve.Value(degc), reach = 2.0 * curve.Sigma(degc);
    left.series[0].Add(degc, bias, reach), left.series[1].Add(degc, bias);
    right.series[0].Add(degc, 0.0, reach), right.series[1].Add(degc, 0.0);
  }
  for (const TemperatureSetting& setting : settings) {
    const double difference = setting.beyond_terms_raw[axis];
    left.series[2].Add(setting.degc, setting.bias_raw[axis]);
    right.series[2].Add(setting.degc, difference, 2.0 * setting.bias_sigma_raw[axis]);
    right.series[3].Add(setting.degc, difference);
  }
  return {Chart(name + ": bias over temperature", {left, right}),
          "Left: bias from the poses at each temperature alone (dots) and from the thermal terms "
          "(line, ±2σ shaded). Right: the difference of both, ±2σ."};
}

}  // namespace truetriad
