// SPDX-License-Identifier: Apache-2.0
#include "io/known_motion_file.h"

#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "io/field_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

/// Reads `axis` as a vector of length one.
void ReadAxis(FieldReader& visit, Eigen::Vector3d* axis) {
  Eigen::Vector3d vector;
  if (!visit("axis", vector, BodyAxis())) return;
  // An axis whose length is 1 up to rounding is kept, so that a file reads back to the same bits.
  constexpr double kExactUnitLength = 1e-14;
  const double length = vector.norm();
  visit.Expect(std::isfinite(length),
               "is so long that its length overflows; only its direction counts, such as [0, 0, 1]",
               "axis");
  *axis = std::abs(length - 1.0) > kExactUnitLength ? vector / length : vector;
}

/// Reads `start_s` and `end_s`, in the log's time.
void TimeFields(FieldReader& visit, TimeRange* times) {
  // An int64 of nanoseconds holds times up to 9.2e9 s.
  constexpr double kFurthestS = 9.2e9;
  constexpr double kNsPerS = 1e9;  // 1 s is 1e9 ns.
  constexpr Range kLogTime{-kFurthestS, kFurthestS, "seconds of the log's time"};
  double start_s = 0.0, end_s = 0.0;
  for (const char* key : {"start_s", "end_s"}) visit.Require(key);
  const bool has_start = visit("start_s", start_s, kLogTime);
  if (!visit("end_s", end_s, kLogTime) || !has_start) return;
  visit.Expect(start_s < end_s,
               "the times are not a range; expected start_s < end_s, in seconds of the log's time");
  *times = {std::llround(kNsPerS * start_s), std::llround(kNsPerS * end_s)};
}

/// Where in the recording a motion happens: `first` and `last`, `start_s` and `end_s`, or a pose's
/// number at `pose_key`.
void PlaceFields(FieldReader& visit, std::string_view pose_key, MotionPlace* place) {
  place->stated_in = visit.map().file() + ":" + std::to_string(visit.map().line());
  const bool has_pose = visit.Has(pose_key);
  const bool has_start = visit.Has("start_s"), has_times = visit.Has("end_s") || has_start;
  const bool has_first = visit.Has("first"), has_rows = visit.Has("last") || has_first;
  const int ways = int{has_pose} + int{has_times} + int{has_rows};
  const std::string known =
      "`first` and `last`, `start_s` and `end_s`, or `" + std::string(pose_key) + "`";
  visit.Expect(ways > 0, "does not state where in the recording it happens; expected " + known);
  visit.Expect(ways < 2,
               "states in several ways where in the recording it happens; keep either " + known);
  visit(pose_key,
        place->pose,
        Range{.lowest = 1.0,
              .expected = "the number of a pose, counted from 1 (`truetriad inspect` lists them)"});
  if (has_times) TimeFields(visit, &place->times);
  if (!has_rows) return;
  RowSpan& rows = place->rows;
  for (const char* key : {"first", "last"}) visit.Require(key);
  const bool is_read = visit("first", rows.first, kAnyNumber);
  if (!visit("last", rows.last, kAnyNumber) || !is_read) return;
  visit.Expect(rows.first >= 0 && !rows.empty(),
               "rows " + std::to_string(rows.first) + " to " + std::to_string(rows.last) +
                   " are not a range; expected 0 <= first <= last");
}

StatedTurn ReadTurn(FieldReader& visit, const TurnDefaults& defaults) {
  StatedTurn turn;
  turn.sigma_rad = defaults.sigma_rad;
  turn.axis_sigma_rad = defaults.axis_sigma_rad;
  PlaceFields(visit, "after_pose", &turn.at);
  visit.Require("axis");
  ReadAxis(visit, &turn.axis);
  const bool is_one = visit.Has("turns") != visit.Has("degrees");
  visit.Expect(is_one, "expected either `turns` or `degrees`");
  if (visit(QuantityKeys{{"turns", 2.0 * std::numbers::pi}, {"degrees", kRadPerDeg}},
            turn.angle_rad,
            kAnyNumber)) {
    visit.Expect(turn.angle_rad != 0.0, "its angle is zero; expected a turn");
  }
  visit(InDegrees("sigma_deg"), turn.sigma_rad, kPositive);
  visit(InDegrees("axis_sigma_deg"), turn.axis_sigma_rad, kPositive);
  visit("id", turn.id, kAnyText);
  return turn;
}

