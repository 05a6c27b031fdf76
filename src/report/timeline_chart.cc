// SPDX-License-Identifier: Apache-2.0
#include "report/timeline_chart.h"

#include <algorithm>
#include <set>
#include <utility>

#include "report/chart_frame.h"
#include "report/format.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr double kLeft = 66.0, kWidth = 670.0;

double SecondsOf(std::int64_t time_ns, const PoseSet& poses) {
  return static_cast<double>(time_ns - poses.start_ns) * 1e-9;
}

/// Rests, joined where what is between them is narrower than a line.
void DrawRests(const PoseSet& poses, const Frame& frame, double top, double height, Svg* svg) {
  constexpr double kNarrowest = 0.5;
  double begin = 0.0, end = -1.0;
  const auto flush = [&] {
    if (end >= begin) svg->Rectangle(begin, top, std::max(end - begin, kNarrowest), height, "rest");
  };
  for (const StaticPose& pose : poses.poses) {
    const double from = frame.X(SecondsOf(pose.start_ns, poses));
    const double to = frame.X(SecondsOf(pose.end_ns, poses));
    if (end >= begin && from - end < kNarrowest) {
      end = std::max(end, to);
      continue;
    }
    flush();
    begin = from, end = to;
  }
  flush();
}

/// Numbers of rests, as many as there is room for; of rejected ones all, in their colour.
void DrawNumbers(
    const PoseSet& poses, const std::set<int>& rejected, const Frame& frame, double y, Svg* svg) {
  constexpr double kApart = 22.0;
  double last = -kApart;
  for (const StaticPose& pose : poses.poses) {
    const double x =
        frame.X(0.5 * (SecondsOf(pose.start_ns, poses) + SecondsOf(pose.end_ns, poses)));
    if (rejected.contains(pose.number)) {
      svg->Cross(x, y + 18.0, 4.0, "rejected");
      svg->Text(x, y + 36.0, std::to_string(pose.number), "middle small");
    }
    if (x - last < kApart) continue;
    last = x;
    svg->Text(x, y, std::to_string(pose.number), "middle small");
  }
}

}  // namespace

std::string TimelineChart(const PoseSet& poses, const std::vector<RejectedPose>& rejected) {
  if (!poses.has_time || poses.poses.empty() || !(poses.duration_s > 0.0)) return "";
  Range time, degc;
  time.Add(0.0), time.Add(poses.duration_s);
  std::vector<std::pair<double, double>> temperatures;
  for (const StaticPose& pose : poses.poses) {
    time.Add(SecondsOf(pose.end_ns, poses));
    if (!pose.temperature_degc) continue;
    temperatures.emplace_back(SecondsOf(pose.start_ns, poses), *pose.temperature_degc);
    degc.Add(*pose.temperature_degc);
  }
  constexpr double kTop = 28.0, kStrip = 60.0, kBelow = 40.0, kCurve = 90.0;
  const bool has_curve = temperatures.size() > 1;
  Svg svg(
      750.0, kTop + kStrip + kBelow + (has_curve ? kCurve + 40.0 : 0.0), "The recording over time");
  Frame strip(svg, {kLeft, kTop, kWidth, kStrip}, time, {0.0, 1.0});
  DrawRests(poses, strip, kTop, kStrip, &svg);
  for (const TimeRange& range : poses.excluded) {
    const double from = strip.X(SecondsOf(range.start_ns, poses));
    const double to = strip.X(SecondsOf(range.end_ns, poses));
    svg.Rectangle(from, kTop, std::max(to - from, 0.5), kStrip, "hole");
  }
  strip.Draw("rests", "s", false);
  std::set<int> numbers;
  for (const RejectedPose& pose : rejected) numbers.insert(pose.pose);
  DrawNumbers(poses, numbers, strip, kTop + 14.0, &svg);
  if (has_curve) {
    Frame curve(svg, {kLeft, kTop + kStrip + kBelow + 24.0, kWidth, kCurve - 10.0}, time, degc);
    curve.Draw("temperature of the rests, °C", "");
    curve.DrawLine(temperatures, "line");
  }
  return svg.Finish();
}

}  // namespace truetriad
