// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "base/messages.h"
#include "truetriad/data/pose_collection.h"

namespace truetriad {
namespace {

// Chosen: a session begins at least 1 s after the end of the one before; times that start earlier
// are shifted, since recordings often start at zero.
constexpr std::int64_t kApartNs = 1'000'000'000;

// Names of the folder and the file, "b/recording.yaml"; a whole path is too long for a finding.
std::string ShortName(const std::string& source) {
  const std::filesystem::path path(source);
  const std::string folder = path.parent_path().filename().string();
  return folder.empty() ? path.filename().string() : folder + "/" + path.filename().string();
}

// Combines the summaries of one sensor's stream in two sessions.
void PoolStreams(const StreamSummary& more, StreamSummary* pooled) {
  const auto a = static_cast<double>(pooled->samples), b = static_cast<double>(more.samples);
  const auto mean = [&](const auto& first, const auto& second) {
    return (a * first + b * second) / std::max(a + b, 1.0);
  };
  pooled->noise_sigma_raw =
      mean(pooled->noise_sigma_raw.cwiseAbs2().eval(), more.noise_sigma_raw.cwiseAbs2().eval())
          .cwiseSqrt()
          .eval();
  pooled->correlation_inflation =
      mean(pooled->correlation_inflation, more.correlation_inflation).eval();
  // The smaller scatter is kept, so that one session with normalised readings is noticed.
  if (more.length_scatter < pooled->length_scatter) {
    pooled->length_raw = more.length_raw;
    pooled->length_scatter = more.length_scatter;
    pooled->length_extent = more.length_extent;
  }
  pooled->one_sided_raw = (more.one_sided_raw.array().abs() > pooled->one_sided_raw.array().abs())
                              .select(more.one_sided_raw, pooled->one_sided_raw)
                              .eval();
  pooled->minimum_raw = pooled->minimum_raw.cwiseMin(more.minimum_raw).eval();
  pooled->maximum_raw = pooled->maximum_raw.cwiseMax(more.maximum_raw).eval();
  pooled->resolution_raw = pooled->resolution_raw.cwiseMax(more.resolution_raw).eval();
  pooled->rest_step_raw = pooled->rest_step_raw.cwiseMax(more.rest_step_raw).eval();
  pooled->longest_gap_s = std::max(pooled->longest_gap_s, more.longest_gap_s);
  if (more.samples > pooled->samples) pooled->rate_hz = more.rate_hz;
  if (more.jitter_s > pooled->jitter_s) {
    pooled->jitter_s = more.jitter_s;
    pooled->stamps = more.stamps;
  }
  pooled->are_stamps_even = pooled->are_stamps_even || more.are_stamps_even;
  pooled->samples += more.samples;
  pooled->dropped_empty += more.dropped_empty;
  pooled->gaps += more.gaps;
  pooled->duplicate_times += more.duplicate_times;
}

// Error: the magnetometer is mounted differently, or its mounting is stated differently.
Status CheckSameMount(const PoseSet& first, const PoseSet& more) {
  const auto turn_deg = [](const PoseSet& set) {
    return set.tags.magnetometer_mount_deg.value_or(Eigen::Vector3d::Zero());
  };
  const auto text = [&](const PoseSet& set) {
    const Eigen::Vector3d turn = turn_deg(set);
    return Format("%g, ", turn[0]) + Format("%g, ", turn[1]) + Format("%g deg", turn[2]);
  };
  const bool both_have =
      first.Find(Triad::kMagnetometer) != nullptr && more.Find(Triad::kMagnetometer) != nullptr;
  if (!both_have || turn_deg(first) == turn_deg(more)) return {};
  return Error(ErrorCode::kDoesNotMatch,
               {more.source},
               "the magnetometer is turned against the board by (roll, pitch, yaw) " + text(more) +
                   ", but by " + text(first) + " in " + first.sessions.front().source +
                   ": the vehicle's setting for the rotation of the magnetometer, or of the board, "
                   "was changed in between; calibrate each recording by itself")
      .About("streams.magnetometer");
}

// Error: the two sessions are of different units, or cannot be joined.
Status CheckAgree(const PoseSet& first, const PoseSet& more) {
  const std::string& source = first.sessions.front().source;
  if (!first.serial.empty() && !more.serial.empty() && first.serial != more.serial) {
    return Error(ErrorCode::kOtherDevice,
                 {more.source},
                 "is a recording of unit `" + more.serial + "`, but " + source + " is of unit `" +
                     first.serial +
                     "`; all sessions must be of one unit: give recordings of one unit");
  }
  for (const Triad triad : kTriads) {
    const auto &id = first.tags.device_ids[triad], &other = more.tags.device_ids[triad];
    if (!id || !other || *id == *other) continue;
    return Error(
        ErrorCode::kOtherDevice,
        {more.source},
        "is a recording of the " + std::string(TriadName(triad)) + " " + std::to_string(*other) +
            ", but " + source + " is of " + std::to_string(*id) +
            "; all sessions must be of the same sensors: calibrate each recording by itself");
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckSameMount(first, more));
  if (first.has_time != more.has_time) {
    return Error(ErrorCode::kDoesNotMatch,
                 {more.source},
                 std::string("has ") + (more.has_time ? "" : "no ") + "times, but " + source +
                     " has " + (first.has_time ? "some" : "none") +
                     "; sessions either all have times or none");
  }
  for (const StreamSummary& stream : more.streams) {
    const StreamSummary* other = first.Find(stream.triad);
    if (other == nullptr || other->unit.name == stream.unit.name) continue;
    return Error(ErrorCode::kUnitMismatch,
                 {more.source},
                 "the " + std::string(TriadName(stream.triad)) + " is in " + stream.unit.name +
                     ", but in " + other->unit.name + " in " + source +
                     "; record all sessions in one unit, or convert");
  }
  return {};
}

// Makes the times of a pose or a move later by `shift_ns`.
void Shift(std::int64_t shift_ns, StaticPose* pose) {
  pose->start_ns += shift_ns;
  pose->end_ns += shift_ns;
}
void Shift(std::int64_t shift_ns, RecordedMove* move) {
  for (std::int64_t& time_ns : move->time_ns) time_ns += shift_ns;
}

// Appends the session's poses with numbers and times after those of the set.
void AppendPoses(PoseSet more, PoseSet* set) {
  const auto session = static_cast<int>(set->sessions.size());
  const std::size_t places = set->poses.size();
  const int numbers = places == 0 ? 0 : set->poses.back().number;
  std::int64_t shift_ns = 0;
  if (set->has_time && places > 0 && !more.poses.empty()) {
    shift_ns = std::max<std::int64_t>(
        0, set->poses.back().end_ns + kApartNs - more.poses.front().start_ns);
  }
  for (StaticPose& pose : more.poses) {
    pose.session = session;
    pose.number += numbers;
    Shift(shift_ns, &pose);
    set->poses.push_back(std::move(pose));
  }
  for (RecordingJoint& joint : more.joints) {
    joint.time_ns += shift_ns;
    set->joints.push_back(std::move(joint));
  }
  for (const TimeRange& range : more.excluded) {
    set->excluded.push_back({range.start_ns + shift_ns, range.end_ns + shift_ns});
  }
  for (RecordedMove& move : more.moves) {
    move.from += places;
    Shift(shift_ns, &move);
    set->moves.push_back(std::move(move));
  }
  const int last = set->poses.empty() ? 0 : set->poses.back().number;
  set->sessions.push_back({more.source, numbers + 1, last});
}

// Merges `more`, the recording after those of `set`. The numbers that the firmware gives to its
// sensors (slots) are taken from the last recording. A warning tells if a sensor's number changed.
void TakePlacesOf(const PoseSet& more, PoseSet* set) {
  bool has_changed = false;
  for (const Triad triad : kTriads) {
    const std::optional<std::int64_t>& slot = more.tags.device_slots[triad];
    std::optional<std::int64_t>& known = set->tags.device_slots[triad];
    has_changed = has_changed || (slot && known && *slot != *known);
    if (slot) known = slot;
    if (!more.tags.thermal_slots[triad]) continue;
    set->tags.thermal_slots[triad] = more.tags.thermal_slots[triad];
    set->tags.idle_thermal_slots[triad] = more.tags.idle_thermal_slots[triad];
  }
  if (more.tags.magnetometer_turn_deg)
    set->tags.magnetometer_turn_deg = more.tags.magnetometer_turn_deg;
  if (!has_changed) return;
  set->findings.push_back(
      Finding(FindingCode::kMessage,
              "the vehicle numbers its sensors differently in " + ShortName(more.source) +
                  " than in earlier logs; exports use the numbers of the last log",
              "give the logs in the order in which they were recorded")
          .As(Severity::kWarning));
}

// Combines the fields that describe the recordings as a whole.
void PoolRecordings(const PoseSet& more, PoseSet* set) {
  if (set->serial.empty()) set->serial = more.serial;
  TakePlacesOf(more, set);
  set->tags = OrElse(set->tags, more.tags);
  const double duration_s = set->duration_s + more.duration_s;
  if (duration_s > 0.0) {
    set->static_share =
        (set->static_share * set->duration_s + more.static_share * more.duration_s) / duration_s;
  }
  set->duration_s = duration_s;
  set->traces = {};  // Several recordings have no common time.
  for (const StreamSummary& stream : more.streams) {
    const auto same =
        std::find_if(set->streams.begin(), set->streams.end(), [&](const StreamSummary& other) {
          return other.triad == stream.triad;
        });
    if (same == set->streams.end()) {
      set->streams.push_back(stream);
    } else {
      PoolStreams(stream, &*same);
    }
  }
  if (const auto& range = more.temperature_range_degc) {
    auto& whole = set->temperature_range_degc;
    whole = whole ? Eigen::Vector2d(std::min((*whole)[0], (*range)[0]),
                                    std::max((*whole)[1], (*range)[1]))
                  : *range;
  }
  for (const Triad triad : kTriads) {
    auto& lag_s = set->clock_lag_s[triad];
    if (!lag_s) lag_s = more.clock_lag_s[triad];
  }
  for (Finding finding : more.findings) {
    finding.text = ShortName(more.source) + ": " + finding.text;
    if (finding.pose && !set->poses.empty()) *finding.pose += set->poses.back().number;
    set->findings.push_back(std::move(finding));
  }
}

}  // namespace

Result<PoseSet> JoinSessions(std::vector<PoseSet> sessions) {
  PoseSet set;
  for (PoseSet& more : sessions) {
    if (set.sessions.empty()) {
      set.source = more.source;
      set.has_time = more.has_time;
      set.start_ns = more.start_ns;
      set.how = more.how;
      set.time_offset_s = more.time_offset_s;
    } else {
      TRUETRIAD_RETURN_IF_ERROR(CheckAgree(set, more));
      set.source += ", " + more.source;
    }
    PoolRecordings(more, &set);
    AppendPoses(std::move(more), &set);
  }
  return set;
}

}  // namespace truetriad
