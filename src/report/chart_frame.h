// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "report/format.h"
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
};

/// A frame with its scales.
class Frame {
 public:
  Frame(Svg& svg, double left, double width, const Range& x, const Range& y)
      : svg_(svg), left_(left), width_(width), x_(x), y_(y) {}
  static constexpr double kTop = 28.0, kHeight = 190.0;

  double X(double value) const { return left_ + (value - x_.low) / x_.span() * width_; }
  double Y(double value) const { return kTop + (y_.high - value) / y_.span() * kHeight; }

  void Draw(const std::string& title, const std::string& x_title) {
    svg_.Rectangle(left_, kTop, width_, kHeight, "frame");
    for (const double y : Ticks(y_)) {
      svg_.Line(left_, Y(y), left_ + width_, Y(y), "grid");
      svg_.Text(left_ - 5.0, Y(y) + 4.0, Significant(y, 3), "end");
    }
    for (const double x : Ticks(x_)) {
      svg_.Text(X(x), kTop + kHeight + 15.0, Significant(x, 3), "middle");
    }
    svg_.Text(left_, kTop - 8.0, title, "start title");
    svg_.Text(left_ + width_, kTop + kHeight + 30.0, x_title, "end");
  }

 private:
  // Round numbers, four or so.
  static std::vector<double> Ticks(const Range& range) {
    const double wanted = range.span() / 4.0;
    const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
    double step = 10.0 * decade;
    for (const double factor : {5.0, 2.0, 1.0}) {
      if (factor * decade >= wanted) step = factor * decade;
    }
    std::vector<double> ticks;
    for (double i = std::ceil(range.low / step); i * step <= range.high; i += 1.0) {
      ticks.push_back(i * step);
    }
    return ticks;
  }

  Svg& svg_;
  double left_, width_;
  Range x_, y_;
};

}  // namespace truetriad
