// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "math/distributions.h"
#include "report/chart_frame.h"
#include "report/charts.h"
#include "report/content.h"
#include "report/format.h"
#include "report/svg.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

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
  // What is further off sits on the edge with its value, and does not flatten the others.
  constexpr double kFar = 3.0;  // Times where the furthest of so many should be.
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
  // Three low panels, one below the other, and beside them one as high as all.
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
              "used for "
              "the weights. Crosses: rejected poses, on the edge if beyond the scale. "
              "Right: " +
              (triad == Triad::kGyroscope ? "axes" : "lengths") +
              " in σ against the normal distribution, dashed if both agree; far ones on the edge "
              "with their value.",
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
