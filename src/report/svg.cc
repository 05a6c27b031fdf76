// SPDX-License-Identifier: Apache-2.0
#include "report/svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "base/utf8.h"
#include "report/format.h"

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
  // A name can be anything: what is no UTF-8, or would turn the text behind it, is shown as such.
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
  long at_x = 0, at_y = 0, level = 0;  // Level: how far to the right with no change of height.
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

void Svg::Cross(double x, double y, std::string_view style) {
  constexpr double kHalf = 4.0;  // Of its width: a little more than a dot's.
  Line(x - kHalf, y - kHalf, x + kHalf, y + kHalf, style);
  Line(x - kHalf, y + kHalf, x + kHalf, y - kHalf, style);
}

void Svg::Text(double x, double y, std::string_view text, std::string_view style) {
  Add("text", style, {{"x", x}, {"y", y}}, "", EscapeMarkup(text));
}

void Svg::Cell(double x,
               double y,
               double size,
               std::string_view style,
               double share,
               std::string_view tooltip) {
  Add("rect",
      style,
      {{"x", x}, {"y", y}, {"width", size}, {"height", size}},
      Attribute("fill-opacity", Fixed(share, 2)),
      Title(tooltip));
}

void Svg::Cells(const Points& corners,
                double size,
                std::string_view colour,
                std::string_view tooltip) {
  const std::string side = Fixed(size, 0);
  std::string path;
  for (const auto& [x, y] : corners) {
    path += 'M' + Place(x, y, 0, ' ') + 'h' + side + 'v' + side + "h-" + side + 'z';
  }
  Add("path", "", {}, Attribute("fill", colour) + Attribute("d", path), Title(tooltip));
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

}  // namespace truetriad
