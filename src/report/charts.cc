// SPDX-License-Identifier: Apache-2.0
#include "report/charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>

#include "report/chart_frame.h"
#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr Eigen::Index kMaxCorrelated = 60;

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

}  // namespace

std::string LimitChart(const std::vector<LimitCheck>& limits) {
  if (limits.empty()) return "";
  // Each name above its bar: as narrow as a telephone.
  constexpr double kLeft = 16.0;
  constexpr double kAllowed = 240.0;  // Length of what is allowed.
  constexpr double kName = 15.0, kBar = 16.0, kRow = kName + kBar + 8.0;
  constexpr double kBeyond = 0.2;  // Of what is allowed, on each side; what is worse ends here.
  Svg svg(380.0, 30.0 + kRow * static_cast<double>(limits.size()), "Worst value of each limit");
  constexpr double kFirst = kLeft + kBeyond * kAllowed;
  svg.Text(kFirst, 14.0, "lower", "middle");
  svg.Text(kFirst + kAllowed, 14.0, "upper", "middle");
  double y = 22.0;
  for (const LimitCheck& check : limits) {
    const Limit& limit = check.limit;
    // What is never negative begins at zero.
    const Result<LimitName> name = ParseLimitName(check.name);
    const bool is_from_zero = name && name->IsNeverNegative() && limit.lower <= 0.0;
    const double lower = is_from_zero ? 0.0 : limit.lower;
    const Range shown = ShownOf(check, lower);
    const auto share = [&](double value) { return (value - shown.low) / shown.span(); };
    const auto x = [&](double value) {
      return kFirst + kAllowed * std::clamp(share(value), -kBeyond, 1.0 + kBeyond);
    };
    svg.Text(kLeft, y + kName - 4.0, check.FullName(), "start");
    const double top = y + kName, centre = top + kBar / 2.0;
    if (std::isfinite(check.worst)) {
      const double begin = is_from_zero ? kFirst : kLeft;
      const double end = kFirst + kAllowed * (1.0 + kBeyond);
      svg.Rectangle(begin, top, end - begin, kBar, "track");
      // A value in these is nearer to a limit than k of its σ. Higher than the value, which would
      // hide a thin one.
      const double guard = check.guard_band_k * check.sigma;
      const auto draw_guard = [&](double low, double high) {
        if (low < high) svg.Rectangle(x(low), top - 2.0, x(high) - x(low), kBar + 4.0, "guard");
      };
      if (guard > 0.0 && std::isfinite(limit.upper)) {
        draw_guard(std::max(limit.upper - guard, lower), limit.upper);
      }
      if (guard > 0.0 && std::isfinite(limit.lower) && !is_from_zero) {
        draw_guard(limit.lower, std::min(limit.lower + guard, limit.upper));
      }
      svg.Rectangle(x(check.worst) - 2.0, top, 4.0, kBar, check.pass ? "pass" : "fail");
      // Further out than is drawn.
      if (share(check.worst) > 1.0 + kBeyond) svg.Text(end + 4.0, centre + 4.0, "»", "start");
      if (share(check.worst) < -kBeyond) svg.Text(begin + 6.0, centre + 4.0, "«", "start");
      if (check.sigma > 0.0) {
        svg.Line(x(check.worst - 2.0 * check.sigma),
                 centre,
                 x(check.worst + 2.0 * check.sigma),
                 centre,
                 "whisker");
      }
    }
    const auto draw_line = [&](double value, std::string_view style) {
      svg.Line(x(value), top - 2.0, x(value), top + kBar + 3.0, style);
    };
    if (limit.target) draw_line(*limit.target, "whisker");
    if (is_from_zero) {
      svg.Text(kFirst - 4.0, centre + 4.0, "0", "end");
    } else if (std::isfinite(limit.lower)) {
      draw_line(limit.lower, "limit");
    }
    if (std::isfinite(limit.upper)) draw_line(limit.upper, "limit");
    y += kRow;
  }
  return svg.Finish();
}

