// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include "data/rows_in_time.h"
#include "io/known_motion_file.h"
#include "io/text_file.h"
#include "problem/session_block.h"
#include "session/steps.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/io/recording.h"

namespace truetriad {
namespace {

/// Opens the recording from its beginning.
using Opener = std::function<Result<std::unique_ptr<SampleSource>>()>;

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
        if (id == "all" || id == turn.id) found = turn.held_out = true;
      }
      if (!found) {
        return Error(
            ErrorCode::kNotInRecording,
            "turns.held_out: `" + id + "` is not the id of a turn in " + config.turns_file);
      }
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

/// How the poses of a recording are found if the experiment does not state it: as the manifest or a
/// pose column states; without either, by detection. `input` is empty if the recording is not a
/// file.
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

/// Returns the description of a recording's streams, without poses.
Result<PoseSet> DescribeStreams(const Opener& open, TimeStamps time_stamps) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, open());
  PoseSelection everything;
  everything.kind = PoseSelectionKind::kEveryN;
  everything.every = std::numeric_limits<std::int64_t>::max();
  everything.time_stamps = time_stamps;
  TRUETRIAD_ASSIGN_OR_RETURN(PoseSet set, CollectPoses(*source, everything));
  set.poses.clear();
  set.how = "static detection";
  set.static_share = 0.0;
  for (StreamSummary& stream : set.streams) {
    // The scatter of the streams contains motion and is not noise.
    stream.noise_sigma_raw.setZero();
    stream.correlation_inflation.setOnes();
  }
  return set;
}

/// The earliest time of any sensor in the recording.
Result<std::int64_t> FirstTime(const Opener& open) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<SampleSource> source, open());
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
                      const Opener& open,
                      const PosesConfig& config,
                      bool has_time,
                      PoseSelection* selection) {
  if (config.exclude.empty()) return {};
  if (!has_time) {
    return ErrorIn(ErrorCode::kMissingTime,
                   config.exclude.front().stated_in,
                   input + " has no times, which `exclude:` counts; use `exclude_poses:`");
  }
  TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t first_ns, FirstTime(open));
  const auto after_first_ns = [first_ns](double seconds) {
    // Half the range of int64, so that the sum cannot overflow, yet after the end of any recording.
    constexpr double kLongestNs = 4.6e18;
    return first_ns + std::llround(std::min(1e9 * seconds, kLongestNs));
  };
  for (const ExcludedSeconds& range : config.exclude) {
    selection->excluded.push_back(
        {{after_first_ns(range.from_s), after_first_ns(range.to_s)}, range.stated_in});
  }
  return {};
}

/// A digest of one sensor's readings in their order. It does not depend on how they are split into
/// blocks. Times are left out, since a rewritten log may count its times from another zero.
class ReadingsDigest {
 public:
  void Add(std::span<const double> x, std::span<const double> y, std::span<const double> z) {
    // The constants keep a reading of zero from making a product zero. A sum of products takes only
    // 1 ns per reading, since no product has to wait for another one, as in a chain.
    constexpr std::uint64_t kPlace = 0x9E3779B97F4A7C15, kX = 0xA0761D6478BD642F,
                            kY = 0xE7037ED1A0B428DB, kZ = 0x8EBC6AF09C88C6E3;
    for (std::size_t i = 0; i < x.size(); ++i) {
      place_ += kPlace;
      sum_ +=
          Folded(place_, BitsOf(x[i]) ^ kX) + Folded(BitsOf(y[i]) ^ place_ ^ kY, BitsOf(z[i]) ^ kZ);
    }
    count_ += static_cast<std::int64_t>(x.size());
  }
  std::int64_t count() const { return count_; }
  std::string Text() const {
    return Sha256Hex(std::to_string(sum_) + "," + std::to_string(count_)).substr(0, 16);
  }

 private:
  static std::uint64_t BitsOf(double value) {
    return std::bit_cast<std::uint64_t>(value + 0.0);  // Makes -0 equal to 0.
  }
  static std::uint64_t Folded(std::uint64_t one, std::uint64_t other) {
    __extension__ using Wide = unsigned __int128;
    const Wide product = Wide{one} * other;
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64U);
  }

  std::uint64_t place_ = 0, sum_ = 0;
  std::int64_t count_ = 0;
};

