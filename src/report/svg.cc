// SPDX-License-Identifier: Apache-2.0
#include "report/svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "base/utf8.h"
#include "report/table.h"

namespace truetriad {
namespace {

std::string Attribute(std::string_view name, std::string_view value) {
  return ' ' + std::string(name) + "=\"" + EscapeMarkup(value) + '"';
}

std::string Title(std::string_view tooltip) {
  return "<title>" + EscapeMarkup(tooltip) + "</title>";
}

std::string PoseAttribute(const Note& note) {
  return note.pose > 0 ? Attribute("data-pose", std::to_string(note.pose)) : "";
}

std::string Place(double x, double y, int decimals, char between) {
  return Fixed(x, decimals) + between + Fixed(y, decimals);
}

}  // namespace

std::string EscapeMarkup(std::string_view text) {
  // A name can hold any bytes: invalid UTF-8 and characters that reverse text are shown escaped.
  const auto is_ascii = [](char c) { return static_cast<unsigned char>(c) < 0x80; };
  std::string printable;
  if (!std::all_of(text.begin(), text.end(), is_ascii)) text = printable = Printable(text);
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr std::array<std::string_view, 5> kEntities = {
      "&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    if (const std::size_t at = kSpecial.find(c); at != std::string_view::npos) {
      escaped += kEntities[at];
    } else if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') {
      escaped += c;
    }
  }
  return escaped;
}

Svg::Svg(double width, double height, std::string_view label)
    : head_("<svg role=\"img\"" + Attribute("aria-label", label) +
            Attribute("viewBox", "0 0 " + Place(width, height, 0, ' ')) +
            Attribute("style", "--width:" + Fixed(width, 0) + "px")) {}

std::string Svg::FinishAlone(std::string_view style_sheet) const {
  return head_ + " xmlns=\"http://www.w3.org/2000/svg\">\n<style>" + std::string(style_sheet) +
         "</style>\n" + body_ + "</svg>\n";
}

void Svg::Add(std::string_view element,
              std::string_view style,
              std::initializer_list<std::pair<std::string_view, double>> numbers,
              const std::string& attributes,
              const std::string& inside) {
  body_.append("<").append(element);
  if (!style.empty()) body_ += Attribute("class", style);
  for (const auto& [name, value] : numbers) {
    body_.append(" ").append(name).append("=\"").append(Fixed(value, 1)).append("\"");
  }
  body_ += attributes;
  if (inside.empty()) {
    body_ += "/>\n";
  } else {
    body_.append(">").append(inside).append("</").append(element).append(">\n");
  }
}

void Svg::Line(double x1, double y1, double x2, double y2, std::string_view style) {
  Add("line", style, {{"x1", x1}, {"y1", y1}, {"x2", x2}, {"y2", y2}});
}

void Svg::Rectangle(
    double x, double y, double width, double height, std::string_view style, const Note& note) {
  Add("rect",
      style,
      {{"x", x}, {"y", y}, {"width", width}, {"height", height}},
      PoseAttribute(note),
      note.tooltip.empty() ? "" : Title(note.tooltip));
}

void Svg::Circle(double x, double y, double radius, std::string_view style, const Note& note) {
  Add("circle",
      style,
      {{"cx", x}, {"cy", y}, {"r", radius}},
      PoseAttribute(note),
      note.tooltip.empty() ? "" : Title(note.tooltip));
}

void Svg::Dots(const Points& points, std::string_view style) {
  if (points.empty()) return;
  std::string path;
  for (const auto& [x, y] : points) path += 'M' + Place(x, y, 1, ' ') + "h0";
  Add("path", style, {}, Attribute("d", path));
}

void Svg::Polyline(const Points& points, std::string_view style) {
  std::string list;
  for (const auto& [x, y] : points) list += (list.empty() ? "" : " ") + Place(x, y, 1, ',');
  Add("polyline", style, {}, Attribute("points", list));
}

