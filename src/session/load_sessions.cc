// SPDX-License-Identifier: Apache-2.0
#include "session/load_sessions.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "problem/session_block.h"
#include "truetriad/data/sessions.h"

namespace truetriad {
namespace {

/// What has a meaning in one recording alone, by its key in the experiment.
Status CheckOneRecordingKeys(const Experiment& experiment) {
  if (experiment.inputs.size() > kMaxSessions) {
    return Error(ErrorCode::kInvalidExperiment,
                 std::to_string(experiment.inputs.size()) + " recordings; expected at most " +
                     std::to_string(kMaxSessions))
        .About("input");
  }
  const PosesConfig& poses = experiment.poses;
  const auto one = [](const char* key, const char* what, const char* instead) -> Status {
    return Error(ErrorCode::kInvalidExperiment,
                 std::string("`") + key + "` " + what + ", but `input` lists several recordings; " +
                     instead)
        .About(key);
  };
  if (poses.kind == PoseSelectionKind::kMotion || poses.kind == PoseSelectionKind::kSweep) {
    return one("poses", "follows one recording", "give one, or calibrate from rests");
  }
  if (poses.kind == PoseSelectionKind::kRanges) {
    return one("poses", "names rows of one file", "state `poses:` in the manifest of each");
  }
  if (!poses.exclude.empty()) {
    return one("exclude", "counts seconds of one recording", "use `exclude_poses:`");
  }
  if (!poses.known_motions.turns_file.empty()) {
    return one("turns", "are places in one recording", "give one, or remove it");
  }
  if (!poses.known_motions.rates_file.empty()) {
    return one("rates", "are places in one recording", "give one, or remove it");
  }
  return {};
}

/// Counts are one size in all sessions.
Status CheckCountSizes(const LoadedPoses& first, const LoadedPoses& more) {
  for (const StreamSummary& stream : more.poses.streams) {
    const StreamSummary* other = first.poses.Find(stream.triad);
    if (other == nullptr || first.si_per_count[stream.triad] == more.si_per_count[stream.triad]) {
      continue;
    }
    return Error(ErrorCode::kDoesNotMatch,
                 {more.poses.source},
                 "`si_per_count` of the " + std::string(TriadName(stream.triad)) +
                     " is not that of " + first.poses.source +
                     "; sessions are of one unit, so state the same");
  }
  return {};
}

// Poses of the two that have the same means to the last bit: the same readings.
int SharedPoses(const PoseSet& one, const PoseSet& other) {
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

// Error: a recording is there twice, or a part of it.
Status CheckAreDifferent(const std::vector<PoseSet>& sessions,
                         const std::vector<std::string>& inputs) {
  constexpr int kNoChance = 3;
  const PoseSet& last = sessions.back();
  for (std::size_t k = 0; k + 1 < sessions.size(); ++k) {
    const int shared = SharedPoses(last, sessions[k]);
    if (shared < std::min(kNoChance, static_cast<int>(last.poses.size()))) continue;
    if (shared == 0) continue;
    return Error(ErrorCode::kConflictingArguments,
                 {inputs[sessions.size() - 1]},
                 "has readings of " + inputs[k] + " (" + std::to_string(shared) +
                     " poses are the same to the last digit), so it is no session of its own; "
                     "give each recording once");
  }
  return {};
}

// Whether reading `input` once more would give the same.
bool IsAskedFor(const LoadedPoses& read, const std::string& input, PosesConfig config) {
  // Without a gyroscope there is nothing between the poses.
  if (read.poses.Find(Triad::kGyroscope) == nullptr) config.moves = read.config.moves;
  return read.input == input && read.config == config;
}

}  // namespace

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
    std::move(more.inputs.begin(), more.inputs.end(), std::back_inserter(all.inputs));
  }
  TRUETRIAD_ASSIGN_OR_RETURN(all.poses, JoinSessions(std::move(sessions)));
  return all;
}

}  // namespace truetriad
