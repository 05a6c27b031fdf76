// SPDX-License-Identifier: Apache-2.0
#include "report/svg.h"

#include "report/format.h"

namespace truetriad {
namespace {

std::string Attribute(std::string_view name, std::string_view value) {
  return ' ' + std::string(name) + "=\"" + EscapeMarkup(value) + '"';
}

std::string Attribute(std::string_view name, double value) {
  return Attribute(name, std::string_view(Fixed(value, 1)));
}

}  // namespace

std::string EscapeMarkup(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') escaped += c;
    }
  }
  return escaped;
}

Svg::Svg(double width, double height, std::string_view label)
    : head_("<svg role=\"img\"" + Attribute("aria-label", label) +
            Attribute("viewBox",
                      std::string_view("0 0 " + Fixed(width, 0) + ' ' + Fixed(height, 0))) +
            Attribute("style", std::string_view("max-width:" + Fixed(width, 0) + "px"))) {}

std::string Svg::FinishAlone(std::string_view style_sheet) const {
  return head_ + " xmlns=\"http://www.w3.org/2000/svg\">\n<style>" + std::string(style_sheet) +
         "</style>\n" + body_ + "</svg>\n";
}

void Svg::Line(double x1, double y1, double x2, double y2, std::string_view style) {
  body_ += "<line" + Attribute("class", style) + Attribute("x1", x1) + Attribute("y1", y1) +
           Attribute("x2", x2) + Attribute("y2", y2) + "/>\n";
}

void Svg::Rectangle(double x, double y, double width, double height, std::string_view style) {
  body_ += "<rect" + Attribute("class", style) + Attribute("x", x) + Attribute("y", y) +
           Attribute("width", width) + Attribute("height", height) + "/>\n";
}

void Svg::Circle(double x, double y, double radius, std::string_view style) {
  body_ += "<circle" + Attribute("class", style) + Attribute("cx", x) + Attribute("cy", y) +
           Attribute("r", radius) + "/>\n";
}

void Svg::Polyline(const std::vector<std::pair<double, double>>& points, std::string_view style) {
  std::string list;
  for (const auto& [x, y] : points) {
    list += (list.empty() ? "" : " ") + Fixed(x, 1) + ',' + Fixed(y, 1);
  }
  body_ += "<polyline" + Attribute("class", style) + Attribute("points", std::string_view(list)) +
           "/>\n";
}

void Svg::Cross(double x, double y, double size, std::string_view style) {
  Line(x - size, y - size, x + size, y + size, style);
  Line(x - size, y + size, x + size, y - size, style);
}

void Svg::Text(double x, double y, std::string_view text, std::string_view style) {
  body_ += "<text" + Attribute("class", style) + Attribute("x", x) + Attribute("y", y) + '>' +
           EscapeMarkup(text) + "</text>\n";
}

void Svg::Cell(double x, double y, double size, std::string_view colour, std::string_view tooltip) {
  body_ += "<rect" + Attribute("x", x) + Attribute("y", y) + Attribute("width", size) +
           Attribute("height", size) + Attribute("fill", colour) + "><title>" +
           EscapeMarkup(tooltip) + "</title></rect>\n";
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
