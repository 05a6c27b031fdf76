// SPDX-License-Identifier: Apache-2.0
#include "truetriad/data/pose_collection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "data/clock_lags.h"
#include "data/detected_poses.h"
#include "data/given_poses.h"
#include "data/known_motions.h"
#include "data/move_recorder.h"
#include "data/pose_statistics.h"
#include "data/rest_movement.h"
#include "data/stream_checks.h"
#include "data/sweep_windows.h"

namespace truetriad {
namespace {

// The triad that decides what rests, and whose rows people are shown.
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

Status CheckCanDetect(const RecordingInfo& info, const StaticDetectorOptions& options) {
  if (!info.has_time) {
    return BadInputError(info.path +
                         ": has no time, so rests cannot be detected; add a time column, state the "
                         "rate in a manifest (`time: {unit: samples, rate_hz: 100}`), or state the "
                         "poses (`poses: every_row`, `poses: { every: 100 }`, …)");
  }
  if (!(options.min_duration_s > 0.0) || !(options.max_knock_s >= 0.0)) {
    return BadInputError("static detection: min_duration_s is " +
                         std::to_string(options.min_duration_s) + " and max_knock_s is " +
                         std::to_string(options.max_knock_s) +
                         "; expected a positive and a non-negative number");
  }
  return {};
}

Status CheckCanFollowMotion(const RecordingInfo& info) {
  if (!info.has_time) {
    return BadInputError(info.path +
                         ": has no time, so motion cannot be tracked; add a time column, or state "
                         "the rate in a manifest (`time: {unit: samples, rate_hz: 100}`)");
  }
  if (info.Find(Triad::kGyroscope) == nullptr || info.Find(Triad::kAccelerometer) == nullptr) {
    return BadInputError(info.path +
                         ": motion needs both gyroscope and accelerometer to track the attitude; "
                         "add the missing columns");
  }
  return {};
}

Status CheckTimeOffsets(const RecordingInfo& info, const PoseSelection& selection) {
  for (const Triad triad : kTriads) {
    if (selection.time_offset_s[triad] == 0.0 || info.has_time) continue;
    return BadInputError(info.path + ": a time offset of the " + std::string(TriadName(triad)) +
                         " is stated, but the recording has no time; remove `time_offset_s`, or "
                         "state the rate in a manifest (`time: {unit: samples, rate_hz: 100}`)");
  }
  return {};
}

// Puts the times of the triads' readings to when they were taken.
class TimeShift {
 public:
  explicit TimeShift(const PerTriad<double>& offset_s) {
    for (const Triad triad : kTriads) offset_ns_[triad] = std::llround(1e9 * offset_s[triad]);
  }

