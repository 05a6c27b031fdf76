// SPDX-License-Identifier: Apache-2.0
#include "report/charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>

#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr std::size_t kMaxPoints = 600;
constexpr Eigen::Index kMaxCorrelated = 60;

/// A norm error at a pose.
struct Point {
  int pose = 0;
  double value = 0.0;
};

/// At most kMaxPoints points: of each run of neighbours the smallest and the largest stay, so
/// that the extremes, which are what one looks for, are never lost.
std::vector<Point> Thinned(const std::vector<Point>& points) {
  if (points.size() <= kMaxPoints) return points;
  constexpr std::size_t kRuns = kMaxPoints / 2;
  std::vector<Point> kept;
  for (std::size_t run = 0; run < kRuns; ++run) {
    const auto at = [&](std::size_t i) {
      return points.begin() + static_cast<std::ptrdiff_t>(i * points.size() / kRuns);
    };
    const auto [low, high] = std::minmax_element(
        at(run), at(run + 1), [](const Point& a, const Point& b) { return a.value < b.value; });
    kept.push_back(*std::min(low, high));
    if (low != high) kept.push_back(*std::max(low, high));
  }
  return kept;
}

/// A round number (1, 2 or 5 times a power of ten) that divides `range` into two to five steps.
double TickStep(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 2.0)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= range / 2.0) return factor * power;
  }
  return power;
}

/// A panel whose x axis counts poses and whose y axis is symmetric about zero.
class Panel {
 public:
  Panel(Svg& svg, double top, double height, int first_pose, int last_pose, double range)
      : svg_(svg),
        middle_(top + height / 2.0),
        half_height_(height / 2.0),
        first_(first_pose),
        per_pose_(kWidth / std::max(last_pose - first_pose + 1, 1)),
        range_(range) {}

  static constexpr double kLeft = 76.0;
  static constexpr double kWidth = 660.0;

  double X(int pose) const { return kLeft + (pose - first_ + 0.5) * per_pose_; }
  double Y(double value) const {
    return middle_ - std::clamp(value / range_, -1.0, 1.0) * half_height_;
  }

  void DrawAxis(const std::string& title) {
    svg_.Rectangle(kLeft, middle_ - half_height_, kWidth, 2.0 * half_height_, "frame");
    const double step = TickStep(range_);
    const int ticks = static_cast<int>(range_ / step);
    for (int i = -ticks; i <= ticks; ++i) {
      svg_.Line(kLeft, Y(i * step), kLeft + kWidth, Y(i * step), i == 0 ? "zero" : "grid");
      svg_.Text(kLeft - 6.0, Y(i * step) + 4.0, Significant(i * step, 4), "end");
    }
    svg_.Text(kLeft, middle_ - half_height_ - 6.0, title, "start title");
  }

  /// Ticks under the panel: every so many poses, a dozen at most.
  void DrawPoseNumbers(int last_pose) {
    const double y = middle_ + half_height_;
    const int step = std::max(1, static_cast<int>(TickStep((last_pose - first_ + 1) / 2.5)));
    for (int pose = (first_ + step - 1) / step * step; pose <= last_pose; pose += step) {
      svg_.Line(X(pose), y, X(pose), y + 4.0, "zero");
      svg_.Text(X(pose), y + 17.0, std::to_string(pose), "middle");
    }
    svg_.Text(kLeft - 6.0, y + 17.0, "pose", "end");
  }

  void DrawBand(double half_width) {
    svg_.Rectangle(kLeft, Y(half_width), kWidth, Y(-half_width) - Y(half_width), "band");
  }

  /// Points beyond the scale sit on its edge.
  void DrawPoints(const std::vector<Point>& points, std::string_view style) {
    for (const Point& point : points) svg_.Circle(X(point.pose), Y(point.value), 2.6, style);
  }
  void DrawCrosses(const std::vector<Point>& points) {
    for (const Point& point : points) svg_.Cross(X(point.pose), Y(point.value), 4.0, "rejected");
  }

 private:
  Svg& svg_;
  double middle_;
  double half_height_;
  int first_;
  double per_pose_;
  double range_;
};

double LargestOf(const std::vector<Point>& points) {
  double largest = 0.0;
  for (const Point& point : points) largest = std::max(largest, std::abs(point.value));
  return largest;
}

/// "accelerometer.sensitivity.xy" -> "accel S xy".
std::string ShortName(const std::string& parameter) {
  std::string name = parameter;
  const auto replace = [&](std::string_view from, std::string_view to) {
    if (const auto at = name.find(from); at != std::string::npos) name.replace(at, from.size(), to);
  };
  for (const Triad triad : kTriads) replace(TriadName(triad), TriadPrefix(triad));
  replace(".sensitivity.", " S ");
  replace(".bias.", " b ");
  replace("reference.", "");
  return name;
}