std::string DifferenceChart(const std::vector<ComparisonEntry>& entries) {
  constexpr double kLeft = 270.0, kWidth = 440.0, kRow = 15.0, kTop = 10.0;
  constexpr std::size_t kMostRows = 100;
  std::vector<const ComparisonEntry*> shown;
  std::vector<double> sizes;
  for (const ComparisonEntry& entry : entries) {
    if (!(entry.sigma > 0.0)) continue;
    shown.push_back(&entry);
    sizes.push_back(std::abs(entry.difference / entry.sigma));
  }
  if (shown.empty() || shown.size() > kMostRows) return "";
  std::sort(sizes.begin(), sizes.end());
  if (!std::isfinite(sizes.back())) return "";
  // What is far off sits on the edge with its value, and does not flatten the others.
  const double far = std::max(20.0, 3.0 * sizes[sizes.size() / 2]);
  const double largest = std::max(4.0, std::min(sizes.back(), far) + 1.0);
  const double height = kRow * static_cast<double>(shown.size());
  Svg svg(730.0, kTop + height + 36.0, "Differences in σ");
  const Range range{-largest, largest};
  const auto x = [&](double sigmas) {
    return kLeft + kWidth * (std::clamp(sigmas, -largest, largest) + largest) / (2.0 * largest);
  };
  svg.Rectangle(x(-2.0), kTop, x(2.0) - x(-2.0), height, "band");
  svg.Rectangle(kLeft, kTop, kWidth, height, "frame");
  for (const double tick : Ticks(range)) {
    svg.Line(x(tick), kTop, x(tick), kTop + height, tick == 0.0 ? "zero" : "grid");
    svg.Text(x(tick), kTop + height + 16.0, Significant(tick, 3), "middle");
  }
  svg.Text(kLeft + kWidth, kTop + height + 31.0, "a − b, in σ", "end");
  double y = kTop + 0.5 * kRow;
  for (const ComparisonEntry* entry : shown) {
    const double value = entry->difference / entry->sigma;
    svg.Text(kLeft - 6.0, y + 4.0, entry->parameter, "end");
    svg.Line(x(value - 1.0), y, x(value + 1.0), y, "bar");
    svg.Circle(x(value), y, 2.8, "after");
    if (std::abs(value) > largest) {
      svg.Text(x(value) + (value > 0.0 ? -6.0 : 6.0),
               y + 4.0,
               Significant(value, 3),
               value > 0.0 ? "far end" : "far start");
    }
    y += kRow;
  }
  return svg.Finish();
}

std::string CorrelationChart(const NamedCovariance& covariance) {
  const Eigen::MatrixXd& matrix = covariance.matrix;
  const auto size = static_cast<Eigen::Index>(covariance.parameters.size());
  if (matrix.rows() != size || matrix.cols() != size) return "";
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < size; ++i) {
    if (matrix(i, i) > 0.0) free.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(free.size());
  if (count < 2 || count > kMaxCorrelated) return "";

  constexpr double kCell = 15.0, kTop = 8.0;
  constexpr double kCharacter = 6.0;  // width of one of the small font, at most
  constexpr double kWhite = 0.02;     // what is less is not seen
  const double side = kCell * static_cast<double>(count);
  const auto name = [&](Eigen::Index i) -> const std::string& {
    return covariance.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
  };
  std::size_t longest = 0;
  for (Eigen::Index i = 0; i < count; ++i) longest = std::max(longest, name(i).size());
  const double width = side + kCharacter * static_cast<double>(longest) + 10.0;
  Svg svg(width, kTop + side + 8.0, "Correlation of the parameters");
  // One name for row and column, where they meet.
  for (Eigen::Index i = 0; i < count; ++i) {
    const double y = kTop + kCell * static_cast<double>(i);
    svg.Text(kCell * static_cast<double>(i + 1) + 5.0, y + 0.75 * kCell, name(i), "start small");
    svg.Rectangle(0.0, y, kCell * static_cast<double>(i + 1) - 1.0, kCell - 1.0, "track");
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::Index row = free[static_cast<std::size_t>(i)];
      const Eigen::Index column = free[static_cast<std::size_t>(j)];
      const double rho = matrix(row, column) / std::sqrt(matrix(row, row) * matrix(column, column));
      if (!(std::abs(rho) >= kWhite)) continue;
      svg.Cell(kCell * static_cast<double>(j),
               y,
               kCell - 1.0,
               rho > 0.0 ? "plus" : "minus",
               std::min(std::abs(rho), 1.0),
               name(i) + " with " + name(j) + ": " + Fixed(rho, 2));
    }
  }
  return svg.Finish();
}

}  // namespace truetriad
