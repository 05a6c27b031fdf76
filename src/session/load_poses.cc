// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "data/rows_in_time.h"
#include "io/known_motion_file.h"
#include "truetriad/base/units.h"
#include "truetriad/io/recording.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

Result<PoseSelection> SelectionOf(const PosesConfig& config) {
  PoseSelection selection;
  selection.kind = config.kind;
  selection.every = config.every;
  selection.sweep = config.sweep;
  const bool has_attitudes = config.kind == PoseSelectionKind::kSweep && !config.file.empty();
  if (config.kind == PoseSelectionKind::kRanges || has_attitudes) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<PoseRange> ranges, ReadPoseRanges(config.file));
    selection.ranges = std::move(ranges);
  }
  return selection;
}

/// The turns and rates that the experiment states.
Status SelectKnownMotions(const KnownMotionsConfig& config, PoseSelection* selection) {
  if (!config.turns_file.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<StatedTurn> turns,
                               ReadStatedTurns(config.turns_file,
                                               {config.turn_sigma_deg * kRadPerDeg,
                                                config.turn_axis_sigma_deg * kRadPerDeg}));
    for (const std::string& id : config.held_out_turns) {
      bool found = false;
      for (StatedTurn& turn : turns) {
        if (id != "all" && id != turn.id) continue;
        found = turn.held_out = true;
      }
      if (found) continue;
      return Error(ErrorCode::kNotInRecording,
                   "turns.held_out: `" + id + "` is not the id of a turn in " + config.turns_file);
    }
    selection->turns = std::move(turns);
  }
  if (!config.rates_file.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::vector<StatedRate> rates,
                               ReadStatedRates(config.rates_file,
                                               {config.rate_sigma_degps * kRadPerDeg,
                                                config.rate_axis_sigma_deg * kRadPerDeg,
                                                config.rate_axes_known}));
    selection->rates = std::move(rates);
  }
  return {};
}

/// Where a recording's poses are when nobody said: its manifest, its pose column, or detection.
/// `input` is empty where it is no file.
Result<PoseSelection> StatedSelection(const std::string& input, const RecordingInfo& info) {
  if (!input.empty()) {
    TRUETRIAD_ASSIGN_OR_RETURN(std::optional<PoseSelection> stated, ManifestPoseSelection(input));
    if (stated) return *std::move(stated);
  }
  PoseSelection selection;
  for (const StreamInfo& stream : info.streams) {
    if (stream.has_pose_column) selection.kind = PoseSelectionKind::kColumn;
  }
  return selection;
}

/// A table is already averaged: to find rests in it, or to take each row, is to read it as it is.
bool MayBeTable(const PosesConfig& config) {
  return config.kind == PoseSelectionKind::kDetect || config.kind == PoseSelectionKind::kEveryRow;
}

/// What can be said about the streams of a recording without any pose.
Result<PoseSet> DescribeStreams(const std::string& input,
                                const RecordingOpener& open,
                                const OpenRecordingOptions& options,
                                TimeStamps time_stamps) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, open(input, options));
  PoseSelection everything;
  everything.kind = PoseSelectionKind::kEveryN;
  everything.every = std::numeric_limits<std::int64_t>::max();
  everything.time_stamps = time_stamps;
  TRUETRIAD_ASSIGN_OR_RETURN(PoseSet set, CollectPoses(*source, everything));
  set.poses.clear();
  set.how = "static detection";
  set.static_share = 0.0;
  for (StreamSummary& stream : set.streams) {
    // Spread over motion, which is not noise.
    stream.noise_sigma_raw.setZero();
    stream.correlation_inflation.setOnes();
  }
  return set;
}

/// When a recording begins, whichever of its sensors is the first.
Result<std::int64_t> FirstTime(const std::string& input,
                               const RecordingOpener& open,
                               const OpenRecordingOptions& options) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, open(input, options));
  PerTriad<bool> has_begun{};
  std::size_t missing = source->info().streams.size();
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  std::vector<SampleBlock> blocks;
  while (missing > 0) {
    TRUETRIAD_ASSIGN_OR_RETURN(const bool more, source->Next(&blocks));
    if (!more) break;
    for (const SampleBlock& block : blocks) {
      if (block.time_ns.empty()) continue;
      first_ns = std::min(first_ns, block.time_ns.front());
      if (!std::exchange(has_begun[block.triad], true)) --missing;
    }
  }
  return first_ns;
}

Status SelectExcluded(const std::string& input,
                      const RecordingOpener& open,
                      const OpenRecordingOptions& options,
                      const PosesConfig& config,
                      bool has_time,
                      PoseSelection* selection) {
  if (config.exclude.empty()) return {};
  if (!has_time) {
    return ErrorIn(ErrorCode::kMissingTime,
                   config.exclude.front().stated_in,
                   input + " has no times; use `exclude_poses:`");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t first_ns, FirstTime(input, open, options));
  // To the end is what a time beyond any recording's means.
  const auto after_first_ns = [first_ns](double seconds) {
    constexpr double kLongestNs = 4.6e18;
    return first_ns + std::llround(std::min(1e9 * seconds, kLongestNs));
  };
  for (const ExcludedSeconds& range : config.exclude) {
    const TimeRange times{after_first_ns(range.from_s), after_first_ns(range.to_s)};
    selection->excluded.push_back({times, range.stated_in});
  }
  return {};
}

