// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "report/svg.h"

namespace truetriad {

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

/// Round numbers within the range, five to twelve.
std::vector<double> Ticks(const Range& range);

/// A frame with its scales. What is drawn beyond it sits on its edge.
class Frame {
 public:
  struct Box {
    double left = 66.0, top = 28.0, width = 290.0, height = 190.0;
  };
  /// The ranges are padded, so that no mark of theirs is cut off.
  Frame(Svg& svg, const Box& box, const Range& x, const Range& y);

  double X(double value) const;
  double Y(double value) const;

  /// Frame, grid, numbers and titles; without `x_title` nothing stands below, and without `has_y`
  /// nothing on the left.
  void Draw(const std::string& title, const std::string& x_title, bool has_y = true);

  /// A band about y = 0 over the whole width.
  void DrawBand(double half_width);
  void DrawLine(const std::vector<std::pair<double, double>>& points, std::string_view style);
  /// Between two lines over the same x.
  void DrawBetween(const std::vector<std::pair<double, double>>& upper,
                   const std::vector<std::pair<double, double>>& lower);
  /// Many points that need no names.
  void DrawDots(const std::vector<std::pair<double, double>>& points, std::string_view style);
  void DrawErrorBar(double x, double y, double half_length);

 private:
  Svg& svg_;
  Box box_;
  Range x_, y_;
};

}  // namespace truetriad