  // The new times stay until the next call.
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
    return BadInputError(info.path +
                         ": turns or rates are stated, but the recording has no gyroscope");
  }
  if (!selection.turns.empty() && !info.has_time) {
    return BadInputError(
        info.path +
        ": turns are stated, but the recording has no time to integrate them; add a time column, "
        "or state the rate in a manifest (`time: {unit: samples, rate_hz: 100}`)");
  }
  return {};
}

void AddToTrack(const SampleBlock& block, ReadingTrack* track) {
  track->time_ns.insert(track->time_ns.end(), block.time_ns.begin(), block.time_ns.end());
  for (std::size_t i = 0; i < block.x.size(); ++i) {
    track->reading_raw.emplace_back(block.x[i], block.y[i], block.z[i]);
  }
}

// A gyroscope is calibrated from rests and what lies between them: a log of readings has neither in
// its single rows, however many there are.
Status CheckRowsAreRests(const RecordingInfo& info,
                         const PoseSelection& selection,
                         std::size_t rows) {
  constexpr std::size_t kMostRests = 1000;
  if (selection.kind != PoseSelectionKind::kEveryRow || !selection.moves || !info.has_time ||
      rows <= kMostRests) {
    return {};
  }
  return BadInputError(info.path + ": `poses: every_row` gives more than " +
                       std::to_string(kMostRests) +
                       " rests, with no turns between them for the gyroscope; state `poses: { "
                       "detect: auto }` if the unit rests now and then, `poses: { motion: { "
                       "spacing_s: 0.1 } }` if it is tumbled, or disable the gyroscope");
}

// How the unit was moved, as its sensors saw it: " (the gyroscope read up to 3.2 rad/s)".
std::string MotionSeen(const PoseSet& set) {
  std::string seen;
  for (const Triad triad : {Triad::kGyroscope, Triad::kAccelerometer, Triad::kMagnetometer}) {
    const StreamSummary* stream = set.Find(triad);
    if (stream == nullptr || stream->samples == 0) continue;
    const double range = (stream->maximum_raw - stream->minimum_raw).maxCoeff();
    std::array<char, 64> number{};
    std::snprintf(number.data(), number.size(), "%.3g ", range);
    seen += (seen.empty() ? " (over it the " : ", the ") + std::string(TriadName(triad)) +
            "'s readings spread over " + number.data() + stream->unit.name;
  }
  return seen.empty() ? seen : seen + ")";
}

Error NoRestError(const PoseSet& set, const StaticDetectorOptions& options) {
  const bool has_both =
      set.Find(Triad::kGyroscope) != nullptr && set.Find(Triad::kAccelerometer) != nullptr;
  std::array<char, 64> duration{};
  std::snprintf(duration.data(), duration.size(), "%.1f s", set.duration_s);
  std::array<char, 64> least{};
  std::snprintf(least.data(), least.size(), "%g s", options.min_duration_s);
  return NotEnoughError(
      Finding(
          FindingCode::kNoRest,
          set.source + ": no rest found in " + duration.data() + MotionSeen(set) +
              "; expected poses with the unit still for at least " + least.data(),
          "hold each pose longer, or state the poses (`poses:`); for a unit tumbled on purpose, "
          "use `poses: { motion: { spacing_s: 0.1 } }`" +
              std::string(has_both ? "" : ", which needs gyroscope and accelerometer"))
          .With("duration", set.duration_s, "s")
          .With("shortest_rest", options.min_duration_s, "s"));
}

// Names the turns that tell nothing, those of one reason together.
void AddFaultsOfMoves(PoseSet* set) {
  constexpr std::size_t kNamed = 10;
  std::vector<std::pair<Finding, std::vector<const RecordedMove*>>> reasons;
  for (const RecordedMove& move : set->moves) {
    if (!move.fault) continue;
    const auto same = std::find_if(reasons.begin(), reasons.end(), [&move](const auto& reason) {
      return reason.first.text == move.fault->text;
    });
    if (same != reasons.end()) {
      same->second.push_back(&move);
    } else {
      reasons.push_back({*move.fault, {&move}});
    }
  }
  std::size_t unnamed = 0;
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    const auto& [fault, moves] = reasons[i];
    Finding finding = fault;
    finding.About(Triad::kGyroscope);
    if (i >= kNamed) {
      unnamed += moves.size();
      continue;
    }
    const auto number = [set](std::size_t pose) { return std::to_string(set->poses[pose].number); };
    if (moves.size() == 1) {
      const std::size_t from = moves.front()->from;
      finding.AtPose(set->poses[from].number);
      finding.text = "the turn from pose " + number(from) + " to pose " + number(from + 1) +
                     " is skipped: " + fault.text;
      set->findings.push_back(std::move(finding));
      continue;
    }
    std::string list;
    for (std::size_t k = 0; k < std::min(moves.size(), kNamed); ++k) {
      list += (k == 0 ? "" : ", ") + number(moves[k]->from);
    }
    if (moves.size() > kNamed) list += ", …";
    finding.With("turns", static_cast<double>(moves.size())).text =
        std::to_string(moves.size()) + " turns are skipped, those starting at poses " + list +
        ": " + fault.text;
    set->findings.push_back(std::move(finding));
  }
  if (unnamed > 0) {
    set->findings.push_back(
        Finding(reasons[kNamed].first.code,
                std::to_string(unnamed) + " more turns are skipped for similar reasons")
            .About(Triad::kGyroscope)
            .With("turns", static_cast<double>(unnamed)));
  }
}

}  // namespace

