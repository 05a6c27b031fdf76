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
  /// A line with a head at its end.
  void Arrow(const Points::value_type& from,
             const Points::value_type& to,
             const std::string& style);
  /// A diagonal cross.
  void Cross(double x, double y, std::string_view style);
  /// `style` "start", "middle" or "end" says where (x, y) is on the text, then further classes.
  void Text(double x, double y, std::string_view text, std::string_view style);
  /// Cells of one colour, that of `style` as far as `share` says, given by their upper left corners
  /// in whole units, some twenty bytes each.
  void Cells(const Points& corners,
             double size,
             std::string_view style,
             double share,
             std::string_view tooltip);
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

/// The sizes of all charts, user units: a letter is about 6.5 wide and 11 high.
struct ChartLayout {
  double width = 760.0;         ///< That of a page's column.
  double left = 66.0;           ///< The numbers of an axis: nine letters.
  double top = 28.0;            ///< A title.
  double bottom = 42.0;         ///< The numbers of an axis and its title.
  double panel_width = 290.0;   ///< Of two side by side.
  double panel_height = 190.0;  ///< Four numbers and more of a y axis.
  double between = 90.0;        ///< From a panel to the next beside it, with its numbers.
  double below = 24.0;          ///< From a panel to the next below it: a title.
  double letter = 6.5;
  double line = 11.0;
  double cell = 15.0;  ///< A line and what parts it from the next.
  double room = 0.04;  ///< Of a range, beyond its ends: more than the radius of a mark.
  double dot = 2.8;    ///< The radius of a mark that can be pointed at.
};
inline constexpr ChartLayout kLayout;

/// So many points of one kind are drawn: about one a pixel of a panel.
inline constexpr std::size_t kMostPoints = 600;
/// So many poses have a mark each, which says what it is; more are too narrow to be pointed at.
inline constexpr std::size_t kMostMarks = 150;

/// The range of what is drawn along an axis.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  bool is_log = false;  ///< The axis is logarithmic: low and high are decades.
  void Add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double span() const { return std::max(high - low, 1e-300); }
  /// With room for marks at its ends.
  Range Padded() const;
};

/// A frame with its scales. What is drawn beyond it sits on its edge.
class Frame {
 public:
  struct Box {
    double left = kLayout.left, top = kLayout.top;
    double width = kLayout.panel_width, height = kLayout.panel_height;
  };
  /// The ranges are padded, so that no mark of theirs is cut off.
  Frame(Svg& svg, const Box& box, const Range& x, const Range& y);

  double X(double value) const;
  double Y(double value) const;

  /// Frame, grid, numbers and titles; without `x_title` no title stands below, and numbers do of
  /// decades alone; without `has_y` nothing stands on the left.
  void Draw(const std::string& title, const std::string& x_title, bool has_y = true);

  void DrawLine(const Points& points, std::string_view style);
  /// Filled between two lines over the same x.
  void DrawBand(const Points& high, const Points& low);
  /// Many points that need no names; of very many the extremes of neighbours.
  void DrawDots(const Points& points, std::string_view style);
  /// A value on the edge, since it is further out than is drawn; `is_left`: of the place it has.
  void DrawFar(double x, double y, double value, bool is_left);

 private:
  void DrawScales(bool has_x, bool has_y);
  void DrawDecades(bool has_y);
  Points Places(const Points& points) const;

  Svg& svg_;
  Box box_;
  Range x_, y_;
};

/// One kind of thing in a panel. Where x turns back a band begins anew.
struct Series {
  enum class Kind { kLine, kDots, kBand, kBars };
  Kind kind = Kind::kLine;
  std::string_view style = {};  ///< Of lines and dots.
  Points points = {};
  std::vector<double> half = {};  ///< Of bands and bars: how far they reach up and down.

  void Add(double x, double y) { points.emplace_back(x, y); }
  void Add(double x, double y, double reach) { Add(x, y), half.push_back(reach); }
};

struct Panel {
  std::string title;
  std::string x_title;
  std::vector<Series> series;  ///< In the order in which they are drawn; bands below the grid.
  Range y = {};                ///< What it shows besides all of them.
};

/// Panels side by side, of which those without anything to draw are left out; nothing without any.
std::string Chart(std::string_view label, const std::vector<Panel>& panels);

}  // namespace truetriad