/// White at 0, blue towards +1, red towards -1.
std::string CorrelationColour(double rho) {
  constexpr std::array<int, 3> kPositive = {0x1f, 0x5f, 0xbf};
  constexpr std::array<int, 3> kNegative = {0xc6, 0x28, 0x28};
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string colour = "#";
  for (std::size_t i = 0; i < 3; ++i) {
    const int end = rho > 0.0 ? kPositive[i] : kNegative[i];
    const auto level =
        static_cast<std::size_t>(std::lround(255.0 + std::min(std::abs(rho), 1.0) * (end - 255)));
    colour += kHex[level / 16];
    colour += kHex[level % 16];
  }
  return colour;
}

}  // namespace

std::string LimitChart(const std::vector<LimitCheck>& limits) {
  if (limits.empty()) return "";
  constexpr double kLeft = 240.0;
  constexpr double kAllowed = 320.0;  // Length of what is allowed.
  constexpr double kRow = 24.0;
  constexpr double kBeyond = 0.2;  // Of what is allowed, on each side; what is worse ends here.
  Svg svg(740.0, 30.0 + kRow * static_cast<double>(limits.size()), "Worst value of each limit");
  constexpr double kFirst = kLeft + kBeyond * kAllowed;
  svg.Text(kFirst, 14.0, "lower", "middle");
  svg.Text(kFirst + kAllowed, 14.0, "upper", "middle");
  double y = 22.0;
  for (const LimitCheck& check : limits) {
    // A side that is open is as far from zero, or from the other limit, as that is from zero.
    const Limit& limit = check.limit;
    const double upper = std::isfinite(limit.upper)
                             ? limit.upper
                             : limit.lower + std::max(std::abs(limit.lower), 1.0);
    const double lower = std::isfinite(limit.lower) ? limit.lower : std::min(0.0, -upper);
    const auto x = [&](double value) {
      const double share = (value - lower) / (upper - lower);
      return kFirst + kAllowed * std::clamp(share, -kBeyond, 1.0 + kBeyond);
    };
    const double centre = y + kRow / 2.0;
    svg.Text(kLeft - 10.0, centre + 4.0, check.FullName(), "end");
    if (upper > lower && std::isfinite(check.worst)) {
      const std::string_view style = check.pass ? "pass" : "fail";
      svg.Rectangle(kLeft, y + 4.0, kAllowed * (1.0 + 2.0 * kBeyond), kRow - 8.0, "track");
      svg.Rectangle(x(check.worst) - 2.0, y + 4.0, 4.0, kRow - 8.0, style);
      if (check.sigma > 0.0) {
        svg.Line(x(check.worst - 2.0 * check.sigma),
                 centre,
                 x(check.worst + 2.0 * check.sigma),
                 centre,
                 "whisker");
      }
    }
    if (limit.target) svg.Line(x(*limit.target), y, x(*limit.target), y + kRow, "whisker");
    if (std::isfinite(limit.lower)) svg.Line(kFirst, y, kFirst, y + kRow, "limit");
    if (std::isfinite(limit.upper)) {
      svg.Line(kFirst + kAllowed, y, kFirst + kAllowed, y + kRow, "limit");
    }
    y += kRow;
  }
  return svg.Finish();
}

std::string ResidualChart(const Quality& quality, Triad triad, double sigma) {
  std::vector<Point> before;
  std::vector<Point> after;
  std::vector<Point> rejected;
  int first = std::numeric_limits<int>::max();
  int last = std::numeric_limits<int>::min();
  for (const PoseResidual& pose : quality.rests.pose_residuals) {
    if (pose.triad != triad) continue;
    first = std::min(first, pose.pose);
    last = std::max(last, pose.pose);
    if (std::isfinite(pose.norm_error_before))
      before.push_back({pose.pose, pose.norm_error_before});
    if (!std::isfinite(pose.norm_error)) continue;
    (pose.weight > 0.0 ? after : rejected).push_back({pose.pose, pose.norm_error});
  }
  if (after.empty() && rejected.empty()) return "";

  constexpr double kBeforeHeight = 90.0;
  constexpr double kAfterHeight = 170.0;
  constexpr double kTitle = 24.0;
  const std::string unit = TruthUnit(triad);
  double top = kTitle;
  const double height =
      kTitle + kAfterHeight + 24.0 + (before.empty() ? 0.0 : kBeforeHeight + kTitle + 8.0);
  Svg svg(750.0, height, TriadTitle(triad) + " norm error of each pose");
  const auto range_for = [](double largest) { return largest > 0.0 ? 1.1 * largest : 1.0; };
  if (!before.empty()) {
    Panel panel(svg, top, kBeforeHeight, first, last, range_for(LargestOf(before)));
    panel.DrawAxis(TriadTitle(triad) + ", before calibration [" + unit + "]");
    panel.DrawPoints(Thinned(before), "before");
    top += kBeforeHeight + kTitle + 8.0;
  }
  // The scale is that of the poses that count; a rejected one would flatten them.
  const double largest = std::max(LargestOf(after.empty() ? rejected : after), 2.2 * sigma);
  Panel panel(svg, top, kAfterHeight, first, last, range_for(largest));
  if (sigma > 0.0) panel.DrawBand(2.0 * sigma);
  panel.DrawAxis(TriadTitle(triad) + ", after calibration [" + unit + "]");
  panel.DrawPoints(Thinned(after), "after");
  panel.DrawCrosses(Thinned(rejected));
  panel.DrawPoseNumbers(last);
  return svg.Finish();
}

