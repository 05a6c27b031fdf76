// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace truetriad {

/// `text` for HTML and SVG: &, <, >, " and ' become entities, control characters are dropped.
/// Invalid UTF-8 and characters that reverse the text direction are shown as by Printable.
std::string EscapeMarkup(std::string_view text);

/// Positions in a drawing, or (x, y) values of a chart.
using Points = std::vector<std::pair<double, double>>;

/// The tooltip of a shape, and the pose to whose row the shape links; 0: none.
struct Note {
  std::string tooltip = {};
  int pose = 0;
};

/// A drawing to be inlined into HTML. The page's style sheet sets the looks by class name.
/// Coordinates are in user units, y down, written to a tenth of a unit.
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
  /// Points without tooltips, about ten bytes each. The line width of `style` is a dot's diameter.
  void Dots(const Points& points, std::string_view style);
  /// Straight lines from point to point; filled if the style says so.
  void Polyline(const Points& points, std::string_view style);
  /// One zigzag line through the ranges from low to high, at ascending x. Exact to half a unit;
  /// takes about seven bytes per range.
  struct Span {
    double x, low, high;
  };
  void Zigzag(const std::vector<Span>& spans, std::string_view style);
  /// A line with an arrowhead at its end.
  void Arrow(const Points::value_type& from,
             const Points::value_type& to,
             const std::string& style);
  void Cross(double x, double y, std::string_view style);
  /// First word of `style` ("start", "middle", "end") anchors (x, y); the other words are classes.
  void Text(double x, double y, std::string_view text, std::string_view style);
  /// Cells of one colour: that of `style` with the opacity `share`. `corners`: upper left corners,
  /// rounded to whole units. A cell takes about twenty bytes.
  void Cells(const Points& corners,
             double size,
             std::string_view style,
             double share,
             std::string_view tooltip);
  void RotatedText(
      double x, double y, double degrees, std::string_view text, std::string_view style);

  /// Returns the finished element.
  std::string Finish() const { return head_ + ">\n" + body_ + "</svg>\n"; }
  /// The finished drawing as a separate file, with its style sheet.
  std::string FinishAlone(std::string_view style_sheet) const;

 private:
  /// Adds an element with a class, numbers, further attributes and inner text.
  void Add(std::string_view element,
           std::string_view style,
           std::initializer_list<std::pair<std::string_view, double>> numbers,
           const std::string& attributes = {},
           const std::string& inside = {});

  std::string head_;
  std::string body_;
};

/// The sizes of all charts in user units: a letter is about 6.5 wide and 11 high.
struct ChartLayout {
  double width = 760.0;         ///< The width of a page's column.
  double left = 66.0;           ///< Room for the numbers of an axis: nine letters.
  double top = 28.0;            ///< Room for a title.
  double bottom = 42.0;         ///< Room for the numbers of an axis and its title.
  double panel_width = 290.0;   ///< The width of each of two panels side by side.
  double panel_height = 190.0;  ///< Room for four or more numbers of a y axis.
  double between = 90.0;        ///< Between panels side by side, with room for numbers.
  double below = 24.0;          ///< Between panels one below the other: room for a title.
  double letter = 6.5;
  double line = 11.0;
  double cell = 15.0;  ///< A line of text and the gap to the next.
  double room = 0.04;  ///< Margin as a share of the range: more than a mark's radius.
  double dot = 2.8;    ///< The radius of a mark that can be pointed at.
};
inline constexpr ChartLayout kLayout;

/// The most points of one kind after thinning. Two per unit of a panel (2 · 290 = 580), rounded.
inline constexpr std::size_t kMostPoints = 600;
/// If there are more poses, marks have no tooltips: they would be too narrow to point at.
inline constexpr std::size_t kMostMarks = 150;

/// The range of what is drawn along an axis.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  bool is_log = false;  ///< The axis is logarithmic: low and high are decimal exponents.
  void Add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double span() const { return std::max(high - low, 1e-300); }
  /// The range with room for marks at its ends.
  Range Padded() const;
};

/// A frame with its scales. Values beyond the scales are drawn on its edge.
class Frame {
 public:
  struct Box {
    double left = kLayout.left, top = kLayout.top;
    double width = kLayout.panel_width, height = kLayout.panel_height;
  };
  /// The ranges are padded, so that no mark at their ends is cut off.
  Frame(Svg& svg, const Box& box, const Range& x, const Range& y);

  double X(double value) const;
  double Y(double value) const;

  /// Draws frame, grid, numbers and titles. Without `x_title` there is no title below, and no
  /// numbers unless the axis is logarithmic; without `has_y` there are no numbers on the left.
  void Draw(const std::string& title, const std::string& x_title, bool has_y = true);

  void DrawLine(const Points& points, std::string_view style);
  /// Fills the area between two lines over the same x.
  void DrawBand(const Points& high, const Points& low);
  /// Draws points without tooltips; of very many points, only the extremes of each group of
  /// neighbours are drawn.
  void DrawDots(const Points& points, std::string_view style);
  /// Marks a value beyond the scale at the edge; `is_left`: the text stands to the left of (x, y).
  void DrawFar(double x, double y, double value, bool is_left);

 private:
  void DrawScales(bool has_x, bool has_y);
  void DrawDecades(bool has_y);
  Points Places(const Points& points) const;

  Svg& svg_;
  Box box_;
  Range x_, y_;
};

/// One line, set of dots, band or set of bars in a panel. If x reverses, a new band begins.
struct Series {
  enum class Kind { kLine, kDots, kBand, kBars };
  Kind kind = Kind::kLine;
  std::string_view style = {};  ///< For lines and dots.
  Points points = {};
  std::vector<double> half = {};  ///< Half the height of bands and bars.

  void Add(double x, double y) { points.emplace_back(x, y); }
  void Add(double x, double y, double reach) { Add(x, y), half.push_back(reach); }
};

struct Panel {
  std::string title;
  std::string x_title;
  std::vector<Series> series;  ///< In the order of drawing; bands lie below the grid.
  Range y = {};                ///< The y axis shows this range as well as the series.
};

/// Panels side by side. Panels without data are left out; the text is empty if none is left.
std::string Chart(std::string_view label, const std::vector<Panel>& panels);

}  // namespace truetriad
