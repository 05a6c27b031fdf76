// SPDX-License-Identifier: Apache-2.0
#include "report/charts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "model/heading_error.h"
#include "report/chart_frame.h"
#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// From where to where a limit from `lower` (infinite: open) is drawn: what is allowed; about or
/// beyond a limit that is alone, so far that the value is seen.
Range ShownOf(const LimitCheck& check, double lower) {
  const double upper = check.limit.upper;
  if (std::isfinite(lower) && std::isfinite(upper) && lower < upper) return {lower, upper};
  const double alone = std::isfinite(upper) ? upper : lower;
  const double room = std::isfinite(upper) ? upper - check.worst : check.worst - lower;
  // What is beyond it ends where kBeyond of the reach does.
  double reach =
      std::max({std::abs(alone), 4.0 * check.sigma, room > 0.0 ? 1.25 * room : -6.0 * room});
  if (!(reach > 0.0) || !std::isfinite(reach)) reach = 1.0;
  return {std::isfinite(upper) ? alone - reach : alone,
          std::isfinite(lower) ? alone + reach : alone};
}

/// The sizes of a chart of limits, user units: each name above its bar, as narrow as a telephone.
struct LimitLayout {
  double left = 16.0;      ///< Where what is worse than the lower limit ends.
  double allowed = 240.0;  ///< Length of what is allowed.
  double beyond = 0.2;     ///< Of that, on each side; what is worse ends here.
  double name = 15.0;      ///< Height of a name.
  double bar = 16.0;
  double row = 39.0;  ///< Name, bar, and room to the next name.
  double first = left + beyond * allowed;
  double end = first + allowed * (1.0 + beyond);
};
constexpr LimitLayout kBars;

/// The bar of one limit.
class LimitBar {
 public:
  LimitBar(const LimitCheck& check, double top, Svg* svg)
      : check_(check), top_(top), centre_(top + kBars.bar / 2.0), svg_(*svg) {
    // What is never negative begins at zero.
    const Result<LimitName> name = ParseLimitName(check.name);
    is_from_zero_ = name && name->IsNeverNegative() && check.limit.lower <= 0.0;
    lower_ = is_from_zero_ ? 0.0 : check.limit.lower;
    shown_ = ShownOf(check, lower_);
  }

  void Draw() {
    if (std::isfinite(check_.worst)) DrawValue();
    const Limit& limit = check_.limit;
    if (limit.target) DrawMark(*limit.target, "whisker");
    if (is_from_zero_) {
      svg_.Text(kBars.first - 4.0, centre_ + 4.0, "0", "end");
    } else if (std::isfinite(limit.lower)) {
      DrawMark(limit.lower, "limit");
    }
    if (std::isfinite(limit.upper)) DrawMark(limit.upper, "limit");
  }

 private:
  double Share(double value) const { return (value - shown_.low) / shown_.span(); }
  double X(double value) const {
    return kBars.first +
           kBars.allowed * std::clamp(Share(value), -kBars.beyond, 1.0 + kBars.beyond);
  }

  void DrawMark(double value, std::string_view style) {
    svg_.Line(X(value), top_ - 2.0, X(value), top_ + kBars.bar + 3.0, style);
  }

  /// A value in these is nearer to a limit than k of its σ. Higher than the value, which would hide
  /// a thin one.
  void DrawGuard(double low, double high) {
    if (low < high) svg_.Rectangle(X(low), top_ - 2.0, X(high) - X(low), kBars.bar + 4.0, "guard");
  }

