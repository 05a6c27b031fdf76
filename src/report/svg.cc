// SPDX-License-Identifier: Apache-2.0
#include "report/svg.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/utf8.h"
#include "report/format.h"

namespace truetriad {
namespace {

void AppendMarkup(std::string_view text, std::string* to) {
  // A name can be anything: what is no UTF-8, or would turn the text behind it, is shown as such.
  const auto is_ascii = [](char c) { return static_cast<unsigned char>(c) < 0x80; };
  std::string printable;
  if (!std::all_of(text.begin(), text.end(), is_ascii)) {
    printable = Printable(text);
    text = printable;
  }
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = begin;
    std::string_view entity;
    for (; end < text.size() && entity.empty(); ++end) {
      switch (text[end]) {
        case '&':
          entity = "&amp;";
          break;
        case '<':
          entity = "&lt;";
          break;
        case '>':
          entity = "&gt;";
          break;
        case '"':
          entity = "&quot;";
          break;
        case '\'':
          entity = "&#39;";
          break;
        default:
          break;
      }
      const auto byte = static_cast<unsigned char>(text[end]);
      if (!entity.empty() || (byte < 0x20 && byte != '\n' && byte != '\t')) break;
    }
    to->append(text, begin, end - begin);
    to->append(entity);
    begin = end + 1;
  }
}

void AppendAttribute(std::string_view name, std::string_view value, std::string* to) {
  *to += ' ';
  *to += name;
  *to += "=\"";
  AppendMarkup(value, to);
  *to += '"';
}

void AppendAttribute(std::string_view name, double value, std::string* to) {
  AppendAttribute(name, std::string_view(Fixed(value, 1)), to);
}

std::string Attribute(std::string_view name, std::string_view value) {
  std::string attribute;
  AppendAttribute(name, value, &attribute);
  return attribute;
}

/// The beginning of an element with a class.
void Begin(std::string_view element, std::string_view style, std::string* to) {
  *to += '<';
  *to += element;
  AppendAttribute("class", style, to);
}

void BeginBox(
    double x, double y, double width, double height, std::string_view style, std::string* to) {
  Begin("rect", style, to);
  AppendAttribute("x", x, to);
  AppendAttribute("y", y, to);
  AppendAttribute("width", width, to);
  AppendAttribute("height", height, to);
}

/// The end of an element that says something to who points at it.
void EndWithTooltip(std::string_view element, std::string_view tooltip, std::string* to) {
  *to += "><title>";
  AppendMarkup(tooltip, to);
  to->append("</title></").append(element).append(">\n");
}

}  // namespace

std::string EscapeMarkup(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  AppendMarkup(text, &escaped);
  return escaped;
}

Svg::Svg(double width, double height, std::string_view label)
    : head_("<svg role=\"img\"" + Attribute("aria-label", label) +
            Attribute("viewBox",
                      std::string_view("0 0 " + Fixed(width, 0) + ' ' + Fixed(height, 0))) +
            Attribute("style", std::string_view("--width:" + Fixed(width, 0) + "px"))) {}

std::string Svg::FinishAlone(std::string_view style_sheet) const {
  return head_ + " xmlns=\"http://www.w3.org/2000/svg\">\n<style>" + std::string(style_sheet) +
         "</style>\n" + body_ + "</svg>\n";
}

void Svg::Line(double x1, double y1, double x2, double y2, std::string_view style) {
  Begin("line", style, &body_);
  AppendAttribute("x1", x1, &body_);
  AppendAttribute("y1", y1, &body_);
  AppendAttribute("x2", x2, &body_);
  AppendAttribute("y2", y2, &body_);
  body_ += "/>\n";
}

void Svg::Rectangle(double x, double y, double width, double height, std::string_view style) {
  BeginBox(x, y, width, height, style, &body_);
  body_ += "/>\n";
}

