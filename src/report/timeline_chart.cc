// SPDX-License-Identifier: Apache-2.0
#include "report/timeline_chart.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "report/chart_frame.h"
#include "report/format.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr double kLeft = 66.0, kWidth = 670.0;
constexpr double kTop = 42.0;  // Numbers and crosses stand above.
constexpr double kPanel = 62.0, kTitle = 24.0, kTimes = 34.0;
/// So many rests say what each is; more are too narrow to be met.
constexpr std::size_t kMostStretches = 150;

bool HasNumbers(const PoseSet& poses) { return poses.poses.size() <= kMostStretches; }

/// Rejected sensors and why, by pose.
using Reasons = std::map<int, std::string>;

Reasons ReasonsOf(const std::vector<RejectedPose>& rejected) {
  Reasons reasons;
  for (const RejectedPose& pose : rejected) {
    std::string& text = reasons[pose.pose];
    text += "; " + std::string(TriadName(pose.triad)) + " rejected: " + pose.reason;
  }
  return reasons;
}

bool HasReadings(const ReadingTrace::Slice& slice) {
  return slice.lowest_raw[0] <= slice.highest_raw[0];
}

/// The panels of one recording, one below the other over the same time.
class Timeline {
 public:
  Timeline(const PoseSet& poses, const std::vector<RejectedPose>& rejected, bool leads_to_rows)
      : poses_(poses), reasons_(ReasonsOf(rejected)), leads_to_rows_(leads_to_rows) {
    // Zero is the recording's first reading, left out or not: `exclude:` counts from it.
    start_ns_ = poses.start_ns;
    for (const TimeRange& range : poses.excluded) start_ns_ = std::min(start_ns_, range.start_ns);
    for (const TimeRange& range : poses.excluded) time_.Add(SecondsOf(range.end_ns));
    time_.Add(0.0), time_.Add(SecondsOf(poses.start_ns) + poses.duration_s);
    for (const StaticPose& pose : poses.poses) {
      time_.Add(SecondsOf(pose.end_ns));
      if (!pose.temperature_degc) continue;
      temperatures_.emplace_back(SecondsOf(pose.start_ns), *pose.temperature_degc);
      degc_.Add(*pose.temperature_degc);
    }
    for (const StreamSummary& stream : poses.streams) {
      if (!poses.traces[stream.triad].slices.empty()) traced_.push_back(&stream);
    }
  }

  bool IsEmpty() const { return traced_.empty() && poses_.poses.empty(); }

  std::string Draw() {
    const bool has_curve = temperatures_.size() > 1;
    const std::size_t panels = std::max<std::size_t>(traced_.size(), 1) + (has_curve ? 1 : 0);
    const double height = kTop + static_cast<double>(panels) * (kPanel + kTitle) + kTimes - kTitle;
    Svg svg(750.0, height, "The recording over time");
    std::size_t left = panels;
    double top = kTop;
    const auto next = [&](const std::string& title, const Range& values, bool has_values) {
      Frame frame(svg, {kLeft, top, kWidth, kPanel}, time_, values);
      DrawRests(frame, top, &svg);
      DrawLeftOut(frame, top, &svg);
      frame.Draw(title, --left == 0 ? "s" : "", has_values);
      top += kPanel + kTitle;
      return frame;
    };
    if (traced_.empty()) next("rests", {0.0, 1.0}, false);
    for (const StreamSummary* stream : traced_) {
      const double title_y = top - 8.0;
      const Range range = RangeOf(*stream);
      const Frame frame =
          next(std::string(TriadName(stream->triad)) + ", " + DisplayUnit(stream->unit.name),
               range,
               true);
      for (int axis = 0; axis < 3; ++axis) {
        const std::string letter{AxisLetter(axis)};
        svg.Text(kLeft + kWidth - 30.0 + 15.0 * axis, title_y, letter, "end " + letter);
        DrawTrace(*stream, axis, frame, &svg);
      }
      DrawFar(*stream, range, frame, &svg);
    }
    if (has_curve) {
      next("temperature of the rests, °C", degc_, true).DrawDots(temperatures_, "dots raw");
    }
    // On top of the readings.
    DrawNumbers(Frame(svg, {kLeft, kTop, kWidth, kPanel}, time_, {0.0, 1.0}), &svg);
    return svg.Finish();
  }

