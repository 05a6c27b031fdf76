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
  constexpr double kPlain = 1e5;
  constexpr int kMostDecimals = 5;
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  if (decimals <= kMostDecimals && std::abs(value) < kPlain) return Fixed(value, decimals);
  if (std::abs(value) < 1e-9 * step) return "0";
  const double digits = std::log10(std::abs(value) / step);
  return Significant(value, std::clamp(static_cast<int>(digits) + 1, 1, 9));
}

}  // namespace

Range Range::Padded() const {
  constexpr double kRoom = 0.04;
  // A single value stands in the middle.
  const double room = high > low ? kRoom * (high - low) : std::max(0.1 * std::abs(high), 1e-12);
  return {low - room, high + room};
}

std::vector<double> Ticks(const Range& range) {
  std::vector<double> ticks;
  const double step = StepOf(range.span());
  if (!std::isfinite(step) || !(step > 0.0)) return ticks;
  const double first = std::ceil(range.low / step - 1e-9);
  for (double i = first; i * step <= range.high + 1e-9 * step && i < first + 12.0; i += 1.0) {
    ticks.push_back(i * step);
  }
  return ticks;
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
  constexpr double kLineHeight = 11.0;
  const double step_y = StepOf(y_.span());
  const double apart = step_y / y_.span() * box_.height;
  const auto every = static_cast<std::int64_t>(std::ceil(kLineHeight / apart));
  for (const double y : has_y ? Ticks(y_) : std::vector<double>()) {
    const auto place = static_cast<std::int64_t>(std::llround(y / step_y));
    svg_.Line(box_.left, Y(y), box_.left + box_.width, Y(y), place == 0 ? "zero" : "grid");
    if (place % every == 0) svg_.Text(box_.left - 5.0, Y(y) + 4.0, TickText(y, step_y), "end");
  }
  if (!x_title.empty()) {
    const double step_x = StepOf(x_.span());
    constexpr double kLetter = 6.5;
    double right = -std::numeric_limits<double>::infinity();
    for (const double x : Ticks(x_)) {
      svg_.Line(X(x), bottom, X(x), bottom + 4.0, "zero");
      const std::string text = TickText(x, step_x);
      const double half = 0.5 * kLetter * static_cast<double>(text.size());
      if (X(x) - half < right) continue;
      right = X(x) + half + kLetter;
      svg_.Text(X(x), bottom + 16.0, text, "middle");
    }
    svg_.Text(box_.left + box_.width, bottom + 30.0, x_title, "end");
  }
  svg_.Text(box_.left, box_.top - 8.0, title, "start title");
}

void Frame::DrawBand(double half_width) {
  svg_.Rectangle(box_.left, Y(half_width), box_.width, Y(-half_width) - Y(half_width), "band");
}

void Frame::DrawLine(const std::vector<std::pair<double, double>>& points, std::string_view style) {
  std::vector<std::pair<double, double>> line;
  line.reserve(points.size());
  for (const auto& [x, y] : points) line.emplace_back(X(x), Y(y));
  svg_.Polyline(line, style);
}

void Frame::DrawBetween(const std::vector<std::pair<double, double>>& upper,
                        const std::vector<std::pair<double, double>>& lower) {
  std::vector<std::pair<double, double>> outline = upper;
  outline.insert(outline.end(), lower.rbegin(), lower.rend());
  DrawLine(outline, "band");
}

void Frame::DrawDots(const std::vector<std::pair<double, double>>& points, std::string_view style) {
  std::vector<std::pair<double, double>> dots;
  dots.reserve(points.size());
  for (const auto& [x, y] : points) dots.emplace_back(X(x), Y(y));
  svg_.Dots(dots, style);
}

void Frame::DrawErrorBar(double x, double y, double half_length) {
  svg_.Line(X(x), Y(y - half_length), X(x), Y(y + half_length), "bar");
}

}  // namespace truetriad