std::string CoverageChart(const Quality& quality, Triad triad) {
  std::vector<const PoseResidual*> poses;
  for (const PoseResidual& pose : quality.rests.pose_residuals) {
    if (pose.triad == triad && pose.direction.allFinite() && pose.direction.norm() > 0.5) {
      poses.push_back(&pose);
    }
  }
  if (poses.empty()) return "";
  constexpr double kRadius = 120.0;
  constexpr double kCentreY = 150.0;
  Svg svg(620.0, 300.0, TriadTitle(triad) + " pose directions on two hemispheres");
  // Lambert: equal areas of the sphere are equal areas of the disc, so crowding is real.
  const auto radius = [&](double height) { return kRadius * std::sqrt(1.0 - height); };
  const std::array<std::pair<double, std::string_view>, 2> discs = {
      {{150.0, "z up"}, {450.0, "z down (seen from above)"}}};
  for (const auto& [centre, title] : discs) {
    svg.Circle(centre, kCentreY, kRadius, "disc");
    for (const double height : {0.5, std::sqrt(0.75)}) {
      svg.Circle(centre, kCentreY, radius(height), "ring");
    }
    svg.Line(centre - kRadius, kCentreY, centre + kRadius, kCentreY, "ring");
    svg.Line(centre, kCentreY - kRadius, centre, kCentreY + kRadius, "ring");
    svg.Text(centre, kCentreY + kRadius + 20.0, title, "middle title");
    svg.Text(centre + kRadius + 5.0, kCentreY + 4.0, "+x", "start");
    svg.Text(centre, kCentreY - kRadius - 5.0, "+y", "middle");
  }
  const std::size_t stride = (poses.size() + kMaxPoints - 1) / kMaxPoints;
  for (std::size_t i = 0; i < poses.size(); i += stride) {
    const Eigen::Vector3d u = poses[i]->direction.normalized();
    const double across = std::hypot(u.x(), u.y());
    const double scale = across > 0.0 ? radius(std::abs(u.z())) / across : 0.0;
    const double x = discs[u.z() >= 0.0 ? 0 : 1].first + scale * u.x();
    const double y = kCentreY - scale * u.y();
    if (poses[i]->weight > 0.0) {
      svg.Circle(x, y, 3.4, "after");
    } else {
      svg.Cross(x, y, 4.0, "rejected");
    }
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

  constexpr double kCell = 15.0;
  constexpr double kCharacter = 6.0;  // width of one of the small font, at most
  const double side = kCell * static_cast<double>(count);
  const auto name = [&](Eigen::Index i) -> const std::string& {
    return covariance.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
  };
  std::size_t longest = 0;
  for (Eigen::Index i = 0; i < count; ++i) longest = std::max(longest, ShortName(name(i)).size());
  // Below the square the labels are turned by 60 degrees.
  const double label = kCharacter * static_cast<double>(longest) + 10.0;
  const double left = label;
  Svg svg(left + side + 0.5 * label + 10.0, side + 24.0 + label, "Correlation of the parameters");
  for (Eigen::Index i = 0; i < count; ++i) {
    const double y = 8.0 + kCell * static_cast<double>(i);
    svg.Text(left - 5.0, y + 0.75 * kCell, ShortName(name(i)), "end small");
    svg.RotatedText(left + kCell * (static_cast<double>(i) + 0.4),
                    side + 16.0,
                    60.0,
                    ShortName(name(i)),
                    "start small");
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::Index row = free[static_cast<std::size_t>(i)];
      const Eigen::Index column = free[static_cast<std::size_t>(j)];
      const double rho = matrix(row, column) / std::sqrt(matrix(row, row) * matrix(column, column));
      svg.Cell(left + kCell * static_cast<double>(j),
               y,
               kCell - 1.0,
               CorrelationColour(rho),
               name(i) + " with " + name(j) + ": " + Fixed(rho, 2));
    }
  }
  return svg.Finish();
}

}  // namespace truetriad