 private:
  double SecondsOf(std::int64_t time_ns) const {
    return static_cast<double>(time_ns - start_ns_) * 1e-9;
  }

  /// That of all readings, unless a few slices alone are far beyond all others: those sit on the
  /// edge, with their values.
  Range RangeOf(const StreamSummary& stream) const {
    constexpr double kFar = 30.0;  // Times the range of nearly all others.
    constexpr std::size_t kFew = 3;
    std::vector<double> extremes;
    for (const ReadingTrace::Slice& slice : poses_.traces[stream.triad].slices) {
      if (!HasReadings(slice)) continue;
      extremes.push_back(slice.lowest_raw.minCoeff());
      extremes.push_back(slice.highest_raw.maxCoeff());
    }
    if (extremes.empty()) return {0.0, 1.0};
    std::sort(extremes.begin(), extremes.end());
    const Range all{extremes.front(), extremes.back()};
    if (extremes.size() < 20 * kFew) return all;
    const Range most{extremes[kFew], extremes[extremes.size() - 1 - kFew]};
    const double far = kFar * (most.high - most.low);
    return far > 0.0 && std::max(all.high - most.high, most.low - all.low) > far ? most : all;
  }

  /// Values of readings that are drawn on the edge since they are beyond the range.
  void DrawFar(const StreamSummary& stream,
               const Range& range,
               const Frame& frame,
               Svg* svg) const {
    const Range drawn = range.Padded();
    const ReadingTrace& trace = poses_.traces[stream.triad];
    for (std::size_t i = 0; i < trace.slices.size(); ++i) {
      const ReadingTrace::Slice& slice = trace.slices[i];
      if (!HasReadings(slice)) continue;
      const double time_s =
          SecondsOf(trace.start_ns + static_cast<std::int64_t>(i) * trace.slice_ns);
      const auto say = [&](double value) {
        svg->Text(frame.X(time_s) + 4.0,
                  frame.Y(value) + (value > drawn.high ? 10.0 : -3.0),
                  Significant(value, 3),
                  "start small far");
      };
      if (slice.highest_raw.maxCoeff() > drawn.high) say(slice.highest_raw.maxCoeff());
      if (slice.lowest_raw.minCoeff() < drawn.low) say(slice.lowest_raw.minCoeff());
    }
  }

  /// Each slice as high as its readings; slices that are drawn at one place together.
  void DrawTrace(const StreamSummary& stream, int axis, const Frame& frame, Svg* svg) const {
    constexpr double kApart = 2.0;
    const ReadingTrace& trace = poses_.traces[stream.triad];
    // Where readings are missing, no line is drawn.
    const double gap_s = stream.rate_hz > 0.0 ? 5.0 / stream.rate_hz : 0.0;
    const double slice_s = 1e-9 * static_cast<double>(trace.slice_ns);
    double last_s = 0.0;
    std::vector<Svg::Span> spans;
    const auto flush = [&] {
      if (!spans.empty()) svg->Zigzag(spans, std::string("trace ") + AxisLetter(axis));
      spans.clear();
    };
    for (std::size_t i = 0; i < trace.slices.size(); ++i) {
      const ReadingTrace::Slice& slice = trace.slices[i];
      if (!HasReadings(slice)) continue;
      const double time_s = SecondsOf(trace.start_ns) + (static_cast<double>(i) + 0.5) * slice_s;
      const double x = kApart * std::round(frame.X(time_s) / kApart);
      const Svg::Span span{x, frame.Y(slice.lowest_raw[axis]), frame.Y(slice.highest_raw[axis])};
      if (!spans.empty() && time_s - last_s > gap_s + 2.0 * slice_s &&
          x - spans.back().x > 2.0 * kApart) {
        flush();
      }
      last_s = time_s;
      if (!spans.empty() && spans.back().x == x) {
        spans.back().low = std::max(spans.back().low, span.low);  // Of the page, whose y is down.
        spans.back().high = std::min(spans.back().high, span.high);
      } else {
        spans.push_back(span);
      }
    }
    flush();
  }

