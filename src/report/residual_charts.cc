// SPDX-License-Identifier: Apache-2.0
#include "report/residual_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "math/distributions.h"
#include "report/chart_frame.h"
#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

constexpr std::size_t kMostPoints = 600;
/// So many poses have a mark each, which says what it is.
constexpr std::size_t kMostMarks = 150;

using Points = std::vector<std::pair<double, double>>;

/// At most kMostPoints: of each run of neighbours the smallest and the largest stay, so that the
/// extremes, which are what one looks for, are never lost.
Points Thinned(const Points& points) {
  if (points.size() <= kMostPoints) return points;
  constexpr std::size_t kRuns = kMostPoints / 2;
  Points kept;
  for (std::size_t run = 0; run < kRuns; ++run) {
    const auto at = [&](std::size_t i) {
      return points.begin() + static_cast<std::ptrdiff_t>(i * points.size() / kRuns);
    };
    const auto [low, high] = std::minmax_element(
        at(run), at(run + 1), [](const auto& a, const auto& b) { return a.second < b.second; });
    kept.push_back(*std::min(low, high));
    if (low != high) kept.push_back(*std::max(low, high));
  }
  return kept;
}

/// σ of each axis of a pose's residual by the noise that weighted it, true unit.
Eigen::Vector3d AxisSigmas(const TriadCalibration& sensor) {
  const Eigen::Matrix3d spread = sensor.model.Correction() * sensor.noise.sigma.asDiagonal();
  const double excess = sensor.noise.excess_sigma;
  return (spread.rowwise().squaredNorm().array() + excess * excess).sqrt();
}