StatedRate ReadRate(FieldReader& visit, const RateDefaults& defaults) {
  StatedRate rate;
  PlaceFields(visit, "pose", &rate.at);
  if (visit.Has("rate_degps")) {
    visit(InDegrees("rate_degps"), rate.rate_radps, kNumbers);
  } else {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
    double degps = 0.0;
    visit.Expect(visit.Has("axis") || !defaults.is_axis_known,
                 "has no axis; add `axis:`, or, if only the size of the rates is known, state "
                 "`rates: { file: …, axes: unknown }` in the experiment");
    ReadAxis(visit, &axis);
    visit.Require("degps");
    visit("degps", degps, kAnyNumber);
    rate.rate_radps = kRadPerDeg * degps * axis;
  }
  rate.is_axis_known = defaults.is_axis_known;
  visit.Expect(rate.is_axis_known || !rate.rate_radps.isZero(0.0),
               "its rate is zero, which has no effect without a known axis; leave it out");
  double sigma_radps = defaults.sigma_radps;
  visit(InDegrees("sigma_degps"), sigma_radps, kNotNegative);
  // A small angular error of the axis changes the rate at right angles to the axis. An unknown axis
  // is estimated instead, so it has no error here.
  const double across_radps =
      rate.is_axis_known ? defaults.axis_sigma_rad * rate.rate_radps.norm() : 0.0;
  const Eigen::Vector3d along = rate.rate_radps.stableNormalized();
  rate.covariance_radps2 =
      sigma_radps * sigma_radps * Eigen::Matrix3d::Identity() +
      across_radps * across_radps * (Eigen::Matrix3d::Identity() - along * along.transpose());
  visit("id", rate.id, kAnyText);
  return rate;
}

/// The items of the list at `key`, the only key of the file.
template <typename Read>
auto ReadList(const std::string& path, std::string_view key, Read read)
    -> Result<std::vector<decltype(read(std::declval<FieldReader&>()))>> {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromFile(path));
  std::vector<decltype(read(std::declval<FieldReader&>()))> values;
  for (const YamlReader& item : file.RequireChild(key).Items()) {
    FieldReader::ReadMap(item, [&](FieldReader& visit) { values.push_back(read(visit)); });
  }
  file.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(file.status());
  if (values.empty()) {
    return Error(
        ErrorCode::kMissingKey, {path}, "`" + std::string(key) + "` is empty; list at least one");
  }
  return values;
}

YamlText& WritePlace(YamlText& yaml, const MotionPlace& at, std::string_view pose_key) {
  if (at.is_pose()) return yaml << pose_key << ": " << at.pose;
  if (!at.times.empty()) {
    return yaml << "start_s: " << 1e-9 * static_cast<double>(at.times.start_ns)
                << ", end_s: " << 1e-9 * static_cast<double>(at.times.end_ns);
  }
  return yaml << "first: " << at.rows.first << ", last: " << at.rows.last;
}

}  // namespace

Result<std::vector<StatedTurn>> ReadStatedTurns(const std::string& path,
                                                const TurnDefaults& defaults) {
  return ReadList(path, "turns", [&](FieldReader& visit) { return ReadTurn(visit, defaults); });
}

Result<std::vector<StatedRate>> ReadStatedRates(const std::string& path,
                                                const RateDefaults& defaults) {
  return ReadList(path, "rates", [&](FieldReader& visit) { return ReadRate(visit, defaults); });
}

std::string StatedTurnsToYaml(const std::vector<StatedTurn>& turns) {
  YamlText yaml;
  yaml << (turns.empty() ? "turns: []\n" : "turns:\n");
  for (const StatedTurn& turn : turns) {
    WritePlace(yaml << "  - { ", turn.at, "after_pose")
        << ", axis: " << turn.axis << ", turns: " << turn.angle_rad / (2.0 * std::numbers::pi);
    if (!turn.id.empty()) yaml << ", id: " << Quoted{turn.id};
    yaml << " }\n";
  }
  return yaml.str();
}

std::string StatedRatesToYaml(const std::vector<StatedRate>& rates) {
  YamlText yaml;
  yaml << (rates.empty() ? "rates: []\n" : "rates:\n");
  for (const StatedRate& rate : rates) {
    WritePlace(yaml << "  - { ", rate.at, "pose")
        << ", rate_degps: " << Eigen::Vector3d(rate.rate_radps / kRadPerDeg);
    if (!rate.id.empty()) yaml << ", id: " << Quoted{rate.id};
    yaml << " }\n";
  }
  return yaml.str();
}

}  // namespace truetriad