  std::string WordsOf(const StaticPose& pose) const {
    std::string words = "pose " + std::to_string(pose.number) + ": " +
                        Fixed(SecondsOf(pose.start_ns), 1) + " to " +
                        Fixed(SecondsOf(pose.end_ns), 1) + " s";
    if (pose.temperature_degc) words += ", " + Fixed(*pose.temperature_degc, 1) + " °C";
    const auto found = reasons_.find(pose.number);
    return found == reasons_.end() ? words : words + found->second;
  }

  /// Many are joined where what is between them is narrower than a line.
  void DrawRests(const Frame& frame, double top, Svg* svg) const {
    constexpr double kNarrowest = 0.5;
    const bool says_each = leads_to_rows_ && HasNumbers(poses_);
    double begin = 0.0, end = -1.0;
    const auto flush = [&] {
      if (end < begin) return;
      svg->Rectangle(begin, top, std::max(end - begin, kNarrowest), kPanel, "rest");
    };
    for (const StaticPose& pose : poses_.poses) {
      const double from = frame.X(SecondsOf(pose.start_ns));
      const double to = frame.X(SecondsOf(pose.end_ns));
      if (says_each) {
        svg->Stretch(
            from, top, std::max(to - from, kNarrowest), kPanel, "rest", pose.number, WordsOf(pose));
        continue;
      }
      if (end >= begin && from - end < kNarrowest) {
        end = std::max(end, to);
        continue;
      }
      flush();
      begin = from, end = to;
    }
    flush();
  }

  void DrawLeftOut(const Frame& frame, double top, Svg* svg) const {
    for (const TimeRange& range : poses_.excluded) {
      const double from = frame.X(SecondsOf(range.start_ns));
      const double to = frame.X(SecondsOf(range.end_ns));
      svg->Rectangle(from, top, std::max(to - from, 0.5), kPanel, "hole");
    }
  }

  /// As many as there is room for; of rejected ones all, with a cross.
  void DrawNumbers(const Frame& frame, Svg* svg) const {
    constexpr double kApart = 22.0;
    double last = -kApart, last_rejected = -kApart;
    for (const StaticPose& pose : poses_.poses) {
      const double x = frame.X(0.5 * (SecondsOf(pose.start_ns) + SecondsOf(pose.end_ns)));
      const bool is_rejected = reasons_.contains(pose.number);
      if (is_rejected) svg->Cross(x, kTop + 6.0, 4.0, "rejected");
      if (!is_rejected && !HasNumbers(poses_)) continue;
      double* latest = is_rejected ? &last_rejected : &last;
      if (x - *latest < kApart) continue;
      *latest = x;
      svg->Text(x,
                kTop + (is_rejected ? 22.0 : kPanel - 4.0),
                std::to_string(pose.number),
                "middle small halo");
    }
  }

  const PoseSet& poses_;
  std::int64_t start_ns_ = 0;
  Reasons reasons_;
  bool leads_to_rows_;
  Range time_, degc_;
  std::vector<std::pair<double, double>> temperatures_;
  std::vector<const StreamSummary*> traced_;
};

}  // namespace

Drawing TimelineDrawing(const PoseSet& poses,
                        const std::vector<RejectedPose>& rejected,
                        bool leads_to_rows) {
  // Several recordings have no time in common.
  const bool has_times = poses.has_time && poses.duration_s > 0.0 && poses.sessions.empty();
  if (!has_times) return {};
  Timeline timeline(poses, rejected, leads_to_rows);
  if (timeline.IsEmpty()) return {};
  const std::string shaded = poses.sweep.temperature.empty() ? "rests" : "windows of the sweep";
  return {
      timeline.Draw(),
      "In each stretch of time every axis from its lowest to its highest reading. Shaded: " +
          shaded + (HasNumbers(poses) ? ", with their numbers" : "") +
          "; crosses: those with readings that the calibration rejects; in another colour: left "
          "out."};
}

}  // namespace truetriad
