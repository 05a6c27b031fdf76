// SPDX-License-Identifier: Apache-2.0
#include "report/charts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "math/distributions.h"
#include "model/heading_error.h"
#include "report/content.h"
#include "report/svg.h"
#include "report/table.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// The interval of values that the bar of a limit covers. Two limits are its ends. If there is one
/// limit (`lower` may be infinite), the interval is wide enough to show the value.
Range ShownOf(const LimitCheck& check, double lower) {
  const double upper = check.limit.upper;
  if (std::isfinite(lower) && std::isfinite(upper) && lower < upper) return {lower, upper};
  const double alone = std::isfinite(upper) ? upper : lower;
  const double room = std::isfinite(upper) ? upper - check.worst : check.worst - lower;
  // A value beyond the limit is outside by 1/6 of `reach` at most, less than LimitLayout::beyond.
  double reach =
      std::max({std::abs(alone), 4.0 * check.sigma, room > 0.0 ? 1.25 * room : -6.0 * room});
  if (!(reach > 0.0) || !std::isfinite(reach)) reach = 1.0;
  return {std::isfinite(upper) ? alone - reach : alone,
          std::isfinite(lower) ? alone + reach : alone};
}

/// The sizes of a chart of limits in user units. Names stand above the bars to fit a telephone.
struct LimitLayout {
  double left = 16.0;      ///< A bar begins here, beyond the lower limit.
  double allowed = 240.0;  ///< The length of the allowed interval.
  double beyond = 0.2;     ///< Bars extend beyond the allowed interval by this share of its length.
  double name = 15.0;      ///< Height of a name.
  double bar = 16.0;
  double row = 39.0;  ///< A name, its bar and the gap to the next name.
  double first = left + beyond * allowed;
  double end = first + allowed * (1.0 + beyond);
};
constexpr LimitLayout kBars;