  void DrawValue() {
    const auto& [lower, upper] = std::pair(check_.limit.lower, check_.limit.upper);
    const double begin = is_from_zero_ ? kBars.first : kBars.left;
    svg_.Rectangle(begin, top_, kBars.end - begin, kBars.bar, "track");
    const double guard = check_.guard_band_k * check_.sigma;
    if (guard > 0.0 && std::isfinite(upper)) DrawGuard(std::max(upper - guard, lower_), upper);
    if (guard > 0.0 && std::isfinite(lower) && !is_from_zero_) {
      DrawGuard(lower, std::min(lower + guard, upper));
    }
    const double worst = check_.worst, x = X(worst);
    svg_.Rectangle(x - 2.0, top_, 4.0, kBars.bar, check_.pass ? "pass" : "fail");
    // Further out than is drawn.
    if (Share(worst) > 1.0 + kBars.beyond) {
      svg_.Text(kBars.end + 4.0, centre_ + 4.0, "»", "start");
    }
    if (Share(worst) < -kBars.beyond) svg_.Text(begin + 6.0, centre_ + 4.0, "«", "start");
    if (!(check_.sigma > 0.0)) return;
    const double reach = 2.0 * check_.sigma;
    svg_.Line(X(worst - reach), centre_, X(worst + reach), centre_, "whisker");
  }

  const LimitCheck& check_;
  double top_, centre_;
  Svg& svg_;
  bool is_from_zero_ = false;
  double lower_ = 0.0;
  Range shown_;
};

}  // namespace

Drawing LimitDrawing(const std::vector<LimitCheck>& limits) {
  if (limits.empty()) return {};
  Svg svg(
      380.0, 30.0 + kBars.row * static_cast<double>(limits.size()), "Worst value of each limit");
  svg.Text(kBars.first, 14.0, "lower", "middle");
  svg.Text(kBars.first + kBars.allowed, 14.0, "upper", "middle");
  double y = 22.0;
  for (const LimitCheck& check : limits) {
    svg.Text(kBars.left, y + kBars.name - 4.0, check.FullName(), "start");
    LimitBar(check, y + kBars.name, &svg).Draw();
    y += kBars.row;
  }
  return {svg.Finish(),
          "Worst value for each limit (bar) with ±2σ (line), compared with the limit; in another "
          "colour its guard band, where one is set."};
}

Drawing DifferenceDrawing(const std::vector<ComparisonEntry>& entries) {
  std::vector<std::pair<std::string, double>> shown;
  std::vector<double> sizes;
  for (const ComparisonEntry& entry : entries) {
    if (!(entry.sigma > 0.0)) continue;
    shown.emplace_back(entry.parameter, entry.difference / entry.sigma);
    sizes.push_back(std::abs(shown.back().second));
  }
  if (shown.empty() || shown.size() > kMostMarks) return {};
  std::sort(sizes.begin(), sizes.end());
  if (!std::isfinite(sizes.back())) return {};
  // What is far off sits on the edge with its value, and does not flatten the others.
  const double far = std::max(20.0, 3.0 * sizes[sizes.size() / 2]);
  const double largest = std::max(4.0, std::min(sizes.back(), far) + 1.0);
  const auto count = static_cast<double>(shown.size());
  const Frame::Box box{.left = 270.0,  // The name of a parameter.
                       .top = 10.0,
                       .width = 440.0,
                       .height = kLayout.cell * count};
  Svg svg(kLayout.width, box.top + box.height + kLayout.bottom, "Differences in σ");
  Frame frame(svg, box, {-largest, largest}, {-count, 1.0});
  const double all = 2.0 * count + 2.0;  // Beyond the frame, so to its edge.
  frame.DrawBand({{-2.0, all}, {2.0, all}}, {{-2.0, -all}, {2.0, -all}});
  frame.Draw("", "a − b, in σ", /*has_y=*/false);
  frame.DrawLine({{0.0, all}, {0.0, -all}}, "zero");
  double row = 0.0;
  for (const auto& [name, value] : shown) {
    svg.Text(box.left - 6.0, frame.Y(row) + 4.0, name, "end");
    frame.DrawLine({{value - 1.0, row}, {value + 1.0, row}}, "bar");
    svg.Circle(frame.X(value), frame.Y(row), kLayout.dot, "after");
    if (std::abs(value) > largest) frame.DrawFar(value, row, value, value > 0.0);
    row -= 1.0;
  }
  return {svg.Finish(),
          "Each difference in its σ, with ±1 σ (line). Shaded: ±2 σ, in which 95 of 100 lie by "
          "chance."};
}

