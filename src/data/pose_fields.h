// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "model/finding_fields.h"
#include "tree/fields.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

// Lists of fields (tree/fields.h): of pose sets in the output of commands, and of pose programs.

/// A stream or a pose of a set, and whether the set has times.
template <typename T>
struct PartOfSet {
  const T& part;
  bool has_time;
};

template <class V>
void Fields(V& visit, Like<PartOfSet<StreamSummary>> auto& of_set) {
  const auto& [stream, has_time] = of_set;
  visit("sensor", stream.triad);
  visit("unit", stream.unit.name);
  visit("samples", stream.samples);
  visit("dropped_rows", stream.dropped_empty);
  visit.If(has_time, "rate_hz", stream.rate_hz);
  visit.If(has_time, "jitter_s", stream.jitter_s);
  visit.If(has_time, "time_stamps", StampKindName(stream.stamps));
  visit.If(has_time, "gaps", stream.gaps);
  visit.If(has_time, "longest_gap_s", stream.longest_gap_s);
  visit("smallest", stream.minimum_raw);
  visit("largest", stream.maximum_raw);
  const bool has_noise = stream.noise_sigma_raw.maxCoeff() > 0.0;
  visit.If(has_noise, "noise_sigma", stream.noise_sigma_raw);
  visit.If(has_noise, "correlation", stream.correlation_inflation);
}

template <class V>
void Fields(V& visit, Like<TriadPose> auto& pose) {
  visit("samples", pose.samples);
  visit("mean", pose.mean_raw);
}

template <class V>
void Fields(V& visit, Like<PartOfSet<StaticPose>> auto& of_set) {
  const auto& [pose, has_time] = of_set;
  visit("pose", pose.number);
  visit.If(!pose.id.empty(), "id", pose.id);
  visit.If(has_time, "start_s", 1e-9 * static_cast<double>(pose.start_ns));
  visit.If(has_time, "duration_s", pose.duration_s());
  visit.OrNull("temperature_degc", pose.temperature_degc);
  visit.Group("means", Style::kFlow, [&triads = pose.triads](V& means) {
    for (const Triad triad : kTriads) {
      if (triads[triad]) means(TriadName(triad), *triads[triad]);
    }
  });
}

template <class V>
void Fields(V& visit, Like<PoseSet> auto& set) {
  visit("source", set.source);
  visit("serial", set.serial);
  visit("how", set.how);
  visit.OrNull("duration_s", set.has_time ? std::optional(set.duration_s) : std::nullopt);
  visit("static_share", set.static_share);
  visit.OrNull("temperature_range_degc", set.temperature_range_degc);
  std::vector<PartOfSet<StreamSummary>> streams;
  for (const StreamSummary& stream : set.streams) streams.push_back({stream, set.has_time});
  visit("streams", streams);
  std::vector<PartOfSet<StaticPose>> poses;
  for (const StaticPose& pose : set.poses) poses.push_back({pose, set.has_time});
  visit("poses", poses);
}

struct NumberedPose {
  std::size_t number;
  const ProgramPose& pose;
};

template <class V>
void Fields(V& visit, Like<NumberedPose> auto& numbered) {
  const ProgramPose& pose = numbered.pose;
  const Eigen::Quaterniond& q = pose.world_from_body;
  visit("number", numbered.number);
  visit("attitude", Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
  visit("temperature_degc", pose.temperature_degc);
  visit.If(!pose.label.empty(), "label", pose.label);
}

/// The format's version is `program: 1`.
template <class V>
void Fields(V& visit, Like<PoseProgram> auto& program) {
  visit("program", 1);
  std::vector<NumberedPose> poses;
  for (const ProgramPose& pose : program.poses) poses.push_back({poses.size() + 1, pose});
  visit("poses", poses);
}

}  // namespace truetriad
