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

// ±2σ about the fit, stretch by stretch over which the temperature rises or falls.
void DrawFitBand(const std::vector<SweepWindow>& windows, int axis, Frame* frame) {
  std::vector<std::pair<double, double>> upper, lower;
  double direction = 0.0;
  for (const SweepWindow& window : windows) {
    const double fit = window.fit_raw[axis], sigma = window.fit_sigma_raw[axis];
    if (!upper.empty()) {
      const double step = window.degc - upper.back().first;
      if (step * direction < 0.0) {
        frame->DrawBetween(upper, lower);
        upper = {upper.back()}, lower = {lower.back()};
      }
      if (step != 0.0) direction = step;
    }
    upper.emplace_back(window.degc, fit + 2.0 * sigma);
    lower.emplace_back(window.degc, fit - 2.0 * sigma);
  }
  frame->DrawBetween(upper, lower);
}

// White at 0, red above, blue below.
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
  // What warms and what cools, apart.
  std::array<std::vector<std::pair<double, double>>, 2> dots, rest;
  std::vector<std::pair<double, double>> line;
  for (const SweepWindow& window : windows) {
    const double fit = window.fit_raw[axis], sigma = window.fit_sigma_raw[axis];
    const double read = window.bias_raw[axis], minutes = window.time_s / 60.0;
    degc.Add(window.degc), time.Add(minutes), residual.Add(read - fit);
    for (const double value : {read, fit + 2.0 * sigma, fit - 2.0 * sigma}) bias.Add(value);
    const std::size_t branch = window.rate_degcps < 0.0 ? 1 : 0;
    dots[branch].emplace_back(window.degc, read);
    rest[branch].emplace_back(minutes, read - fit);
    line.emplace_back(window.degc, fit);
  }
  Svg svg(760.0, 260.0, name + ": bias and fit");
  Frame left(svg, {}, degc, bias);
  left.Draw(name + ", bias, " + unit, "°C");
  DrawFitBand(windows, axis, &left);
  Frame right(svg, {446.0}, time, residual);
  right.Draw("residual, " + unit, "min");
  for (const std::size_t branch : {0U, 1U}) {
    const std::string_view style = branch == 0 ? "dots warming" : "dots cooling";
    if (!dots[branch].empty()) left.DrawDots(dots[branch], style);
    if (!rest[branch].empty()) right.DrawDots(rest[branch], style);
  }
  left.DrawLine(line, "fit");
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