std::vector<SensorReadings> TextsOf(const PerTriad<ReadingsDigest>& digests) {
  std::vector<SensorReadings> readings;
  for (const Triad triad : kTriads) {
    if (digests[triad].count() == 0) continue;
    readings.push_back({std::string(TriadName(triad)), digests[triad].Text()});
  }
  return readings;
}

/// A source that also computes a digest of the first `most` readings of each sensor.
class DigestedSource : public SampleSource {
 public:
  explicit DigestedSource(std::unique_ptr<SampleSource> source,
                          std::int64_t most = std::numeric_limits<std::int64_t>::max())
      : source_(std::move(source)), most_(most) {}

  const RecordingInfo& info() const override { return source_->info(); }
  Result<bool> Next(std::vector<SampleBlock>* blocks) override {
    Result<bool> more = source_->Next(blocks);
    for (const SampleBlock& block : *blocks) {
      ReadingsDigest& digest = digests_[block.triad];
      const std::size_t count = std::min<std::uint64_t>(
          block.x.size(), static_cast<std::uint64_t>(most_ - digest.count()));
      digest.Add(block.x.first(count), block.y, block.z);
    }
    return more;
  }
  double progress() const override { return source_->progress(); }
  StreamCounts counts(Triad triad) const override { return source_->counts(triad); }
  std::vector<RecordingJoint> joints() const override { return source_->joints(); }
  std::vector<InputFile> inputs() const override { return source_->inputs(); }

  /// Whether some sensor has fewer than `most` readings so far.
  bool WantsMore() const {
    return std::ranges::any_of(info().streams, [this](const StreamInfo& stream) {
      return digests_[stream.triad].count() < most_;
    });
  }
  std::vector<SensorReadings> readings() const { return TextsOf(digests_); }

 private:
  std::unique_ptr<SampleSource> source_;
  std::int64_t most_;
  PerTriad<ReadingsDigest> digests_{};
};

std::vector<SensorReadings> ReadingsOfTable(const PoseSet& table) {
  PerTriad<ReadingsDigest> digests{};
  for (const StaticPose& pose : table.poses) {
    for (const Triad triad : kTriads) {
      if (!pose.triads[triad]) continue;
      const Eigen::Vector3d& mean = pose.triads[triad]->mean_raw;
      digests[triad].Add({&mean.x(), 1}, {&mean.y(), 1}, {&mean.z(), 1});
    }
  }
  return TextsOf(digests);
}

Result<LoadedPoses> LoadRecording(const std::string& input,
                                  const PosesConfig& config,
                                  const ProgressCallback& progress,
                                  const RecordingOpener& opener) {
  const OpenRecordingOptions options{config.column, config.sweep.ambient, /*may_be_joined=*/true};
  const Opener open = [&] {
    return opener ? opener(input, options) : OpenRecording(input, options);
  };
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<SampleSource> opened, open());
  const auto source = std::make_unique<DigestedSource>(std::move(opened));
  TRUETRIAD_ASSIGN_OR_RETURN(
      PoseSelection selection,
      config.given ? SelectionOf(config) : StatedSelection(opener ? "" : input, source->info()));
  selection.moves = config.moves;
  selection.ignores_gyroscope = config.ignores_gyroscope;
  selection.time_offset_s = config.time_offset_s;
  selection.time_stamps = config.time_stamps;
  TRUETRIAD_RETURN_IF_ERROR(
      SelectExcluded(input, open, config, source->info().has_time, &selection));
  TRUETRIAD_RETURN_IF_ERROR(SelectKnownMotions(config.known_motions, &selection));
  LoadedPoses loaded;
  loaded.are_detected = selection.kind == PoseSelectionKind::kDetect;
  loaded.are_rows = selection.kind == PoseSelectionKind::kEveryRow;
  Result<PoseSet> poses = CollectPoses(*source, selection, {}, progress);
  if (!poses && poses.error().kind() == ErrorKind::kNotEnough) {
    loaded.not_enough = poses.error();
    poses = DescribeStreams(open, config.time_stamps);
  }
  TRUETRIAD_RETURN_IF_ERROR(poses);
  loaded.poses = *std::move(poses);
  if (!config.given && selection.kind == PoseSelectionKind::kEveryRow) {
    // The manifest of a converter may state that every row is a pose, even if the file is a log.
    TRUETRIAD_RETURN_IF_ERROR(RejectRowsOfALog(loaded.poses));
  }
  if (auto finding = IgnoredColumns(source->info().ignored_columns)) {
    loaded.poses.findings.push_back(*std::move(finding));
  }
  loaded.inputs = source->inputs();
  loaded.readings = source->readings();
  for (const StreamInfo& stream : source->info().streams) {
    loaded.si_per_count[stream.triad] = stream.si_per_count;
  }
  return loaded;
}

