// SPDX-License-Identifier: Apache-2.0
#include "report/chart_frame.h"

#include <cmath>
#include <cstdint>

#include "report/format.h"

namespace truetriad {
namespace {

/// The largest round step that divides a span into four or more.
double StepOf(double span) {
  const double most = span / 4.0;
  const double decade = std::pow(10.0, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * decade <= most) return factor * decade;
  }
  return decade;
}

/// With as many digits as neighbours of that step need to differ.
std::string TickText(double value, double step) {
  // What is longer than the room on the left is written with an exponent.
  constexpr double kPlain = 1e5;
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  if (decimals <= 5 && std::abs(value) < kPlain) return Fixed(value, decimals);
  if (std::abs(value) < 1e-9 * step) return "0";
  const double digits = std::log10(std::abs(value) / step);
  return Significant(value, std::clamp(static_cast<int>(digits) + 1, 1, 9));
}

/// Round numbers within the range, five to twelve; fewer where neighbours are one number.
std::vector<double> Ticks(const Range& range) {
  std::vector<double> ticks;
  const double step = StepOf(range.span());
  if (!std::isfinite(step) || !(step > 0.0)) return ticks;
  const double first = std::ceil(range.low / step - 1e-9);
  for (int i = 0; i < 12 && (first + i) * step <= range.high + 1e-9 * step; ++i) {
    const double tick = (first + i) * step;
    if (ticks.empty() || tick > ticks.back()) ticks.push_back(tick);
  }
  return ticks;
}

/// At most kMostPoints: of each run of neighbours the smallest and the largest stay, so that the
/// extremes, which are what one looks for, are never lost.
Points Thinned(const Points& points) {
  if (points.size() <= kMostPoints) return points;
  const std::size_t runs = kMostPoints / 2;
  Points kept;
  for (std::size_t run = 0; run < runs; ++run) {
    const auto at = [&](std::size_t i) {
      return points.begin() + static_cast<std::ptrdiff_t>(i * points.size() / runs);
    };
    const auto [low, high] = std::minmax_element(
        at(run), at(run + 1), [](const auto& a, const auto& b) { return a.second < b.second; });
    kept.push_back(*std::min(low, high));
    if (low != high) kept.push_back(*std::max(low, high));
  }
  return kept;
}

}  // namespace

Range Range::Padded() const {
  // A single value stands in the middle.
  const double room =
      high > low ? kLayout.room * (high - low) : std::max(0.1 * std::abs(high), 1e-12);
  return {low - room, high + room};
}

Frame::Frame(Svg& svg, const Box& box, const Range& x, const Range& y)
    : svg_(svg), box_(box), x_(x.Padded()), y_(y.Padded()) {}

double Frame::X(double value) const {
  return box_.left + std::clamp((value - x_.low) / x_.span(), 0.0, 1.0) * box_.width;
}

double Frame::Y(double value) const {
  return box_.top + std::clamp((y_.high - value) / y_.span(), 0.0, 1.0) * box_.height;
}

void Frame::Draw(const std::string& title, const std::string& x_title, bool has_y) {
  const double bottom = box_.top + box_.height;
  svg_.Rectangle(box_.left, box_.top, box_.width, box_.height, "frame");
  // Low frames have no room for a line of text at each: then every second, third, ... from zero.
  const double step_y = StepOf(y_.span());
  const double apart = step_y / y_.span() * box_.height;
  const auto every = static_cast<std::int64_t>(std::ceil(kLayout.line / apart));
  for (const double y : has_y ? Ticks(y_) : std::vector<double>()) {
    const auto place = static_cast<std::int64_t>(std::llround(y / step_y));
    svg_.Line(box_.left, Y(y), box_.left + box_.width, Y(y), place == 0 ? "zero" : "grid");
    if (place % every == 0) svg_.Text(box_.left - 5.0, Y(y) + 4.0, TickText(y, step_y), "end");
  }
  if (!x_title.empty()) {
    const double step_x = StepOf(x_.span());
    double right = -std::numeric_limits<double>::infinity();
    for (const double x : Ticks(x_)) {
      svg_.Line(X(x), bottom, X(x), bottom + 4.0, "zero");
      const std::string text = TickText(x, step_x);
      const double half = 0.5 * kLayout.letter * static_cast<double>(text.size());
      if (X(x) - half < right) continue;
      right = X(x) + half + kLayout.letter;
      svg_.Text(X(x), bottom + 16.0, text, "middle");
    }
    svg_.Text(box_.left + box_.width, bottom + 30.0, x_title, "end");
  }
  svg_.Text(box_.left, box_.top - 8.0, title, "start title");
}

