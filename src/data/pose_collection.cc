// SPDX-License-Identifier: Apache-2.0
#include "truetriad/data/pose_collection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "data/collector.h"
#include "data/detected_poses.h"
#include "data/even_source.h"
#include "data/given_poses.h"
#include "data/impossible_rows.h"
#include "data/stream_checks.h"
#include "data/sweep_windows.h"
#include "data/trace_recorder.h"
#include "model/mechanisms.h"

namespace truetriad {
namespace {

// The triad that decides on rests and whose rows appear in messages.
std::optional<Triad> LeadingTriad(const RecordingInfo& info, PoseSelectionKind kind) {
  constexpr std::array<Triad, 3> kOrder = {
      Triad::kAccelerometer, Triad::kMagnetometer, Triad::kGyroscope};
  if (kind == PoseSelectionKind::kColumn) {
    for (const Triad triad : kOrder) {
      const StreamInfo* stream = info.Find(triad);
      if (stream != nullptr && stream->has_pose_column) return triad;
    }
  }
  for (const Triad triad : kOrder) {
    if (info.Find(triad) != nullptr) return triad;
  }
  return std::nullopt;
}

std::string HowOf(const PoseSelection& selection) {
  switch (selection.kind) {
    case PoseSelectionKind::kDetect:
      return "static detection";
    case PoseSelectionKind::kEveryRow:
      return "every row";
    case PoseSelectionKind::kEveryN:
      return "every " + std::to_string(selection.every) + " rows";
    case PoseSelectionKind::kColumn:
      return "pose column";
    case PoseSelectionKind::kRanges:
      return "given row ranges";
    case PoseSelectionKind::kMotion:
      return "motion without rests";
    case PoseSelectionKind::kSweep:
      return "windows of a temperature sweep";
  }
  return "";
}

Status CheckTimeOffsets(const RecordingInfo& info, const PoseSelection& selection) {
  for (const Triad triad : kTriads) {
    if (selection.time_offset_s[triad] == 0.0 || info.has_time) continue;
    return NoTime(info,
                  "a time offset of the " + std::string(TriadName(triad)) + " has no effect",
                  ", or remove `time_offset_s`");
  }
  return {};
}

// Subtracts the stated offsets from the times of the triads.
class TimeShift {
 public:
  explicit TimeShift(const PerTriad<double>& offset_s) {
    for (const Triad triad : kTriads) offset_ns_[triad] = std::llround(1e9 * offset_s[triad]);
  }

  // The new times stay valid until the next call.
  void Apply(std::vector<SampleBlock>* blocks) {
    times_.resize(std::max(times_.size(), blocks->size()));
    for (std::size_t k = 0; k < blocks->size(); ++k) {
      SampleBlock& block = (*blocks)[k];
      const std::int64_t offset_ns = offset_ns_[block.triad];
      if (offset_ns == 0) continue;
      times_[k].assign(block.time_ns.begin(), block.time_ns.end());
      for (std::int64_t& time_ns : times_[k]) time_ns -= offset_ns;
      block.time_ns = times_[k];
    }
  }