Result<LoadedPoses> LoadTable(const std::string& input, const PosesConfig& config) {
  TRUETRIAD_ASSIGN_OR_RETURN(PoseTable table, ReadPoseTable(input));
  if (!config.given) TRUETRIAD_RETURN_IF_ERROR(RejectRowsOfALog(table.poses));
  if (!config.exclude.empty()) {
    return ErrorIn(ErrorCode::kDoesNotMatch,
                   config.exclude.front().stated_in,
                   input + " is a pose table; use `exclude_poses:`");
  }
  LoadedPoses loaded;
  loaded.readings = ReadingsOfTable(table.poses);
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

/// Rejects keys that have a meaning in one recording only.
Status CheckOneRecordingKeys(const Experiment& experiment) {
  if (experiment.inputs.size() > kMaxSessions) {
    return Error(ErrorCode::kInvalidExperiment,
                 std::to_string(experiment.inputs.size()) + " recordings; expected at most " +
                     std::to_string(kMaxSessions))
        .About("input");
  }
  const PosesConfig& poses = experiment.poses;
  struct Rule {
    bool is_broken;
    const char *key, *what, *instead;
  };
  for (const Rule& rule : {
           Rule{poses.kind == PoseSelectionKind::kMotion || poses.kind == PoseSelectionKind::kSweep,
                "poses",
                "with `motion` or `sweep` applies to one recording only",
                "give one recording, or calibrate from rests"},
           Rule{poses.kind == PoseSelectionKind::kRanges,
                "poses",
                "names rows of one file",
                "state `poses:` in the manifest of each"},
           Rule{!poses.exclude.empty(),
                "exclude",
                "counts seconds of one recording",
                "use `exclude_poses:`"},
           Rule{!poses.known_motions.turns_file.empty(),
                "turns",
                "are given by poses, rows or times of one recording",
                "give one recording, or remove the key"},
           Rule{!poses.known_motions.rates_file.empty(),
                "rates",
                "are given by poses, rows or times of one recording",
                "give one recording, or remove the key"},
       }) {
    if (!rule.is_broken) continue;
    return Error(ErrorCode::kInvalidExperiment,
                 std::string("`") + rule.key + "` " + rule.what +
                     ", but `input` lists several recordings; " + rule.instead)
        .About(rule.key);
  }
  return {};
}

/// Rejects a session whose `si_per_count` differs from that of the first one.
Status CheckCountSizes(const LoadedPoses& first, const LoadedPoses& more) {
  for (const StreamSummary& stream : more.poses.streams) {
    const StreamSummary* other = first.poses.Find(stream.triad);
    if (other == nullptr || first.si_per_count[stream.triad] == more.si_per_count[stream.triad]) {
      continue;
    }
    return Error(ErrorCode::kDoesNotMatch,
                 {more.poses.source},
                 "`si_per_count` of the " + std::string(TriadName(stream.triad)) +
                     " differs from that of " + first.poses.source +
                     "; all sessions are of one device, so state the same value");
  }
  return {};
}

// The number of poses of `one` whose means equal those of a pose of `other`, so that they are the
// same readings.
int SharedPoses(const PoseSet& one, const PoseSet& other) {
  // Chosen: means of fewer quantised readings can be equal by chance.
  constexpr int kFewestSamples = 10;
  int shared = 0;
  for (const StaticPose& a : one.poses) {
    shared += static_cast<int>(
        std::any_of(other.poses.begin(), other.poses.end(), [&](const StaticPose& b) {
          bool is_same = false;
          for (const Triad triad : kTriads) {
            const auto &in_a = a.triads[triad], &in_b = b.triads[triad];
            if (!in_a || !in_b || in_a->samples < kFewestSamples) continue;
            if (in_a->mean_raw != in_b->mean_raw || in_a->samples != in_b->samples) return false;
            is_same = true;
          }
          return is_same;
        }));
  }
  return shared;
}

// Error: the last session repeats an earlier one, wholly or in part.
Status CheckAreDifferent(const std::vector<PoseSet>& sessions,
                         const std::vector<std::string>& inputs) {
  // Chosen: one or two poses may agree by chance.
  constexpr int kNoChance = 3;
  const PoseSet& last = sessions.back();
  const int most = std::clamp(static_cast<int>(last.poses.size()), 1, kNoChance);
  for (std::size_t k = 0; k + 1 < sessions.size(); ++k) {
    const int shared = SharedPoses(last, sessions[k]);
    if (shared < most) continue;
    return Error(ErrorCode::kConflictingArguments,
                 {inputs[sessions.size() - 1]},
                 "has readings of " + inputs[k] + " (" + std::to_string(shared) +
                     " poses are the same to the last digit), so it is not another session; "
                     "give each recording once");
  }
  return {};
}

// Whether `read` is the same as the result of reading `input` with `config`.
bool IsAskedFor(const LoadedPoses& read, const std::string& input, PosesConfig config) {
  // Without a gyroscope, no readings between the poses are kept, whatever `moves` is.
  if (read.poses.Find(Triad::kGyroscope) == nullptr) config.moves = read.config.moves;
  return read.input == input && read.config == config;
}

}  // namespace