Points Frame::Places(const Points& points) const {
  Points places;
  places.reserve(points.size());
  for (const auto& [x, y] : points) places.emplace_back(X(x), Y(y));
  return places;
}

void Frame::DrawLine(const Points& points, std::string_view style) {
  svg_.Polyline(Places(points), style);
}

void Frame::DrawBand(const Points& high, const Points& low) {
  Points outline = high;
  outline.insert(outline.end(), low.rbegin(), low.rend());
  DrawLine(outline, "band");
}

void Frame::DrawDots(const Points& points, std::string_view style) {
  svg_.Dots(Places(Thinned(points)), style);
}

void Frame::DrawFar(double x, double y, double value, bool is_left) {
  const double aside = is_left ? -kLayout.letter : kLayout.letter;
  svg_.Text(X(x) + aside, Y(y) + 4.0, Significant(value, 3), is_left ? "far end" : "far start");
}

namespace {

/// Up to where x goes on in the direction that it has at `begin`; the turning point belongs to the
/// next stretch, too.
std::size_t EndOfStretch(const Points& points, std::size_t begin) {
  double direction = 0.0;
  for (std::size_t i = begin + 1; i < points.size(); ++i) {
    const double step = points[i].first - points[i - 1].first;
    if (step * direction < 0.0) return i;
    if (step != 0.0) direction = step;
  }
  return points.size();
}

void DrawBands(const Series& series, Frame* frame) {
  for (std::size_t begin = 0, end = 0; begin + 1 < series.points.size(); begin = end - 1) {
    end = EndOfStretch(series.points, begin);
    Points high, low;
    for (std::size_t i = begin; i < end; ++i) {
      const auto& [x, y] = series.points[i];
      high.emplace_back(x, y + series.half[i]);
      low.emplace_back(x, y - series.half[i]);
    }
    frame->DrawBand(high, low);
  }
}

void DrawSeries(const Series& series, Frame* frame) {
  if (series.points.empty()) return;
  if (series.kind == Series::Kind::kLine) frame->DrawLine(series.points, series.style);
  if (series.kind == Series::Kind::kDots) frame->DrawDots(series.points, series.style);
  if (series.kind != Series::Kind::kBars) return;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const auto& [x, y] = series.points[i];
    frame->DrawLine({{x, y - series.half[i]}, {x, y + series.half[i]}}, "bar");
  }
}

void DrawPanel(const Panel& panel, const Frame::Box& box, Svg* svg) {
  Range x_range, y_range = panel.y;
  for (const Series& series : panel.series) {
    for (std::size_t i = 0; i < series.points.size(); ++i) {
      const auto& [x, y] = series.points[i];
      const double half = series.half.empty() ? 0.0 : series.half[i];
      x_range.Add(x), y_range.Add(y + half), y_range.Add(y - half);
    }
  }
  Frame frame(*svg, box, x_range, y_range);
  for (const Series& series : panel.series) {
    if (series.kind == Series::Kind::kBand) DrawBands(series, &frame);
  }
  frame.Draw(panel.title, panel.x_title);
  for (const Series& series : panel.series) DrawSeries(series, &frame);
}

}  // namespace

std::string Chart(std::string_view label, const std::vector<Panel>& panels) {
  Svg svg(kLayout.width, kLayout.top + kLayout.panel_height + kLayout.bottom, label);
  Frame::Box box;
  for (const Panel& panel : panels) {
    const bool has_points =
        std::any_of(panel.series.begin(), panel.series.end(), [](const Series& series) {
          return !series.points.empty();
        });
    if (!has_points) continue;
    DrawPanel(panel, box, &svg);
    box.left += box.width + kLayout.between;
  }
  return box.left > kLayout.left ? svg.Finish() : "";
}

}  // namespace truetriad