 private:
  PerTriad<std::int64_t> offset_ns_;
  std::vector<std::vector<std::int64_t>> times_;
};

Status CheckKnownMotions(const RecordingInfo& info, const PoseSelection& selection) {
  if (selection.turns.empty() && selection.rates.empty()) return {};
  if (info.Find(Triad::kGyroscope) == nullptr) {
    return Error(ErrorCode::kMissingSensor,
                 {info.path},
                 "turns or rates are stated, but the recording has no gyroscope");
  }
  if (!selection.turns.empty() && !info.has_time) {
    return NoTime(info, "turns that are stated cannot be integrated");
  }
  return {};
}

std::unique_ptr<Collector> MakeCollector(const PoseSelection& selection,
                                         const StaticDetectorOptions& options,
                                         const RecordingInfo& info,
                                         const PerTriad<StreamMonitor*>& monitors,
                                         Triad leading) {
  std::unique_ptr<RestFinder> finder;
  RecordingInfo of_rests = info;
  std::erase_if(of_rests.streams,
                [&](const StreamInfo& stream) { return selection.Ignores(stream.triad); });
  StaticDetectorOptions detection = options;
  detection.has_turns = selection.moves;
  switch (selection.kind) {
    case PoseSelectionKind::kMotion:
      return MakeMotionCollector(info);
    case PoseSelectionKind::kSweep:
      return std::make_unique<SweepCutter>(selection, info, leading);
    case PoseSelectionKind::kDetect:
      finder = std::make_unique<DetectedPoses>(detection, of_rests, monitors, leading);
      break;
    case PoseSelectionKind::kEveryRow:
    case PoseSelectionKind::kEveryN:
    case PoseSelectionKind::kColumn:
    case PoseSelectionKind::kRanges:
      finder = std::make_unique<GivenPoses>(selection, of_rests, leading, *monitors[leading]);
      break;
  }
  return MakeRestCollector(std::move(finder), selection, info, monitors, leading);
}

// Fills in the fields of the set that describe the recording as a whole.
Status DescribeRecording(const SampleSource& source,
                         const PoseSelection& selection,
                         const EvenSource& even,
                         const PerTriad<StreamMonitor*>& monitors,
                         Triad leading,
                         PoseSet* set) {
  const RecordingInfo& info = source.info();
  set->source = info.path;
  set->serial = info.serial;
  set->tags = info.tags;
  set->has_time = info.has_time;
  std::int64_t first_ns = monitors[leading]->first_ns(), last_ns = first_ns;
  for (const StreamInfo& stream : info.streams) {
    if (selection.Ignores(stream.triad)) continue;
    const StreamMonitor& monitor = *monitors[stream.triad];
    TRUETRIAD_ASSIGN_OR_RETURN(StreamSummary summary, monitor.Summary(source.counts(stream.triad)));
    if (info.has_time) even.Describe(&summary, &set->findings);
    const Findings findings = monitor.Check(summary);
    set->findings.insert(set->findings.end(), findings.begin(), findings.end());
    set->streams.push_back(summary);
    if (monitor.samples() == 0) continue;
    first_ns = std::min(first_ns, monitor.first_ns());
    last_ns = std::max(last_ns, monitor.last_ns());
    if (!monitor.has_temperature()) continue;
    const Eigen::Vector2d range = monitor.temperature_range_degc();
    const Eigen::Vector2d before = set->temperature_range_degc.value_or(range);
    set->temperature_range_degc = {std::min(range[0], before[0]), std::max(range[1], before[1])};
  }
  set->start_ns = first_ns;
  if (info.has_time) set->duration_s = static_cast<double>(last_ns - first_ns) * 1e-9;
  return {};
}

// If the temperature is exactly 0 degC or 0 K throughout, drops it: the thermometer is disconnected
// or the column empty, and the calibration would be attributed to this temperature.
void DropDeadTemperature(PoseSet* set) {
  if (!set->temperature_range_degc || !set->sweep.temperature.empty()) return;
  const double lowest = (*set->temperature_range_degc)[0];
  const double highest = (*set->temperature_range_degc)[1];
  if (lowest != highest || (lowest != 0.0 && lowest != kAbsoluteZeroDegc)) return;
  if (!Acts(Mechanism::kDeadTemperature)) return;
  set->temperature_range_degc.reset();
  for (StaticPose& pose : set->poses) pose.temperature_degc.reset();
  for (KnownRate& rate : set->rates) rate.means.temperature_degc.reset();
  set->findings.emplace_back(FindingCode::kTemperatureMissing,
                             "the temperature reads 0 throughout, so it is treated as not recorded",
                             "correct the column, or remove it");
}

}  // namespace

Result<PoseSet> CollectPoses(SampleSource& source,
                             const PoseSelection& stated,
                             const StaticDetectorOptions& options,
                             const ProgressCallback& progress) {
  const RecordingInfo& info = source.info();
  const std::optional<Triad> leading = LeadingTriad(info, stated.kind);
  if (!leading) return Error(ErrorCode::kMissingSensor, {info.path}, "has no sensor columns");
  PoseSelection selection = stated;
  if (selection.Ignores(*leading)) selection.ignores_gyroscope = false;

  PerTriad<std::optional<StreamMonitor>> monitors;
  PerTriad<StreamMonitor*> monitor_of;
  PerTriad<TraceRecorder> recorders;
  for (const StreamInfo& stream : info.streams) {
    monitor_of[stream.triad] =
        &monitors[stream.triad].emplace(stream, info.has_time, selection.excluded);
  }
  const std::unique_ptr<Collector> collector =
      MakeCollector(selection, options, info, monitor_of, *leading);
  TRUETRIAD_RETURN_IF_ERROR(collector->Validate());
  TRUETRIAD_RETURN_IF_ERROR(CheckTimeOffsets(info, selection));
  TRUETRIAD_RETURN_IF_ERROR(CheckKnownMotions(info, selection));

  ExcludedTime excluded(selection.excluded);
  EvenSource even(&source, &excluded, selection.time_stamps);
  ImpossibleRows impossible;
  TimeShift shift(selection.time_offset_s);
  std::vector<SampleBlock> blocks;
  for (bool more = true; more;) {
    TRUETRIAD_ASSIGN_OR_RETURN(more, even.Next(&blocks));
    if (more) {
      if (info.has_time) {
        // Traces also show the rows that are left out afterwards as error words.
        for (const SampleBlock& block : blocks) recorders[block.triad].Add(block);
      }
      impossible.Apply(&blocks);
    } else {
      impossible.Flush(&blocks);
    }
    shift.Apply(&blocks);
    for (const SampleBlock& block : blocks) {
      TRUETRIAD_RETURN_IF_ERROR(monitor_of[block.triad]->Add(block));
    }
    TRUETRIAD_RETURN_IF_ERROR(collector->Add(blocks));
    if (progress) progress(source.progress());
  }
  if (monitor_of[*leading]->samples() == 0) {
    return Error(ErrorCode::kNoReadings,
                 info.Find(*leading)->file + ": has no readings of the " +
                     std::string(TriadName(*leading)) +
                     (selection.excluded.empty()
                          ? "; expected rows of numbers: check the columns and the separator"
                          : " outside of what `exclude` leaves out"));
  }

  PoseSet set;
  set.time_offset_s = selection.time_offset_s;
  set.how = HowOf(selection);
  for (const StreamInfo& stream : info.streams) {
    ReadingTrace& trace = set.traces[stream.triad] = recorders[stream.triad].Take();
    trace.start_ns -= std::llround(1e9 * selection.time_offset_s[stream.triad]);
  }
  set.findings = impossible.Left();
  set.excluded = excluded.Left();
  TRUETRIAD_RETURN_IF_ERROR(excluded.Tell(info, &set.findings));
  TRUETRIAD_RETURN_IF_ERROR(DescribeRecording(source, selection, even, monitor_of, *leading, &set));
  set.joints = source.joints();
  TRUETRIAD_RETURN_IF_ERROR(collector->Finish(&set));
  DropDeadTemperature(&set);
  if (progress) progress(1.0);
  return set;
}

}  // namespace truetriad
