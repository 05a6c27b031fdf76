// SPDX-License-Identifier: Apache-2.0
#include "report/heading_chart.h"

#include <cmath>
#include <utility>
#include <vector>

#include "model/heading_error.h"
#include "report/chart_frame.h"
#include "report/svg.h"
#include "truetriad/base/units.h"

namespace truetriad {

std::string HeadingChart(const Calibration& calibration) {
  constexpr int kHeadings = 72;
  if (!calibration.IsUsable()) return "";
  std::vector<HeadingError> errors = HeadingErrors(calibration, kHeadings);
  if (errors.empty()) return "";
  // The circle is closed.
  errors.push_back(errors.front());
  errors.back().heading_rad = 360.0 / kDegPerRad;
  std::vector<std::pair<double, double>> raw, upper, lower;
  Range headings, raw_range, sigma_range;
  for (const HeadingError& error : errors) {
    const double heading = kDegPerRad * error.heading_rad;
    headings.Add(heading);
    upper.emplace_back(heading, 2.0 * kDegPerRad * error.sigma_rad);
    lower.emplace_back(heading, -upper.back().second);
    sigma_range.Add(upper.back().second), sigma_range.Add(lower.back().second);
    if (!error.raw_rad) continue;
    raw.emplace_back(heading, kDegPerRad * *error.raw_rad);
    raw_range.Add(raw.back().second);
  }
  Svg svg(760.0, 260.0, "Heading error round the compass");
  if (!raw.empty()) {
    raw_range.Add(0.0);
    Frame frame(svg, {}, headings, raw_range);
    frame.Draw("raw heading, error, °", "heading, °");
    // A reading that has turned past 180° goes on at the other side.
    std::vector<std::pair<double, double>> stretch;
    for (const auto& point : raw) {
      if (!stretch.empty() && std::abs(point.second - stretch.back().second) > 180.0) {
        frame.DrawLine(stretch, "line");
        stretch.clear();
      }
      stretch.push_back(point);
    }
    frame.DrawLine(stretch, "line");
  }
  Frame frame(svg, {raw.empty() ? 66.0 : 446.0, 28.0, 290.0, 190.0}, headings, sigma_range);
  frame.DrawBetween(upper, lower);
  frame.Draw("corrected heading, ±2σ, °", "heading, °");
  return svg.Finish();
}

}  // namespace truetriad
