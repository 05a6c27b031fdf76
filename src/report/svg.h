// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace truetriad {

/// `text` for HTML and SVG: &, <, >, " and ' as entities, control characters left out; what is no
/// UTF-8, or turns the direction of text, as in Printable.
std::string EscapeMarkup(std::string_view text);

/// Places of a drawing, or what is drawn in a chart.
using Points = std::vector<std::pair<double, double>>;

/// What a shape says to who points at it, and the pose to whose row it leads.
struct Note {
  std::string tooltip = {};
  int pose = 0;
};

/// A drawing for inlining into HTML; the looks come from the page's style sheet by class name.
/// Coordinates in user units, y down, written to a tenth of a unit.
class Svg {
 public:
  Svg(double width, double height, std::string_view label);

  void Line(double x1, double y1, double x2, double y2, std::string_view style);
  void Rectangle(double x,
                 double y,
                 double width,
                 double height,
                 std::string_view style,
                 const Note& note = {});
  void Circle(double x, double y, double radius, std::string_view style, const Note& note = {});
  /// Points without names, some ten bytes each; `style`: a class whose line is as wide as a dot.
  void Dots(const Points& points, std::string_view style);
  /// Straight lines from point to point; filled when the style says so.
  void Polyline(const Points& points, std::string_view style);
  /// What lies between low and high at ascending x, as one zigzag line in half units, some seven
  /// bytes each.
  struct Span {
    double x, low, high;
  };
  void Zigzag(const std::vector<Span>& spans, std::string_view style);
  /// A diagonal cross.
  void Cross(double x, double y, std::string_view style);
  /// `style` "start", "middle" or "end" says where (x, y) is on the text, then further classes.
  void Text(double x, double y, std::string_view text, std::string_view style);
  /// A cell whose colour is that of `style` as far as `share` says.
  void Cell(double x,
            double y,
            double size,
            std::string_view style,
            double share,
            std::string_view tooltip);
  /// Many cells of one colour, given by their upper left corners, some twenty bytes each.
  void Cells(const Points& corners, double size, std::string_view colour, std::string_view tooltip);
  void RotatedText(
      double x, double y, double degrees, std::string_view text, std::string_view style);

  /// The finished element.
  std::string Finish() const { return head_ + ">\n" + body_ + "</svg>\n"; }
  /// The finished drawing as a file of its own, with its style sheet.
  std::string FinishAlone(std::string_view style_sheet) const;

 private:
  /// An element with a class, numbers, further attributes, and what is inside.
  void Add(std::string_view element,
           std::string_view style,
           std::initializer_list<std::pair<std::string_view, double>> numbers,
           const std::string& attributes = {},
           const std::string& inside = {});

  std::string head_;
  std::string body_;
};

}  // namespace truetriad