Drawing CorrelationDrawing(const NamedCovariance& covariance) {
  const Eigen::MatrixXd& matrix = covariance.matrix;
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  if (matrix.rows() != size || matrix.cols() != size) return {};
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < size; ++i) {
    if (matrix(i, i) > 0.0) free.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(free.size());
  if (count < 2 || count > static_cast<Eigen::Index>(kMostListed)) return {};

  constexpr double kWhite = 0.02;  // What is less is not seen.
  const double side = kLayout.cell * static_cast<double>(count);
  const auto name = [&](Eigen::Index i) -> const std::string& {
    return covariance.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
  };
  std::size_t longest = 0;
  for (Eigen::Index i = 0; i < count; ++i) longest = std::max(longest, name(i).size());
  const double width = side + kLayout.letter * static_cast<double>(longest) + 10.0;
  Svg svg(width, side + kLayout.cell, "Correlation of the parameters");
  // One name for row and column, where they meet.
  for (Eigen::Index i = 0; i < count; ++i) {
    const double y = 0.5 * kLayout.cell + kLayout.cell * static_cast<double>(i);
    svg.Text(kLayout.cell * static_cast<double>(i + 1) + 5.0,
             y + 0.75 * kLayout.cell,
             name(i),
             "start small");
    svg.Rectangle(
        0.0, y, kLayout.cell * static_cast<double>(i + 1) - 1.0, kLayout.cell - 1.0, "track");
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::Index row = free[static_cast<std::size_t>(i)];
      const Eigen::Index column = free[static_cast<std::size_t>(j)];
      const double rho = matrix(row, column) / std::sqrt(matrix(row, row) * matrix(column, column));
      if (!(std::abs(rho) >= kWhite)) continue;
      svg.Cell(kLayout.cell * static_cast<double>(j),
               y,
               kLayout.cell - 1.0,
               rho > 0.0 ? "plus" : "minus",
               std::min(std::abs(rho), 1.0),
               name(i) + " with " + name(j) + ": " + Fixed(rho, 2));
    }
  }
  return {svg.Finish(),
          "Correlation of the estimated parameters: blue +1, orange −1, pale 0. A column's name is "
          "at its upper end."};
}

Drawing HeadingDrawing(const Calibration& calibration) {
  if (!calibration.IsUsable()) return {};
  std::vector<HeadingError> errors = HeadingErrors(calibration, kHeadings);
  if (errors.empty()) return {};
  // The circle is closed.
  errors.push_back(errors.front());
  errors.back().heading_rad = 360.0 / kDegPerRad;
  Panel raw{"raw heading, error, °", "heading, °", {}, {0.0, 0.0}};
  Panel corrected{"corrected heading, ±2σ, °", "heading, °", {{.kind = Series::Kind::kBand}}};
  for (const HeadingError& error : errors) {
    const double heading = kDegPerRad * error.heading_rad;
    corrected.series[0].Add(heading, 0.0, 2.0 * kDegPerRad * error.sigma_rad);
    if (!error.raw_rad) continue;
    const double raw_deg = kDegPerRad * *error.raw_rad;
    // A reading that has turned past 180° goes on at the other side.
    if (raw.series.empty() || std::abs(raw_deg - raw.series.back().points.back().second) > 180.0) {
      raw.series.push_back({.style = "line"});
    }
    raw.series.back().Add(heading, raw_deg);
  }
  return {Chart("Heading error round the compass", {raw, corrected}),
          "Heading of the unit held level, round the compass, its tilt by the accelerometer: error "
          "of raw readings, and that by the σ of the parameters."};
}

}  // namespace truetriad