Result<PoseSet> CollectPoses(SampleSource& source,
                             const PoseSelection& selection,
                             const StaticDetectorOptions& options,
                             const ProgressCallback& progress) {
  const RecordingInfo& info = source.info();
  const bool detect = selection.kind == PoseSelectionKind::kDetect;
  const bool motion = selection.kind == PoseSelectionKind::kMotion;
  const std::optional<Triad> leading = LeadingTriad(info, selection.kind);
  if (!leading) return BadInputError(info.path + ": has no sensor columns");

  PerTriad<std::optional<StreamMonitor>> monitors;
  PerTriad<StreamMonitor*> monitor_of;
  for (const StreamInfo& stream : info.streams) {
    monitor_of[stream.triad] = &monitors[stream.triad].emplace(stream, info.has_time);
  }
  std::optional<DetectedPoses> detected;
  std::optional<GivenPoses> given;
  std::optional<SweepCutter> sweep;
  if (selection.kind == PoseSelectionKind::kSweep) {
    sweep.emplace(selection, info, *leading);
    TRUETRIAD_RETURN_IF_ERROR(sweep->Validate());
  } else if (detect) {
    TRUETRIAD_RETURN_IF_ERROR(CheckCanDetect(info, options));
    detected.emplace(options, info, monitor_of, *leading);
  } else if (motion) {
    TRUETRIAD_RETURN_IF_ERROR(CheckCanFollowMotion(info));
  } else {
    given.emplace(selection, info, *leading);
    TRUETRIAD_RETURN_IF_ERROR(given->Validate());
  }

  TRUETRIAD_RETURN_IF_ERROR(CheckTimeOffsets(info, selection));
  TRUETRIAD_RETURN_IF_ERROR(CheckKnownMotions(info, selection));
  RateMeans rates(selection.rates, info, *leading);
  TRUETRIAD_RETURN_IF_ERROR(rates.Validate());

  PoseSet set;
  const bool record_moves = (selection.moves || !selection.turns.empty()) && !motion && !sweep &&
                            info.has_time && info.Find(Triad::kGyroscope);
  MoveRecorder moves(*leading, SpansToKeep(selection));
  std::size_t rests_dropped = 0;
  const bool compares_clocks = info.has_time && !motion && !sweep && info.streams.size() > 1;
  ClockLagFinder clock_lags;

  TimeShift shift(selection.time_offset_s);
  std::vector<SampleBlock> blocks;
  while (true) {
    const Result<bool> more = source.Next(&blocks);
    if (!more) return more.error();
    if (!*more) break;
    shift.Apply(&blocks);
    for (const SampleBlock& block : blocks) {
      TRUETRIAD_RETURN_IF_ERROR(monitors[block.triad]->Add(block));
      if (record_moves) moves.Add(block);
      if (compares_clocks) clock_lags.Add(block);
      if (motion) AddToTrack(block, &set.tracks[block.triad]);
      if (sweep) sweep->Add(block);
    }
    if (detect) {
      TRUETRIAD_RETURN_IF_ERROR(detected->Add(blocks));
    } else if (given) {
      given->Add(blocks, monitors[*leading]->spacing_ns());
      TRUETRIAD_RETURN_IF_ERROR(CheckRowsAreRests(info, selection, given->poses().size()));
    }
    rates.Add(blocks, monitors[*leading]->spacing_ns());
    if (record_moves) {
      const std::vector<CollectedPose>& complete = detect ? detected->poses() : given->poses();
      while (rests_dropped < complete.size()) moves.DropRest(complete[rests_dropped++].pose);
      const std::optional<std::int64_t> judged_ns =
          detect ? detected->judged_before_ns() : given->judged_before_ns();
      if (judged_ns) moves.DropLongMove(*judged_ns);
    }
    if (progress) progress(source.progress());
  }
  if (monitors[*leading]->samples() == 0) {
    return BadInputError(info.Find(*leading)->file + ": has no readings of the " +
                         std::string(TriadName(*leading)) +
                         "; expected rows of numbers: check the columns and the separator");
  }

  set.source = info.path;
  set.serial = info.serial;
  set.has_time = info.has_time;
  set.time_offset_s = selection.time_offset_s;
  set.how = HowOf(selection);
  PerTriad<Eigen::Vector3d> resolution_raw;
  resolution_raw.items.fill(Eigen::Vector3d::Zero());
  std::int64_t first_ns = monitors[*leading]->first_ns(), last_ns = first_ns;
  for (const StreamInfo& stream : info.streams) {
    const StreamMonitor& monitor = *monitors[stream.triad];
    Result<StreamSummary> summary = monitor.Summary(source.counts(stream.triad));
    if (!summary) return summary.error();
    const Findings findings = monitor.Check(*summary);
    set.findings.insert(set.findings.end(), findings.begin(), findings.end());
    set.streams.push_back(*std::move(summary));
    resolution_raw[stream.triad] = monitor.resolution_raw();
    if (monitor.samples() == 0) continue;
    first_ns = std::min(first_ns, monitor.first_ns());
    last_ns = std::max(last_ns, monitor.last_ns());
    if (!monitor.has_temperature()) continue;
    const Eigen::Vector2d range = monitor.temperature_range_degc();
    set.temperature_range_degc =
        set.temperature_range_degc
            ? Eigen::Vector2d(std::min(range[0], (*set.temperature_range_degc)[0]),
                              std::max(range[1], (*set.temperature_range_degc)[1]))
            : range;
  }
  if (info.has_time) set.duration_s = static_cast<double>(last_ns - first_ns) * 1e-9;

  if (motion || sweep) {
    if (sweep) TRUETRIAD_RETURN_IF_ERROR(sweep->Finish(&set));
    if (progress) progress(1.0);
    return set;
  }
  Result<std::vector<CollectedPose>> collected =
      detect ? detected->Finish(&set.findings) : given->Finish(&set.findings);
  if (!collected) return collected.error();
  std::vector<PerTriad<TriadPoseMoments>> moments;
  for (CollectedPose& pose : *collected) {
    set.poses.push_back(std::move(pose.pose));
    moments.push_back(std::move(pose.moments));
  }
  if (set.poses.empty() && selection.rates.empty()) {
    if (detect) return NoRestError(set, options);
    return NotEnoughError(
        Finding(FindingCode::kNoPose, set.source + ": no row belongs to a pose (" + set.how + ")"));
  }
  FillCovariances(moments, resolution_raw, &set);
  const std::size_t before = set.poses.size();
  TRUETRIAD_RETURN_IF_ERROR(RemoveClippedPoses(resolution_raw, &moments, &set));
  if (set.poses.size() < before) FillCovariances(moments, resolution_raw, &set);

  for (std::size_t i = 0; i < set.poses.size(); ++i) {
    set.poses[i].number = static_cast<int>(i + 1);
  }
  if (compares_clocks) {
    const Findings lags = FindClockLags(clock_lags, &set);
    set.findings.insert(set.findings.end(), lags.begin(), lags.end());
  }
  if (RemoveMovingReadings(moments, &set)) FillCovariances(moments, resolution_raw, &set);
  TRUETRIAD_RETURN_IF_ERROR(rates.Finish(resolution_raw, &moments, &set));
  if (record_moves) {
    set.moves = moves.Moves(set);
    TRUETRIAD_RETURN_IF_ERROR(FinishTurns(selection, moves, &set));
  }

  double static_s = 0.0;
  for (std::size_t i = 0; i < set.poses.size(); ++i) {
    if (!info.has_time) set.poses[i].start_ns = set.poses[i].end_ns = 0;
    static_s += set.poses[i].duration_s();
  }
  if (set.duration_s > 0.0) set.static_share = std::min(1.0, static_s / set.duration_s);
  AddFaultsOfMoves(&set);
  if (progress) progress(1.0);
  return set;
}

}  // namespace truetriad