void Svg::Circle(double x, double y, double radius, std::string_view style) {
  Begin("circle", style, &body_);
  AppendAttribute("cx", x, &body_);
  AppendAttribute("cy", y, &body_);
  AppendAttribute("r", radius, &body_);
  body_ += "/>\n";
}

void Svg::Stretch(double x,
                  double y,
                  double width,
                  double height,
                  std::string_view style,
                  int pose,
                  std::string_view tooltip) {
  BeginBox(x, y, width, height, style, &body_);
  AppendAttribute("data-pose", std::string_view(std::to_string(pose)), &body_);
  EndWithTooltip("rect", tooltip, &body_);
}

void Svg::Mark(double x, double y, std::string_view style, int pose, std::string_view tooltip) {
  Begin("circle", style, &body_);
  AppendAttribute("cx", x, &body_);
  AppendAttribute("cy", y, &body_);
  body_ += " r=\"2.8\"";
  AppendAttribute("data-pose", std::string_view(std::to_string(pose)), &body_);
  EndWithTooltip("circle", tooltip, &body_);
}

void Svg::Dots(const std::vector<std::pair<double, double>>& points, std::string_view style) {
  std::string path;
  for (const auto& [x, y] : points) path += 'M' + Fixed(x, 1) + ' ' + Fixed(y, 1) + "h0";
  Begin("path", style, &body_);
  AppendAttribute("d", std::string_view(path), &body_);
  body_ += "/>\n";
}

void Svg::Polyline(const std::vector<std::pair<double, double>>& points, std::string_view style) {
  std::string list;
  for (const auto& [x, y] : points) {
    list += (list.empty() ? "" : " ") + Fixed(x, 1) + ',' + Fixed(y, 1);
  }
  Begin("polyline", style, &body_);
  AppendAttribute("points", std::string_view(list), &body_);
  body_ += "/>\n";
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
  Begin("path", style, &body_);
  AppendAttribute("transform", std::string_view("scale(.5)"), &body_);
  AppendAttribute("d", std::string_view(path), &body_);
  body_ += "/>\n";
}

void Svg::Cross(double x, double y, double size, std::string_view style) {
  Line(x - size, y - size, x + size, y + size, style);
  Line(x - size, y + size, x + size, y - size, style);
}

void Svg::Text(double x, double y, std::string_view text, std::string_view style) {
  Begin("text", style, &body_);
  AppendAttribute("x", x, &body_);
  AppendAttribute("y", y, &body_);
  body_ += '>';
  AppendMarkup(text, &body_);
  body_ += "</text>\n";
}

void Svg::Cell(double x,
               double y,
               double size,
               std::string_view style,
               double share,
               std::string_view tooltip) {
  BeginBox(x, y, size, size, style, &body_);
  AppendAttribute("fill-opacity", std::string_view(Fixed(share, 2)), &body_);
  EndWithTooltip("rect", tooltip, &body_);
}

void Svg::Cells(const std::vector<std::pair<double, double>>& corners,
                double size,
                std::string_view colour,
                std::string_view tooltip) {
  const std::string side = Fixed(size, 0);
  std::string path;
  for (const auto& [x, y] : corners) {
    path += 'M' + Fixed(x, 0) + ' ' + Fixed(y, 0) + 'h' + side + 'v' + side + "h-" + side + 'z';
  }
  body_ += "<path";
  AppendAttribute("fill", colour, &body_);
  AppendAttribute("d", std::string_view(path), &body_);
  EndWithTooltip("path", tooltip, &body_);
}

void Svg::RotatedText(
    double x, double y, double degrees, std::string_view text, std::string_view style) {
  body_ += "<text" + Attribute("class", style) +
           Attribute("transform",
                     std::string_view("translate(" + Fixed(x, 1) + ' ' + Fixed(y, 1) + ") rotate(" +
                                      Fixed(degrees, 0) + ')')) +
           '>' + EscapeMarkup(text) + "</text>\n";
}

}  // namespace truetriad
