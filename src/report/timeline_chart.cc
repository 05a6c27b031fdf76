// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "report/charts.h"
#include "report/svg.h"
#include "report/table.h"

namespace truetriad {
namespace {

/// A low panel as wide as a page. kTimelineRow: from a panel to the next one, with its title.
constexpr Frame::Box kTimelinePanel{.width = 670.0, .height = 62.0};
constexpr double kTimelineRow = kTimelinePanel.height + kLayout.below;
/// A rest or an interval left out is drawn at least this wide (user units), to be visible.
constexpr double kNarrowest = 0.5;

bool HasNumbers(const PoseSet& poses) { return poses.poses.size() <= kMostMarks; }

/// The rejected sensors and the reasons, by pose number.
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

/// The panels of one recording, one below the other with a common time axis.
class Timeline {
 public:
  Timeline(const PoseSet& poses, const std::vector<RejectedPose>& rejected, bool leads_to_rows)
      : poses_(poses), reasons_(ReasonsOf(rejected)), leads_to_rows_(leads_to_rows) {
    // Time zero is the recording's first reading, even if that reading was left out: `exclude:`
    // counts from it.
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
    const double last = kTimelinePanel.top + kTimelineRow * static_cast<double>(panels - 1);
    Svg svg(
        kLayout.width, last + kTimelinePanel.height + kLayout.bottom, "The recording over time");
    double top = kTimelinePanel.top;
    const auto next = [&](const std::string& title, const Range& values, bool has_values) {
      Frame frame(svg, BoxAt(top), time_, values);
      DrawRests(frame, top, &svg);
      for (const TimeRange& range : poses_.excluded) {
        DrawStretch(frame.X(SecondsOf(range.start_ns)),
                    frame.X(SecondsOf(range.end_ns)),
                    top,
                    "hole",
                    {},
                    &svg);
      }
      frame.Draw(title, top == last ? "s" : "", has_values);
      top += kTimelineRow;
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
        svg.Text(kTimelinePanel.left + kTimelinePanel.width - 30.0 + 15.0 * axis,
                 title_y,
                 letter,
                 "end " + letter);
        DrawTrace(*stream, axis, frame, &svg);
      }
      DrawFar(*stream, range, frame, &svg);
    }
    if (has_curve) {
      next("temperature of the rests, °C", degc_, true).DrawDots(temperatures_, "dots raw");
    }
    // Numbers are drawn on top of the readings.
    DrawNumbers(Frame(svg, kTimelinePanel, time_, {0.0, 1.0}), &svg);
    return svg.Finish();
  }

 private:
  static Frame::Box BoxAt(double top) {
    Frame::Box box = kTimelinePanel;
    box.top = top;
    return box;
  }

  static void DrawStretch(
      double from, double to, double top, std::string_view style, const Note& note, Svg* svg) {
    svg->Rectangle(from, top, std::max(to - from, kNarrowest), kTimelinePanel.height, style, note);
  }

  double SecondsOf(std::int64_t time_ns) const {
    return static_cast<double>(time_ns - start_ns_) * 1e-9;
  }

  /// The range of all readings. If a few slices lie far beyond all others, the range is that of the
  /// others only. The few slices are drawn at the edge with their values.
  Range RangeOf(const StreamSummary& stream) const {
    // If some slices reach beyond 30 times the range of the others, the others keep only 62/30 = 2
    // units of a panel. At each end up to three slices (three disturbances) may be so far out.
    constexpr double kFar = 30.0;
    const std::size_t few = 3;
    std::vector<double> extremes;
    for (const ReadingTrace::Slice& slice : poses_.traces[stream.triad].slices) {
      if (!HasReadings(slice)) continue;
      extremes.push_back(slice.lowest_raw.minCoeff());
      extremes.push_back(slice.highest_raw.maxCoeff());
    }
    if (extremes.empty()) return {0.0, 1.0};
    std::sort(extremes.begin(), extremes.end());
    const Range all{extremes.front(), extremes.back()};
    if (extremes.size() < 20 * few) return all;
    const Range most{extremes[few], extremes[extremes.size() - 1 - few]};
    const double far = kFar * (most.high - most.low);
    return far > 0.0 && std::max(all.high - most.high, most.low - all.low) > far ? most : all;
  }

  /// Writes the values of readings that are drawn at the edge, since they are beyond the range.
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

  /// Draws each slice from its lowest to its highest reading; slices at the same x are merged.
  void DrawTrace(const StreamSummary& stream, int axis, const Frame& frame, Svg* svg) const {
    constexpr double kApart = 2.0;  // Slices closer than this look like one line.
    const ReadingTrace& trace = poses_.traces[stream.triad];
    // The line is interrupted where readings are missing.
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
        spans.back().low = std::max(spans.back().low, span.low);  // Page y points down.
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

  /// If rests have no tooltips, two rests are merged if the gap between them is narrower than a
  /// line.
  void DrawRests(const Frame& frame, double top, Svg* svg) const {
    const bool says_each = leads_to_rows_ && HasNumbers(poses_);
    double begin = 0.0, end = -1.0;
    const auto flush = [&] {
      if (end >= begin) DrawStretch(begin, end, top, "rest", {}, svg);
    };
    for (const StaticPose& pose : poses_.poses) {
      const double from = frame.X(SecondsOf(pose.start_ns));
      const double to = frame.X(SecondsOf(pose.end_ns));
      if (says_each) {
        DrawStretch(from, to, top, "rest", {WordsOf(pose), pose.number}, svg);
      } else if (end >= begin && from - end < kNarrowest) {
        end = std::max(end, to);
      } else {
        flush();
        begin = from, end = to;
      }
    }
    flush();
  }

  /// Draws pose numbers where there is room. Every rejected pose gets a cross.
  void DrawNumbers(const Frame& frame, Svg* svg) const {
    const double apart = 3.5 * kLayout.letter;  // Room for three digits and a gap.
    double last = -apart, last_rejected = -apart;
    for (const StaticPose& pose : poses_.poses) {
      const double x = frame.X(0.5 * (SecondsOf(pose.start_ns) + SecondsOf(pose.end_ns)));
      const bool is_rejected = reasons_.contains(pose.number);
      if (is_rejected) svg->Cross(x, kTimelinePanel.top + 6.0, "rejected");
      if (!is_rejected && !HasNumbers(poses_)) continue;
      double* latest = is_rejected ? &last_rejected : &last;
      if (x - *latest < apart) continue;
      *latest = x;
      svg->Text(x,
                kTimelinePanel.top + (is_rejected ? 22.0 : kTimelinePanel.height - 4.0),
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
  // Several recordings have no common time.
  const bool has_times = poses.has_time && poses.duration_s > 0.0 && poses.sessions.empty();
  if (!has_times) return {};
  Timeline timeline(poses, rejected, leads_to_rows);
  if (timeline.IsEmpty()) return {};
  const std::string shaded = poses.sweep.temperature.empty() ? "rests" : "windows of the sweep";
  return {timeline.Draw(),
          "Range of the readings of each axis in each interval of time. Shaded: " + shaded +
              (HasNumbers(poses) ? ", with their numbers" : "") +
              "; crosses: rests with rejected readings; in another colour: intervals left out."};
}

}  // namespace truetriad