Result<LoadedPoses> LoadPoses(const std::string& input,
                              const PosesConfig& config,
                              const ProgressCallback& progress,
                              const RecordingOpener& opener) {
  // Rows of a pose table are already means, so detection and `every_row` read them in the same way.
  Result<bool> is_table = false;
  if (!opener &&
      (config.kind == PoseSelectionKind::kDetect || config.kind == PoseSelectionKind::kEveryRow)) {
    is_table = IsPoseTable(input);
  }
  TRUETRIAD_RETURN_IF_ERROR(is_table);
  TRUETRIAD_ASSIGN_OR_RETURN(
      LoadedPoses loaded,
      *is_table ? LoadTable(input, config) : LoadRecording(input, config, progress, opener));
  loaded.input = input;
  loaded.config = config;
  return loaded;
}

Result<LoadedPoses> LoadSessions(const Experiment& experiment,
                                 std::optional<LoadedPoses>* first,
                                 const ProgressCallback& progress,
                                 const RecordingOpener& opener) {
  const std::vector<std::string>& inputs = experiment.inputs;
  const auto load = [&](const std::string& input,
                        const ProgressCallback& part) -> Result<LoadedPoses> {
    if (!*first || !IsAskedFor(**first, input, experiment.poses)) {
      return LoadPoses(input, experiment.poses, part, opener);
    }
    LoadedPoses read = *std::move(*first);
    first->reset();
    return read;
  };
  if (inputs.size() == 1) return load(inputs.front(), progress);
  TRUETRIAD_RETURN_IF_ERROR(CheckOneRecordingKeys(experiment));
  LoadedPoses all;
  std::vector<PoseSet> sessions;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const ProgressCallback part = [&](double share) {
      if (progress) progress((static_cast<double>(k) + share) / static_cast<double>(inputs.size()));
    };
    TRUETRIAD_ASSIGN_OR_RETURN(LoadedPoses more, load(inputs[k], part));
    if (more.not_enough) {
      more.not_enough->message = inputs[k] + ": " + more.not_enough->message;
      return more;
    }
    sessions.push_back(more.poses);
    TRUETRIAD_RETURN_IF_ERROR(CheckAreDifferent(sessions, inputs));
    if (k == 0) {
      all = std::move(more);
      continue;
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckCountSizes(all, more));
    for (const StreamSummary& stream : more.poses.streams) {
      all.si_per_count[stream.triad] = more.si_per_count[stream.triad];
    }
    std::ranges::move(more.inputs, std::back_inserter(all.inputs));
    std::ranges::move(more.readings, std::back_inserter(all.readings));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(all.poses, JoinSessions(std::move(sessions)));
  return all;
}