void Svg::Zigzag(const std::vector<Span>& spans, std::string_view style) {
  const auto halves = [](double value) { return std::lround(2.0 * value); };
  std::string path;
  long at_x = 0, at_y = 0, level = 0;  // level: the horizontal distance that is not written yet
  const auto go_level = [&] {
    if (level > 0) path += 'h' + std::to_string(level);
    level = 0;
  };
  for (const Span& span : spans) {
    const long x = halves(span.x);
    long near = halves(span.low), far = halves(span.high);
    if (std::abs(near - at_y) > std::abs(far - at_y)) std::swap(near, far);
    if (path.empty()) {
      path = 'M' + std::to_string(x) + ' ' + std::to_string(near);
    } else if (near == at_y) {
      level += x - at_x;
    } else {
      go_level();
      path +=
          'l' + std::to_string(x - at_x) + (near < at_y ? "" : " ") + std::to_string(near - at_y);
    }
    if (far != near) {
      go_level();
      path += 'v' + std::to_string(far - near);
    }
    at_x = x, at_y = far;
  }
  go_level();
  Add("path", style, {}, Attribute("transform", "scale(.5)") + Attribute("d", path));
}

void Svg::Arrow(const Points::value_type& from,
                const Points::value_type& to,
                const std::string& style) {
  const auto [x1, y1] = from;
  const auto [x2, y2] = to;
  Line(x1, y1, x2, y2, style);
  const double length = std::hypot(x2 - x1, y2 - y1);
  if (length < 1.0) return;
  const double u = (x2 - x1) / length, v = (y2 - y1) / length;
  Polyline({{x2 + 3.0 * u, y2 + 3.0 * v},
            {x2 - 7.0 * u - 4.5 * v, y2 - 7.0 * v + 4.5 * u},
            {x2 - 7.0 * u + 4.5 * v, y2 - 7.0 * v - 4.5 * u},
            {x2 + 3.0 * u, y2 + 3.0 * v}},
           style + " head");
}

void Svg::Cross(double x, double y, std::string_view style) {
  constexpr double kHalf = 4.0;  // Half the width: a little more than the radius of a dot.
  Line(x - kHalf, y - kHalf, x + kHalf, y + kHalf, style);
  Line(x - kHalf, y + kHalf, x + kHalf, y - kHalf, style);
}

void Svg::Text(double x, double y, std::string_view text, std::string_view style) {
  Add("text", style, {{"x", x}, {"y", y}}, "", EscapeMarkup(text));
}

void Svg::Cells(const Points& corners,
                double size,
                std::string_view style,
                double share,
                std::string_view tooltip) {
  const std::string side = Fixed(size, 0);
  std::string path;
  for (const auto& [x, y] : corners) {
    path += 'M' + Place(x, y, 0, ' ') + 'h' + side + 'v' + side + "h-" + side + 'z';
  }
  Add("path",
      style,
      {},
      Attribute("fill-opacity", Fixed(share, 2)) + Attribute("d", path),
      Title(tooltip));
}

void Svg::RotatedText(
    double x, double y, double degrees, std::string_view text, std::string_view style) {
  Add("text",
      style,
      {},
      Attribute("transform",
                "translate(" + Place(x, y, 1, ' ') + ") rotate(" + Fixed(degrees, 0) + ')'),
      EscapeMarkup(text));
}

namespace {

/// The largest of 1, 2 and 5 times a power of ten that divides a span into four or more steps.
double StepOf(double span) {
  const double most = span / 4.0;
  const double decade = std::pow(10.0, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * decade <= most) return factor * decade;
  }
  return decade;
}

/// The number with so many digits that numbers one step apart differ.
std::string TickText(double value, double step) {
  // Larger numbers exceed the room on the left, so they are written with an exponent.
  constexpr double kPlain = 1e5;
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  if (decimals <= 5 && std::abs(value) < kPlain) return Fixed(value, decimals);
  if (std::abs(value) < 1e-9 * step) return "0";
  const double digits = std::log10(std::abs(value) / step);
  return Significant(value, std::clamp(static_cast<int>(digits) + 1, 1, 9));
}

/// The multiples of the step within the range: four to ten, or fewer if rounding makes neighbouring
/// ones equal.
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

std::string PowerOfTen(int decade) {
  if (decade >= -3 && decade <= 4) return Significant(std::pow(10.0, decade), 6);
  std::string text = "10";
  constexpr std::array<std::string_view, 10> kRaised = {
      "⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  for (const char c : std::to_string(decade)) {
    text += c == '-' ? "⁻" : kRaised[static_cast<std::size_t>(c - '0')];
  }
  return text;
}