/// The bar of one limit.
class LimitBar {
 public:
  LimitBar(const LimitCheck& check, double top, Svg* svg)
      : check_(check), top_(top), centre_(top + kBars.bar / 2.0), svg_(*svg) {
    // The bar of a quantity that is never negative begins at zero.
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

  /// The guard band: the values that are inside a limit by less than k σ. It is drawn taller than
  /// the bar, which would otherwise hide a narrow band.
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
    // A value beyond the drawn range is marked by an arrow.
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
          "Worst value for each limit (bar) with ±2σ (line), compared with the limit. A guard "
          "band, if one is set, is shown in another colour."};
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
  // Very large differences are drawn at the edge with their value, so that smaller differences stay
  // visible.
  const double far = std::max(20.0, 3.0 * sizes[sizes.size() / 2]);
  const double largest = std::max(4.0, std::min(sizes.back(), far) + 1.0);
  const auto count = static_cast<double>(shown.size());
  const Frame::Box box{.left = 270.0,  // Room for the name of a parameter.
                       .top = 10.0,
                       .width = 440.0,
                       .height = kLayout.cell * count};
  Svg svg(kLayout.width, box.top + box.height + kLayout.bottom, "Differences in σ");
  Frame frame(svg, box, {-largest, largest}, {-count, 1.0});
  const double all = 2.0 * count + 2.0;  // Outside the frame; clamped to its edge.
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
          "Each difference in units of its σ, with ±1 σ (line). Shaded: ±2 σ, where 95 of 100 "
          "differences lie if only chance causes them."};
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

  constexpr double kWhite = 0.02;  // Smaller correlations are too pale to see.
  const double side = kLayout.cell * static_cast<double>(count);
  const auto name = [&](Eigen::Index i) -> const std::string& {
    return covariance.parameters[static_cast<std::size_t>(free[static_cast<std::size_t>(i)])];
  };
  std::size_t longest = 0;
  for (Eigen::Index i = 0; i < count; ++i) longest = std::max(longest, name(i).size());
  const double width = side + kLayout.letter * static_cast<double>(longest) + 10.0;
  Svg svg(width, side + kLayout.cell, "Correlation of the parameters");
  // Each name stands once, on the diagonal where its row and column meet.
  for (Eigen::Index i = 0; i < count; ++i) {
    const double y = std::floor(kLayout.cell * (static_cast<double>(i) + 0.5));
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
      svg.Cells({{kLayout.cell * static_cast<double>(j), y}},
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
  // The error at heading 0° is repeated at 360°, so that the line covers the full circle.
  errors.push_back(errors.front());
  errors.back().heading_rad = 360.0 / kDegPerRad;
  Panel raw{"raw heading, error, °", "heading, °", {}, {0.0, 0.0}};
  Panel corrected{"corrected heading, ±2σ, °", "heading, °", {{.kind = Series::Kind::kBand}}};
  for (const HeadingError& error : errors) {
    const double heading = kDegPerRad * error.heading_rad;
    corrected.series[0].Add(heading, 0.0, 2.0 * kDegPerRad * error.sigma_rad);
    if (!error.raw_rad) continue;
    const double raw_deg = kDegPerRad * *error.raw_rad;
    // If the error passes ±180°, a new line begins at the other edge of the chart.
    if (raw.series.empty() || std::abs(raw_deg - raw.series.back().points.back().second) > 180.0) {
      raw.series.push_back({.style = "line"});
    }
    raw.series.back().Add(heading, raw_deg);
  }
  return {Chart("Heading error round the compass", {raw, corrected}),
          "Heading error of a level unit turned through 360°; the accelerometer gives the tilt. "
          "Raw: error of the raw readings. Corrected: error expected from the σ of the "
          "parameters."};
}

namespace {

/// σ of a pose's residual along each axis, from the noise used for its weight. True unit.
Eigen::Vector3d AxisSigmas(const TriadCalibration& sensor) {
  const Eigen::Matrix3d spread = sensor.model.Correction() * sensor.noise.sigma.asDiagonal();
  const double excess = sensor.noise.excess_sigma;
  return (spread.rowwise().squaredNorm().array() + excess * excess).sqrt();
}

/// The residuals of one sensor's poses.
class Residuals {
 public:
  Residuals(const std::vector<PoseResidual>& poses,
            const std::optional<TriadCalibration>& sensor,
            Triad triad)
      : triad_(triad) {
    for (const PoseResidual& pose : poses) {
      if (pose.triad == triad && pose.residual.allFinite()) poses_.push_back(&pose);
    }
    if (sensor) sigma_ = AxisSigmas(*sensor);
    if (!sigma_.allFinite()) sigma_.setZero();
  }

  bool empty() const { return poses_.empty(); }
  double Sigma(int axis) const { return sigma_[axis]; }

  Range PoseRange() const {
    Range range;
    for (const PoseResidual* pose : poses_) range.Add(pose->pose);
    return range;
  }

  /// Only the poses used determine the range: with a rejected pose, the other residuals would look
  /// flat.
  Range ValueRange(int axis) const {
    double largest = 3.3 * sigma_[axis];
    for (const PoseResidual* pose : poses_) {
      if (pose->weight > 0.0) largest = std::max(largest, std::abs(pose->residual[axis]));
    }
    if (!(largest > 0.0)) largest = 1.0;
    return {-largest, largest};
  }

  void DrawAxis(int axis, Frame* frame, Svg* svg) const {
    const std::string unit = TruthUnit(triad_);
    Points dots;
    for (const PoseResidual* pose : poses_) {
      const double value = pose->residual[axis];
      if (!(pose->weight > 0.0)) {
        DrawRejected(*pose, value, *frame, svg);
      } else if (poses_.size() <= kMostMarks) {
        svg->Circle(
            frame->X(pose->pose),
            frame->Y(value),
            kLayout.dot,
            "after",
            {"pose " + std::to_string(pose->pose) + ": " + Significant(value, 3) + ' ' + unit,
             pose->pose});
      } else {
        dots.emplace_back(pose->pose, value);
      }
    }
    frame->DrawDots(dots, "dots");
  }

  /// The residuals of the poses used, each in σ of its noise, ascending.
  std::vector<double> Normalized() const {
    std::vector<double> values;
    for (const PoseResidual* pose : poses_) {
      if (!(pose->weight > 0.0)) continue;
      if (triad_ != Triad::kGyroscope) {
        // The σ of the length is the σ of the axes along the direction of the reading.
        const double sigma = pose->direction.cwiseProduct(sigma_).norm();
        if (sigma > 0.0) values.push_back(pose->norm_error / sigma);
        continue;
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (sigma_[axis] > 0.0) values.push_back(pose->residual[axis] / sigma_[axis]);
      }
    }
    std::sort(values.begin(), values.end());
    return values;
  }

 private:
  void DrawRejected(const PoseResidual& pose, double value, const Frame& frame, Svg* svg) const {
    const double x = frame.X(pose.pose), y = frame.Y(value);
    svg->Cross(x, y, "rejected");
    svg->Text(x + 5.0, y + (value > 0.0 ? 9.0 : -2.0), std::to_string(pose.pose), "start small");
  }

  Triad triad_;
  std::vector<const PoseResidual*> poses_;
  Eigen::Vector3d sigma_ = Eigen::Vector3d::Zero();
};

void DrawNormalPlot(const std::vector<double>& values, const Frame::Box& box, Svg* svg) {
  if (values.size() < 3) return;
  Points points;
  Range both;
  const auto count = static_cast<double>(values.size());
  // Residuals beyond `far` are drawn at the edge with their value, so that the other residuals do
  // not look flat.
  constexpr double kFar = 3.0;  // Times the expected largest of `count` values.
  const double far = kFar * NormalQuantile((count - 0.5) / count);
  for (std::size_t i = 0; i < values.size(); ++i) {
    points.emplace_back(NormalQuantile((static_cast<double>(i) + 0.5) / count), values[i]);
    both.Add(std::clamp(values[i], -far, far)), both.Add(points.back().first);
  }
  Frame frame(*svg, box, both, both);
  frame.Draw("in σ, against normal", "normal quantile");
  frame.DrawLine({{both.low, both.low}, {both.high, both.high}}, "limit");
  frame.DrawDots(points, "dots");
  if (values.back() > far) frame.DrawFar(points.back().first, values.back(), values.back(), true);
  if (values.front() < -far) {
    frame.DrawFar(points.front().first, values.front(), values.front(), false);
  }
}

}  // namespace

Drawing ResidualDrawing(const std::vector<PoseResidual>& poses,
                        const std::optional<TriadCalibration>& sensor,
                        Triad triad) {
  const Residuals residuals(poses, sensor, triad);
  if (residuals.empty()) return {};
  // Three low panels stand one below the other. Beside them is a panel as high as all three
  // together.
  constexpr Frame::Box kPanel{.width = 430.0, .height = 76.0};
  const double row = kPanel.height + kLayout.below, all = 2.0 * row + kPanel.height;
  const std::string title = TriadTitle(triad);
  Svg svg(kLayout.width, kPanel.top + all + kLayout.bottom, title + ": residual of each pose");
  const Range numbers = residuals.PoseRange();
  for (int axis = 0; axis < 3; ++axis) {
    Frame::Box box = kPanel;
    box.top += row * axis;
    Frame frame(svg, box, numbers, residuals.ValueRange(axis));
    if (const double reach = 3.0 * residuals.Sigma(axis); reach > 0.0) {
      svg.Rectangle(box.left, frame.Y(reach), box.width, frame.Y(-reach) - frame.Y(reach), "band");
    }
    frame.Draw(title + ' ' + AxisLetter(axis) + ", " + TruthUnit(triad), axis == 2 ? "pose" : "");
    residuals.DrawAxis(axis, &frame, &svg);
  }
  DrawNormalPlot(residuals.Normalized(), {560.0, kPanel.top, 190.0, all}, &svg);
  return {svg.Finish(),
          title +
              ": residual of each axis, C(y − b) minus the prediction. Shaded: ±3σ of the noise "
              "used for the weights. Crosses: rejected poses, on the edge if beyond the scale. "
              "Right: " +
              (triad == Triad::kGyroscope ? "axes" : "lengths") +
              " in σ against the normal distribution; normal errors lie on the dashed line. Errors "
              "beyond the scale are on its edge, with their value.",
          std::string(TriadName(triad))};
}

Drawing TurnDrawing(const RestQuality& quality) {
  Panel found{"known turns, found − stated, °",
              "turn",
              {{Series::Kind::kBars}, {Series::Kind::kDots, "dots"}}};
  for (std::size_t i = 0; i < quality.turns.size(); ++i) {
    const TurnCheck& turn = quality.turns[i];
    if (!turn.fault.empty()) continue;
    const auto number = static_cast<double>(i + 1);
    const double difference = kDegPerRad * (turn.found_rad - turn.stated_rad);
    found.series[0].Add(number, difference, 2.0 * kDegPerRad * turn.found_sigma_rad);
    found.series[1].Add(number, difference);
  }
  Panel unseen{"held-out turns, error, °", "turn", {{Series::Kind::kDots, "dots"}}, {0.0, 0.0}};
  if (quality.held_out && quality.held_out->turns) {
    double number = 0.0;
    for (const double error_rad : quality.held_out->turns->errors_rad) {
      unseen.series[0].Add(number += 1.0, kDegPerRad * error_rad);
    }
  }
  std::string caption;
  if (!found.series[0].points.empty()) caption = "Known turns: found minus stated, ±2σ. ";
  if (!unseen.series[0].points.empty()) {
    caption += "Error of gravity's direction after each turn, by a calibration without that turn.";
  }
  return {Chart("Turns: predicted against found", {found, unseen}), caption};
}

}  // namespace truetriad
