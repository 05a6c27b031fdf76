// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "report/svg.h"

namespace truetriad {

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

  /// Frame, grid, numbers and titles; without `x_title` nothing stands below, and without `has_y`
  /// nothing on the left.
  void Draw(const std::string& title, const std::string& x_title, bool has_y = true);

  void DrawLine(const Points& points, std::string_view style);
  /// Filled between two lines over the same x.
  void DrawBand(const Points& high, const Points& low);
  /// Many points that need no names; of very many the extremes of neighbours.
  void DrawDots(const Points& points, std::string_view style);
  /// A value on the edge, since it is further out than is drawn; `is_left`: of the place it has.
  void DrawFar(double x, double y, double value, bool is_left);

 private:
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