/// Calls `draw(value, words)` for each digit of each decade of a logarithmic axis; only the first
/// digit of a decade has words.
template <typename Draw>
void EachDigit(const Range& range, const Draw& draw) {
  for (int decade = static_cast<int>(std::floor(range.low)); decade <= range.high; ++decade) {
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, decade), place = std::log10(value);
      if (place < range.low || place > range.high) continue;
      draw(value, digit == 1 ? PowerOfTen(decade) : "");
    }
  }
}

/// Thins to at most kMostPoints. Of each group of neighbours the lowest and the highest point stay,
/// so the extremes are never lost.
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
  // If all values are equal, they are drawn in the middle of the range.
  const double room =
      high > low ? kLayout.room * (high - low) : std::max(0.1 * std::abs(high), 1e-12);
  return {low - room, high + room, is_log};
}

Frame::Frame(Svg& svg, const Box& box, const Range& x, const Range& y)
    : svg_(svg), box_(box), x_(x.Padded()), y_(y.Padded()) {}

double Frame::X(double value) const {
  if (x_.is_log) value = std::log10(value);
  return box_.left + std::clamp((value - x_.low) / x_.span(), 0.0, 1.0) * box_.width;
}

double Frame::Y(double value) const {
  if (y_.is_log) value = std::log10(value);
  return box_.top + std::clamp((y_.high - value) / y_.span(), 0.0, 1.0) * box_.height;
}

void Frame::Draw(const std::string& title, const std::string& x_title, bool has_y) {
  const double bottom = box_.top + box_.height;
  svg_.Rectangle(box_.left, box_.top, box_.width, box_.height, "frame");
  if (x_.is_log) {
    DrawDecades(has_y);
  } else {
    DrawScales(!x_title.empty(), has_y);
  }
  if (!x_title.empty()) svg_.Text(box_.left + box_.width, bottom + 30.0, x_title, "end");
  svg_.Text(box_.left, box_.top - 8.0, title, "start title");
}

void Frame::DrawScales(bool has_x, bool has_y) {
  const double bottom = box_.top + box_.height;
  // In a low frame the numbers of all lines would overlap. Only every second, third, ... line from
  // zero has one.
  const double step_y = StepOf(y_.span());
  const double apart = step_y / y_.span() * box_.height;
  const auto every = static_cast<std::int64_t>(std::ceil(kLayout.line / apart));
  for (const double y : has_y ? Ticks(y_) : std::vector<double>()) {
    const auto place = static_cast<std::int64_t>(std::llround(y / step_y));
    svg_.Line(box_.left, Y(y), box_.left + box_.width, Y(y), place == 0 ? "zero" : "grid");
    if (place % every == 0) svg_.Text(box_.left - 5.0, Y(y) + 4.0, TickText(y, step_y), "end");
  }
  const double step_x = StepOf(x_.span());
  double right = -std::numeric_limits<double>::infinity();
  for (const double x : has_x ? Ticks(x_) : std::vector<double>()) {
    svg_.Line(X(x), bottom, X(x), bottom + 4.0, "zero");
    const std::string text = TickText(x, step_x);
    const double half = 0.5 * kLayout.letter * static_cast<double>(text.size());
    if (X(x) - half < right) continue;
    right = X(x) + half + kLayout.letter;
    svg_.Text(X(x), bottom + 16.0, text, "middle");
  }
}

void Frame::DrawDecades(bool has_y) {
  const double right = box_.left + box_.width, bottom = box_.top + box_.height;
  EachDigit(x_, [&](double x, const std::string& words) {
    svg_.Line(X(x), box_.top, X(x), bottom, words.empty() ? "minor" : "grid");
    if (!words.empty()) svg_.Text(X(x), bottom + 16.0, words, "middle");
  });
  EachDigit(y_, [&](double y, const std::string& words) {
    svg_.Line(box_.left, Y(y), right, Y(y), words.empty() ? "minor" : "grid");
    if (has_y && !words.empty()) svg_.Text(box_.left - 5.0, Y(y) + 4.0, words, "end");
  });
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

/// The end of the interval from `begin` in which x only rises or only falls. The point at which x
/// turns back also belongs to the next interval.
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