Result<LoadedPoses> LoadRecording(const std::string& input,
                                  const PosesConfig& config,
                                  const ProgressCallback& progress,
                                  const RecordingOpener& open,
                                  bool is_file) {
  const OpenRecordingOptions options{config.column, config.sweep.ambient, /*may_be_joined=*/true};
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, open(input, options));
  TRUETRIAD_ASSIGN_OR_RETURN(
      PoseSelection selection,
      config.given ? SelectionOf(config) : StatedSelection(is_file ? input : "", source->info()));

  selection.moves = config.moves;
  selection.time_offset_s = config.time_offset_s;
  selection.time_stamps = config.time_stamps;
  TRUETRIAD_RETURN_IF_ERROR(
      SelectExcluded(input, open, options, config, source->info().has_time, &selection));
  TRUETRIAD_RETURN_IF_ERROR(SelectKnownMotions(config.known_motions, &selection));
  LoadedPoses loaded;
  loaded.are_detected = selection.kind == PoseSelectionKind::kDetect;
  Result<PoseSet> poses = CollectPoses(*source, selection, {}, progress);
  if (!poses && poses.error().kind() == ErrorKind::kNotEnough) {
    loaded.not_enough = poses.error();
    poses = DescribeStreams(input, open, options, config.time_stamps);
  }
  TRUETRIAD_RETURN_IF_ERROR(poses);
  loaded.poses = *std::move(poses);
  if (!config.given && selection.kind == PoseSelectionKind::kEveryRow) {
    // A manifest that a converter wrote says it of a log, too.
    TRUETRIAD_RETURN_IF_ERROR(RejectRowsOfALog(loaded.poses));
  }
  if (auto finding = IgnoredColumns(source->info().ignored_columns)) {
    loaded.poses.findings.push_back(*std::move(finding));
  }
  loaded.inputs = source->inputs();
  for (const StreamInfo& stream : source->info().streams) {
    loaded.si_per_count[stream.triad] = stream.si_per_count;
  }
  return loaded;
}

Result<LoadedPoses> LoadTableOrRecording(const std::string& input,
                                         const PosesConfig& config,
                                         const ProgressCallback& progress,
                                         const RecordingOpener& opener) {
  if (opener) return LoadRecording(input, config, progress, opener, /*is_file=*/false);
  if (!MayBeTable(config)) return LoadRecording(input, config, progress, OpenRecording, true);
  TRUETRIAD_ASSIGN_OR_RETURN(const bool is_table, IsPoseTable(input));
  if (!is_table) return LoadRecording(input, config, progress, OpenRecording, true);
  TRUETRIAD_ASSIGN_OR_RETURN(PoseTable table, ReadPoseTable(input));
  if (!config.given) TRUETRIAD_RETURN_IF_ERROR(RejectRowsOfALog(table.poses));
  if (!config.exclude.empty()) {
    return ErrorIn(ErrorCode::kDoesNotMatch,
                   config.exclude.front().stated_in,
                   input + " is a pose table; use `exclude_poses:`");
  }
  LoadedPoses loaded;
  loaded.poses = std::move(table.poses);
  loaded.poses.rows_may_be_a_log = !config.given;
  loaded.inputs = std::move(table.inputs);
  PoseSelection selection;
  TRUETRIAD_RETURN_IF_ERROR(SelectKnownMotions(config.known_motions, &selection));
  if (!selection.turns.empty()) {
    return Error(ErrorCode::kDoesNotMatch,
                 {input},
                 "is a pose table, so turns cannot be integrated; give the recording "
                 "itself, or remove `turns:`");
  }
  TRUETRIAD_RETURN_IF_ERROR(TakeRates(selection.rates, &loaded.poses));
  return loaded;
}

}  // namespace

Result<LoadedPoses> LoadPoses(const std::string& input,
                              const PosesConfig& config,
                              const ProgressCallback& progress,
                              const RecordingOpener& opener) {
  Result<LoadedPoses> loaded = LoadTableOrRecording(input, config, progress, opener);
  if (loaded) {
    loaded->input = input;
    loaded->config = config;
  }
  return loaded;
}

bool IsMadeFrom(const Calibration& calibration, const std::vector<InputFile>& inputs) {
  const auto is_same = [](const InputFile& a, const InputFile& b) {
    // A manifest has no samples, and may describe other files of the same names.
    return a.samples > 0 && a.sha256 == b.sha256;
  };
  return std::find_first_of(calibration.inputs.begin(),
                            calibration.inputs.end(),
                            inputs.begin(),
                            inputs.end(),
                            is_same) != calibration.inputs.end();
}

Result<PosesConfig> ParsePoses(const std::string& text) {
  PosesConfig config;
  if (text.empty()) return config;
  config.given = true;
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  const std::string value = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (text == "detect") return config;
  if (text == "every_row") {
    config.kind = PoseSelectionKind::kEveryRow;
    return config;
  }
  if (kind == "every") {
    config.kind = PoseSelectionKind::kEveryN;
    const char* end = value.data() + value.size();
    const auto [stop, failure] = std::from_chars(value.data(), end, config.every);
    if (failure == std::errc() && stop == end && config.every >= 1) return config;
  }
  if (kind == "column" && !value.empty()) {
    config.kind = PoseSelectionKind::kColumn;
    config.column = value;
    return config;
  }
  if (kind == "file" && !value.empty()) {
    config.kind = PoseSelectionKind::kRanges;
    config.file = value;
    return config;
  }
  if (kind == "sweep") {
    config.kind = PoseSelectionKind::kSweep;
    if (colon == std::string::npos) return config;
    const char* end = value.data() + value.size();
    const auto [stop, failure] = std::from_chars(value.data(), end, config.sweep.window_s);
    if (failure == std::errc() && stop == end && config.sweep.window_s > 0.0) return config;
  }
  return Error(ErrorCode::kInvalidArgument,
               "--poses=" + text +
                   " is unknown; expected detect, every_row, every:N (N >= 1), column:NAME, "
                   "file:PATH, sweep or sweep:SECONDS");
}

}  // namespace truetriad