/// One sensor's poses.
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

  /// The scale is that of the poses that count; a rejected one would flatten them.
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
        svg->Mark(frame->X(pose->pose),
                  frame->Y(value),
                  "after",
                  pose->pose,
                  "pose " + std::to_string(pose->pose) + ": " + Significant(value, 3) + ' ' + unit);
      } else {
        dots.emplace_back(pose->pose, value);
      }
    }
    if (!dots.empty()) frame->DrawDots(Thinned(dots), "dots");
  }

  /// Each in σ of its noise, ascending; those that count.
  std::vector<double> Normalized() const {
    std::vector<double> values;
    for (const PoseResidual* pose : poses_) {
      if (!(pose->weight > 0.0)) continue;
      if (triad_ != Triad::kGyroscope) {
        // Of the length: that of the axes along which the reading lies.
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
    svg->Cross(x, y, 3.5, "rejected");
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
  // What is further off sits on the edge with its value, and does not flatten the others.
  constexpr double kFar = 3.0;
  const double far = kFar * NormalQuantile((count - 0.5) / count);
  for (std::size_t i = 0; i < values.size(); ++i) {
    points.emplace_back(NormalQuantile((static_cast<double>(i) + 0.5) / count), values[i]);
    both.Add(std::clamp(values[i], -far, far)), both.Add(points.back().first);
  }
  Frame frame(*svg, box, both, both);
  frame.Draw("in σ, against normal", "normal quantile");
  frame.DrawLine({{both.low, both.low}, {both.high, both.high}}, "limit");
  frame.DrawDots(Thinned(points), "dots");
  if (values.back() > far) {
    svg->Text(frame.X(points.back().first) - 6.0,
              frame.Y(values.back()) + 4.0,
              Significant(values.back(), 3),
              "far end");
  }
  if (values.front() < -far) {
    svg->Text(frame.X(points.front().first) + 6.0,
              frame.Y(values.front()) + 4.0,
              Significant(values.front(), 3),
              "far start");
  }
}

}  // namespace

std::string ResidualChart(const std::vector<PoseResidual>& poses,
                          const std::optional<TriadCalibration>& sensor,
                          Triad triad) {
  const Residuals residuals(poses, sensor, triad);
  if (residuals.empty()) return "";
  constexpr double kLeft = 70.0, kTop = 26.0, kHeight = 76.0, kGap = 24.0;
  Svg svg(760.0,
          kTop + 3.0 * kHeight + 2.0 * kGap + 36.0,
          TriadTitle(triad) + ": residual of each pose");
  const Range numbers = residuals.PoseRange();
  for (int axis = 0; axis < 3; ++axis) {
    Frame frame(svg,
                {kLeft, kTop + axis * (kHeight + kGap), 430.0, kHeight},
                numbers,
                residuals.ValueRange(axis));
    if (residuals.Sigma(axis) > 0.0) frame.DrawBand(3.0 * residuals.Sigma(axis));
    frame.Draw(TriadTitle(triad) + ' ' + AxisLetter(axis) + ", " + TruthUnit(triad),
               axis == 2 ? "pose" : "");
    residuals.DrawAxis(axis, &frame, &svg);
  }
  DrawNormalPlot(residuals.Normalized(), {560.0, kTop, 190.0, 3.0 * kHeight + 2.0 * kGap}, &svg);
  return svg.Finish();
}

std::string ResidualCaption(Triad triad) {
  return TriadTitle(triad) +
         ": what is left of each axis, C(y - b) less the prediction. Shaded: ±3σ of the noise used "
         "for the weights. Crosses: rejected poses, on the edge if beyond the scale. Right: " +
         (triad == Triad::kGyroscope ? "axes" : "lengths") +
         " in σ against the normal distribution, dashed if both agree; far ones on the edge with "
         "their value.";
}

std::string TurnCaption(const RestQuality& quality) {
  const bool has_stated = std::any_of(quality.turns.begin(),
                                      quality.turns.end(),
                                      [](const auto& turn) { return turn.fault.empty(); });
  return std::string(has_stated ? "Known turns: found less stated, ±2σ. " : "") +
         (quality.held_out && quality.held_out->turns
              ? "Error of gravity's direction after each turn, by a calibration that had not seen "
                "it."
              : "");
}

std::string TurnChart(const RestQuality& quality) {
  Points found;
  Range numbers, differences;
  for (std::size_t i = 0; i < quality.turns.size(); ++i) {
    const TurnCheck& turn = quality.turns[i];
    if (!turn.fault.empty()) continue;
    const double difference = kDegPerRad * (turn.found_rad - turn.stated_rad);
    const double sigma = kDegPerRad * turn.found_sigma_rad;
    found.emplace_back(static_cast<double>(i + 1), difference);
    numbers.Add(found.back().first);
    differences.Add(difference + 2.0 * sigma), differences.Add(difference - 2.0 * sigma);
  }
  Points held_out;
  Range turns, errors;
  if (quality.held_out && quality.held_out->turns) {
    for (const double error_rad : quality.held_out->turns->errors_rad) {
      held_out.emplace_back(static_cast<double>(held_out.size() + 1), kDegPerRad * error_rad);
      turns.Add(held_out.back().first), errors.Add(held_out.back().second);
    }
    errors.Add(0.0);
  }
  if (found.empty() && held_out.empty()) return "";
  Svg svg(760.0, 260.0, "Turns: predicted against found");
  if (!found.empty()) {
    Frame frame(svg, {}, numbers, differences);
    frame.Draw("known turns, found − stated, °", "turn");
    std::size_t i = 0;
    for (const auto& [number, difference] : found) {
      while (!quality.turns[i].fault.empty()) ++i;
      frame.DrawErrorBar(number, difference, 2.0 * kDegPerRad * quality.turns[i++].found_sigma_rad);
    }
    frame.DrawDots(found, "dots");
  }
  if (!held_out.empty()) {
    Frame frame(svg, {found.empty() ? 66.0 : 446.0, 28.0, 290.0, 190.0}, turns, errors);
    frame.Draw("turns predicted unseen, error, °", "turn");
    frame.DrawDots(Thinned(held_out), "dots");
  }
  return svg.Finish();
}

}  // namespace truetriad