std::optional<std::vector<SensorReadings>> ReadingsOf(const std::string& log,
                                                      std::optional<std::int64_t> most) {
  OpenRecordingOptions options;
  options.may_be_joined = true;
  Result<std::unique_ptr<SampleSource>> opened = OpenRecording(log, options);
  if (!opened) return std::nullopt;
  DigestedSource source(*std::move(opened),
                        most.value_or(std::numeric_limits<std::int64_t>::max()));
  std::vector<SampleBlock> blocks;
  while (source.WantsMore()) {
    const Result<bool> more = source.Next(&blocks);
    if (!more) return std::nullopt;
    if (!*more) break;
  }
  return source.readings();
}

bool IsMadeFrom(const Calibration& calibration, const std::vector<InputFile>& inputs) {
  const auto is_same = [](const InputFile& a, const InputFile& b) {
    // A manifest itself has no samples, and an equal manifest may describe other files of the same
    // names.
    return a.samples > 0 && a.sha256 == b.sha256;
  };
  return std::find_first_of(calibration.inputs.begin(),
                            calibration.inputs.end(),
                            inputs.begin(),
                            inputs.end(),
                            is_same) != calibration.inputs.end();
}

Status CheckSameSensors(const std::string& what,
                        const std::string& serial,
                        const Tags& tags,
                        const Calibration& of,
                        const std::string& remedy) {
  if (!serial.empty() && !of.serial.empty() && serial != of.serial) {
    return Error(ErrorCode::kOtherDevice,
                 what + " is of unit `" + serial + "`, but the calibration is of `" + of.serial +
                     "`; give those of one unit");
  }
  // Firmwares number sensors differently, so that ids of two firmwares are not comparable.
  const std::string &firmware = tags.firmware, &its_firmware = of.tags.firmware;
  if (!firmware.empty() && !its_firmware.empty() && firmware != its_firmware) return {};
  for (const Triad triad : kTriads) {
    const auto &id = tags.device_ids[triad], &its_id = of.tags.device_ids[triad];
    if (!id || !its_id || *id == *its_id) continue;
    return Error(ErrorCode::kOtherDevice,
                 what + "'s " + std::string(TriadName(triad)) + " has device id " +
                     std::to_string(*id) + ", but that of the calibration has " +
                     std::to_string(*its_id) + "; " + remedy);
  }
  return {};
}

Result<LoadedPoses> LoadToEvaluate(const std::vector<Calibration>& calibrations,
                                   const std::string& input,
                                   const std::string& poses,
                                   const ProgressCallback& progress,
                                   const RecordingOpener& opener) {
  TRUETRIAD_ASSIGN_OR_RETURN(PosesConfig config, ParsePoses(poses));
  TakeClocks(calibrations.front(), &config);
  config.moves = std::ranges::any_of(calibrations, [](const Calibration& each) {
    return each.sensors[Triad::kGyroscope].has_value();
  });
  TRUETRIAD_ASSIGN_OR_RETURN(LoadedPoses loaded, LoadPoses(input, config, progress, opener));
  if (loaded.not_enough) return *loaded.not_enough;
  for (const Calibration& calibration : calibrations) {
    TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors(
        input + ": the recording", loaded.poses.serial, loaded.poses.tags, calibration));
  }
  return loaded;
}

}  // namespace truetriad
