// SPDX-License-Identifier: Apache-2.0
#include "io/known_motion_file.h"

#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "io/field_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// As a vector of length one.
void ReadAxis(FieldReader& visit, Eigen::Vector3d* axis) {
  Eigen::Vector3d vector;
  if (!visit("axis", vector, BodyAxis())) return;
  // Lengths within rounding are kept as they are, so that a file reads back to the same bits.
  constexpr double kExactUnitLength = 1e-14;
  const double length = vector.norm();
  visit.Expect(std::isfinite(length),
               "is too long; a vector of any length that is a number will do, such as [0, 0, 1]",
               "axis");
  *axis = std::abs(length - 1.0) > kExactUnitLength ? vector / length : vector;
}

/// `start_s` and `end_s`, times of the log.
void ReadTimes(YamlReader& item, TimeRange* times) {
  // An int64 of nanoseconds reaches so far.
  constexpr double kFurthestS = 9.2e9;
  constexpr double kNsPerS = 1e9;
  double start_s = 0.0, end_s = 0.0;
  if (!item.Require("start_s", &start_s) || !item.Require("end_s", &end_s)) return;
  if (!(start_s < end_s) || std::abs(start_s) > kFurthestS || std::abs(end_s) > kFurthestS) {
    item.Fail("its time is not a range; expected start_s < end_s, in seconds of the log's time");
    return;
  }
  *times = {std::llround(kNsPerS * start_s), std::llround(kNsPerS * end_s)};
}

/// `first` and `last`, `start_s` and `end_s`, or a pose's number at `pose_key`.
void ReadPlace(YamlReader& item, std::string_view pose_key, MotionPlace* place) {
  place->stated_in = item.file() + ":" + std::to_string(item.line());
  YamlReader pose = item.Child(pose_key);
  YamlReader first = item.Child("first");
  YamlReader last = item.Child("last");
  const bool has_start = static_cast<bool>(item.Child("start_s"));
  const bool has_end = static_cast<bool>(item.Child("end_s"));
  const bool has_times = has_start || has_end;
  if (has_times && (pose || first || last)) {
    item.Fail(
        "a time, rows and a pose exclude each other; keep `start_s` and `end_s`, `first` and "
        "`last`, or `" +
        std::string(pose_key) + "`");
    return;
  }
  if (has_times) return ReadTimes(item, &place->times);
  if (pose) {
    if (first || last) {
      pose.Fail("rows and a pose exclude each other; keep `first` and `last`, or `" +
                std::string(pose_key) + "`");
    }
    if (pose.Read(&place->pose) && place->pose < 1) {
      pose.Fail("expected the number of a pose, counted from 1 (`truetriad inspect` lists them)");
    }
    return;
  }
  if (!first && !last) {
    item.Fail(
        "has no place in the recording; expected rows `first` and `last`, times `start_s` and "
        "`end_s`, or `" +
        std::string(pose_key) + "`");
    return;
  }
  if (!item.Require("first", &place->rows.first) || !item.Require("last", &place->rows.last)) {
    return;
  }
  if (place->rows.first < 0 || place->rows.empty()) {
    item.Fail("rows " + std::to_string(place->rows.first) + " to " +
              std::to_string(place->rows.last) + " are not a range; expected 0 <= first <= last");
  }
}

StatedTurn ReadTurn(FieldReader& visit, const TurnDefaults& defaults) {
  StatedTurn turn;
  turn.sigma_rad = defaults.sigma_rad;
  turn.axis_sigma_rad = defaults.axis_sigma_rad;
  ReadPlace(visit.map(), "after_pose", &turn.at);
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
  ReadPlace(visit.map(), "pose", &rate.at);
  if (visit.Has("rate_degps")) {
    visit(InDegrees("rate_degps"), rate.rate_radps, kNumbers);
  } else {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
    double degps = 0.0;
    visit.Expect(visit.Has("axis") || !defaults.is_axis_known,
                 "has no axis; add `axis:`, or where only the size of the rates is known state "
                 "`rates: { file: …, axes: unknown }` in the experiment");
    ReadAxis(visit, &axis);
    visit.Require("degps");
    visit("degps", degps, kAnyNumber);
    rate.rate_radps = kRadPerDeg * degps * axis;
  }
  rate.is_axis_known = defaults.is_axis_known;
  visit.Expect(rate.is_axis_known || !rate.rate_radps.isZero(0.0),
               "its rate is zero, which says nothing where no axis is known; leave it out");
  double sigma_radps = defaults.sigma_radps;
  visit(InDegrees("sigma_degps"), sigma_radps, kNotNegative);
  // A direction that is off by a small angle moves the rate across itself. One that is not known is
  // estimated.
  const double across_radps =
      rate.is_axis_known ? defaults.axis_sigma_rad * rate.rate_radps.norm() : 0.0;
  const Eigen::Vector3d along = rate.rate_radps.stableNormalized();
  rate.covariance_radps2 =
      sigma_radps * sigma_radps * Eigen::Matrix3d::Identity() +
      across_radps * across_radps * (Eigen::Matrix3d::Identity() - along * along.transpose());
  visit("id", rate.id, kAnyText);
  return rate;
}

/// The members of the list at `key`, which is all there is in the file.
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
