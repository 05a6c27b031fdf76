// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "base/messages.h"
#include "base/sensor_line.h"
#include "problem/start_values.h"
#include "truetriad/base/units.h"
#include "verdict/checks/check.h"
#include "verdict/checks/constancy.h"

namespace truetriad {
namespace {

// Whether it may be that one session's magnetometer is not as the other's.
bool MayBeBetweenSessions(const SettledRun& run, const MagnetometerChange& change) {
  if (change.last || change.kind == ChangeKind::kField) return false;
  const std::vector<PoseNode>& nodes = run.graph.nodes;
  return nodes[change.earliest - 1].session != nodes[change.latest].session;
}

// "between pose 12 and pose 13 (61.2 s after the first)"; where others are as likely, "somewhere
// between pose 10 and pose 14, most likely …".
std::string PlaceOfChange(const SettledRun& run, const MagnetometerChange& change) {
  const auto between = [&](std::size_t first, std::size_t second) {
    return "between pose " + std::to_string(run.graph.nodes[first].number) + " and pose " +
           std::to_string(run.graph.nodes[second].number);
  };
  const int after = run.graph.nodes[change.node].number;
  std::string text = between(change.node - 1, change.node);
  if (MayBeBetweenSessions(run, change)) text += ", where one session ends";
  if (change.earliest < change.latest) {
    text = "somewhere " + between(change.earliest - 1, change.latest) + ", most likely " + text;
  }
  if (!run.poses.has_time) return text;
  for (const StaticPose& pose : run.poses.poses) {
    const std::int64_t begin_ns = run.poses.poses.front().start_ns;
    if (pose.number != after || pose.start_ns == begin_ns) continue;
    text +=
        Format(" (%.1f s after the first)", 1e-9 * static_cast<double>(pose.start_ns - begin_ns));
  }
  return text;
}

// "10, 11": the poses that it befell.
std::string NumbersOf(const SettledRun& run, const MagnetometerChange& change) {
  std::string numbers;
  for (std::size_t k = change.node; k <= *change.last; ++k) {
    if (run.graph.nodes[k].role != PoseRole::kRest) continue;
    numbers += (numbers.empty() ? "" : ", ") + std::to_string(run.graph.nodes[k].number);
  }
  return numbers;
}

// "its bias differs by 1.2 uT from there on, as when …".
std::string WhatChanged(const SettledRun& run, const MagnetometerChange& change) {
  const std::string when = change.last ? " meanwhile" : " from there on";
  const std::string bias = Format("its bias differs by %.2g uT", change.bias_ut.norm()) + when;
  const Eigen::Vector3d field = WorldVector(Triad::kMagnetometer, run.graph.reference());
  const Eigen::Vector3d later = field + change.field_ut;
  const double turned_deg = kDegPerRad * std::atan2(field.cross(later).norm(), field.dot(later));
  const std::string world = Format("the field differs by %.2g uT ", change.field_ut.norm()) +
                            Format("(%+.2g uT in strength, ", later.norm() - field.norm()) +
                            Format("%.2g deg in direction)", turned_deg) + when;
  switch (change.kind) {
    case ChangeKind::kBias:
      return bias + ", as when iron or a magnet on the unit moves";
    case ChangeKind::kField:
      return world + (change.last ? ", as when a magnet or a current passes"
                                  : ", as when the unit or iron about it is moved");
    case ChangeKind::kEither:
      return "either " + bias + ", or " + world;
  }
  return {};
}

std::string RemedyOf(const SettledRun& run, const MagnetometerChange& change) {
  if (change.last) return "leave them out: `exclude_poses: [" + NumbersOf(run, change) + "]`";
  if (MayBeBetweenSessions(run, change)) {
    return "state " + SensorLine(Triad::kMagnetometer, "bias: per_session") +
           ", or take one session alone";
  }
  return "take the run again, or the poses of one side alone";
}

// What happened to the magnetometer, and what to do about it.
Finding FindingOf(const SettledRun& run, const MagnetometerChange& change) {
  std::string text =
      change.last ? "the magnetometer's readings are others in poses " + NumbersOf(run, change) +
                        " than before and after: "
                  : "the magnetometer's readings changed " + PlaceOfChange(run, change) + ": ";
  text += WhatChanged(run, change);
  text += Format("; ignoring it shifts parameters by up to %.2g σ", change.effect_sigmas) +
          Format(" (by chance: %.1g)", change.p_value);
  const std::optional<Eigen::Vector2d>& range = run.poses.temperature_range_degc;
  if (range && (*range)[1] - (*range)[0] > kMuchTemperatureDegc) {
    text += Format(
        "; the temperature changed by %.0f degC, too: temperature terms that are missing, or of "
        "too low an order, look the same",
        (*range)[1] - (*range)[0]);
  }
  Finding finding(FindingCode::kMagnetometerChanged, std::move(text), RemedyOf(run, change));
  finding.About(Triad::kMagnetometer)
      .AtPose(run.graph.nodes[change.node].number)
      .Shifting(change.effect_sigmas, Treatment::kWidened)
      .With("p_value", change.p_value);
  if (change.kind != ChangeKind::kField) finding.With("bias", change.bias_ut.norm(), "uT");
  if (change.kind != ChangeKind::kBias) finding.With("field", change.field_ut.norm(), "uT");
  return finding;
}

}  // namespace

Findings CheckMagnetometerChange(const SettledRun& run, const SolvedRun& solved) {
  const std::optional<MagnetometerChange>& change = solved.unmodelled.change;
  if (!change) return {};
  Finding finding = FindingOf(run, *change);
  finding.text += "; σ allow for it";
  return {finding};
}

}  // namespace truetriad
