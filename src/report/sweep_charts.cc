// SPDX-License-Identifier: Apache-2.0
#include "report/sweep_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>
#include <vector>

#include "report/chart_frame.h"
#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/thermal.h"

namespace truetriad {

namespace {

std::vector<SweepWindow> WindowsOf(const Calibration& calibration, Triad triad) {
  std::vector<SweepWindow> windows;
  for (const SweepWindow& window : calibration.quality.sweep.windows) {
    if (window.triad == triad) windows.push_back(window);
  }
  return windows;
}

// White at 0, blue above, red below.
std::string Colour(double share) {
  const double size = std::min(std::abs(share), 1.0);
  const std::array<int, 3> full =
      share < 0.0 ? std::array{0x1f, 0x5f, 0xbf} : std::array{0xc6, 0x28, 0x28};
  char text[8];
  std::array<int, 3> mixed;
  for (std::size_t i = 0; i < 3; ++i) {
    mixed[i] = static_cast<int>(std::lround(255.0 + size * (full[i] - 255)));
  }
  std::snprintf(text, sizeof text, "#%02x%02x%02x", mixed[0], mixed[1], mixed[2]);
  return text;
}

}  // namespace

std::string SweepFitChart(const Calibration& calibration, Triad triad, int axis) {
  std::vector<SweepWindow> windows = WindowsOf(calibration, triad);
  if (windows.empty() || !calibration.sensors[triad]) return "";
  const std::string unit = DisplayUnit(calibration.sensors[triad]->input_unit);
  const std::string name = TriadTitle(triad) + " " + AxisLetter(axis);
  Range degc, bias, time, residual;
  for (const SweepWindow& window : windows) {
    degc.Add(window.degc), time.Add(window.time_s / 60.0);
    bias.Add(window.bias_raw[axis]), bias.Add(window.fit_raw[axis]);
    residual.Add(window.bias_raw[axis] - window.fit_raw[axis]);
  }
  Svg svg(760.0, 260.0, name + ": bias and fit");
  Frame left(svg, 66.0, 290.0, degc, bias);
  left.Draw(name + ", bias, " + unit, "°C");
  // The fit in the order of time, in stretches between which no window is missing.
  std::vector<std::pair<double, double>> line, upper, lower;
  for (const SweepWindow& window : windows) {
    const double fit = window.fit_raw[axis], sigma = window.fit_sigma_raw[axis];
    line.emplace_back(left.X(window.degc), left.Y(fit));
    upper.emplace_back(left.X(window.degc), left.Y(fit + 2.0 * sigma));
    lower.emplace_back(left.X(window.degc), left.Y(fit - 2.0 * sigma));
  }
  for (std::size_t i = 1; i < line.size(); ++i) {
    svg.Polyline({upper[i - 1], upper[i], lower[i], lower[i - 1]}, "band");
  }
  for (const SweepWindow& window : windows) {
    svg.Circle(left.X(window.degc), left.Y(window.bias_raw[axis]), 1.6, "dot");
  }
  svg.Polyline(line, "fit");
  Frame right(svg, 446.0, 290.0, time, residual);
  right.Draw("residual", "min");
  for (const SweepWindow& window : windows) {
    svg.Circle(right.X(window.time_s / 60.0),
               right.Y(window.bias_raw[axis] - window.fit_raw[axis]),
               1.4,
               "after");
  }
  return svg.Finish();
}

bool FollowsThePast(const Calibration& calibration, Triad triad, int axis) {
  constexpr double kLongLag = 0.02;  // of the sweep
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

std::string SweepSurfaceChart(const Calibration& calibration, Triad triad, int axis) {
  const std::vector<SweepWindow> windows = WindowsOf(calibration, triad);
  const auto& sensor = calibration.sensors[triad];
  if (windows.empty() || !sensor || !sensor->thermal) return "";
  const ThermalTerms& thermal = *sensor->thermal;
  if (!thermal.rate.any()) return "";
  if (FollowsThePast(calibration, triad, axis)) return "";
  Range rates;
  for (const SweepWindow& window : windows) rates.Add(window.rate_degcps);
  constexpr int kColumns = 44, kRows = 11;
  constexpr double kSize = 15.0, kLeft = 66.0, kTop = 28.0;
  const auto value_at = [&](int column, int row) {
    const double degc = thermal.range_degc[0] +
                        (thermal.range_degc[1] - thermal.range_degc[0]) * column / (kColumns - 1.0);
    const double rate = rates.high - rates.span() * row / (kRows - 1.0);
    return std::array{
        degc, rate, ModelAtTemperature(sensor->model, thermal, degc, rate).bias[axis]};
  };
  // Nothing is said of what the sweep did not pass.
  std::array<std::array<bool, kColumns>, kRows> reached{};
  for (const SweepWindow& window : windows) {
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const auto [degc, rate, value] = value_at(column, row);
        const double off_degc =
            (window.degc - degc) / (thermal.range_degc[1] - thermal.range_degc[0]);
        const double off_rate = (window.rate_degcps - rate) / rates.span();
        if (std::abs(off_degc) < 1.0 / 20.0 && std::abs(off_rate) < 1.0 / 8.0) {
          reached[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = true;
        }
      }
    }
  }
  const auto is_reached = [&reached](int column, int row) {
    return reached[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  };
  Range values;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      if (is_reached(column, row)) values.Add(value_at(column, row)[2]);
    }
  }
  const double middle = 0.5 * (values.low + values.high);
  const std::string unit = DisplayUnit(sensor->input_unit);
  const std::string name = TriadTitle(triad) + " " + AxisLetter(axis);
  Svg svg(760.0, kTop + kRows * kSize + 40.0, name + ": bias over temperature and rate");
  svg.Text(kLeft,
           kTop - 8.0,
           name + ", bias over temperature and rate: blue " + Significant(values.low, 3) +
               ", white " + Significant(middle, 3) + ", red " + Significant(values.high, 3) + " " +
               unit,
           "start title");
  svg.Rectangle(kLeft, kTop, kColumns * kSize, kRows * kSize, "track");
  // All cells of a shade at once: a page has thousands.
  constexpr int kShades = 20;  // on each side of the middle
  std::map<int, std::vector<std::pair<double, double>>> cells;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      if (!is_reached(column, row)) continue;
      const double share = 2.0 * (value_at(column, row)[2] - middle) / values.span();
      cells[static_cast<int>(std::lround(kShades * share))].emplace_back(kLeft + column * kSize,
                                                                         kTop + row * kSize);
    }
  }
  for (const auto& [shade, corners] : cells) {
    const double share = static_cast<double>(shade) / kShades;
    svg.Cells(corners,
              kSize,
              Colour(share),
              "about " + Significant(middle + 0.5 * share * values.span(), 4) + " " + unit);
  }
  for (const int row : {0, kRows / 2, kRows - 1}) {
    svg.Text(
        kLeft - 5.0, kTop + (row + 0.5) * kSize + 4.0, Significant(value_at(0, row)[1], 2), "end");
  }
  for (const int column : {0, kColumns / 2, kColumns - 1}) {
    svg.Text(kLeft + (column + 0.5) * kSize,
             kTop + kRows * kSize + 15.0,
             Fixed(value_at(column, 0)[0], 1),
             "middle");
  }
  svg.Text(kLeft + kColumns * kSize, kTop + kRows * kSize + 30.0, "°C; down: °C/s", "end");
  return svg.Finish();
}

}  // namespace truetriad
