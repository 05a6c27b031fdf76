// SPDX-License-Identifier: Apache-2.0
#include "io/known_motion_file.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/units.h"

namespace truetriad {
namespace {

/// A number in (`above`, inf).
bool ReadAbove(YamlReader reader, double above, std::string_view expected, double* value) {
  double number = 0.0;
  if (!reader.Read(&number)) return false;
  if (number > above) {
    *value = number;
    return true;
  }
  reader.Fail("expected " + std::string(expected));
  return false;
}

/// x, -y, … or a vector of any length but zero.
void ReadAxis(YamlReader reader, Eigen::Vector3d* axis) {
  if (!reader) return;
  if (reader.IsScalar()) {
    std::string name;
    if (!reader.Read(&name)) return;
    const bool has_sign = !name.empty() && (name[0] == '-' || name[0] == '+');
    const std::size_t place = kAxisLetters.find(name.substr(has_sign ? 1 : 0));
    if (name.size() == (has_sign ? 2U : 1U) && place < 3) {
      *axis = (name[0] == '-' ? -1.0 : 1.0) * Eigen::Vector3d::Unit(static_cast<int>(place));
      return;
    }
    reader.Fail("`" + name + "` is not among x, -x, y, -y, z, -z; or give a vector [x, y, z]");
    return;
  }
  Eigen::Vector3d vector;
  if (!reader.Read(&vector)) return;
  // Lengths within rounding are kept as they are, so that a file reads back to the same bits.
  constexpr double kExactUnitLength = 1e-14;
  const double length = vector.norm();
  if (!(length > 0.0)) {
    reader.Fail("expected a vector other than zero");
  } else if (!std::isfinite(length)) {
    reader.Fail("is too long; a vector of any length that is a number will do, such as [0, 0, 1]");
  } else {
    *axis = std::abs(length - 1.0) > kExactUnitLength ? vector / length : vector;
  }
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

StatedTurn ReadTurn(YamlReader item, const TurnDefaults& defaults) {
  StatedTurn turn;
  turn.sigma_rad = defaults.sigma_rad;
  turn.axis_sigma_rad = defaults.axis_sigma_rad;
  ReadPlace(item, "after_pose", &turn.at);
  ReadAxis(item.RequireChild("axis"), &turn.axis);
  double value = 0.0;
  YamlReader turns = item.Child("turns");
  YamlReader degrees = item.Child("degrees");
  if (turns.Read(&value)) turn.angle_rad = 2.0 * std::numbers::pi * value;
  if (degrees.Read(&value)) turn.angle_rad = kRadPerDeg * value;
  if (static_cast<bool>(turns) == static_cast<bool>(degrees)) {
    item.Fail("expected either `turns` or `degrees`");
  } else if (value == 0.0) {
    item.Fail("its angle is zero; expected a turn");
  }
  if (ReadAbove(item.Child("sigma_deg"), 0.0, "a positive number", &value)) {
    turn.sigma_rad = kRadPerDeg * value;
  }
  if (ReadAbove(item.Child("axis_sigma_deg"), 0.0, "a positive number", &value)) {
    turn.axis_sigma_rad = kRadPerDeg * value;
  }
  item.Optional("id", &turn.id);
  item.RejectUnknown();
  return turn;
}

StatedRate ReadRate(YamlReader item, const RateDefaults& defaults) {
  StatedRate rate;
  ReadPlace(item, "pose", &rate.at);
  if (YamlReader vector = item.Child("rate_degps")) {
    if (vector.Read(&rate.rate_radps)) rate.rate_radps *= kRadPerDeg;
  } else {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
    double degps = 0.0;
    YamlReader stated = item.Child("axis");
    ReadAxis(stated, &axis);
    if (!stated && defaults.is_axis_known) {
      item.Fail(
          "has no axis; add `axis:`, or where only the size of the rates is known state "
          "`rates: { file: …, axes: unknown }` in the experiment");
    }
    item.Require("degps", &degps);
    rate.rate_radps = kRadPerDeg * degps * axis;
  }
  rate.is_axis_known = defaults.is_axis_known;
  if (!rate.is_axis_known && rate.rate_radps.isZero(0.0)) {
    item.Fail("its rate is zero, which says nothing where no axis is known; leave it out");
  }
  double sigma_radps = defaults.sigma_radps;
  constexpr double kBelowZero = -std::numeric_limits<double>::denorm_min();
  double sigma_degps = 0.0;
  if (ReadAbove(item.Child("sigma_degps"), kBelowZero, "a number of at least zero", &sigma_degps)) {
    sigma_radps = kRadPerDeg * sigma_degps;
  }
  // A direction that is off by a small angle moves the rate across itself. One that is not known is
  // estimated.
  const double across_radps =
      rate.is_axis_known ? defaults.axis_sigma_rad * rate.rate_radps.norm() : 0.0;
  const Eigen::Vector3d along = rate.rate_radps.stableNormalized();
  rate.covariance_radps2 =
      sigma_radps * sigma_radps * Eigen::Matrix3d::Identity() +
      across_radps * across_radps * (Eigen::Matrix3d::Identity() - along * along.transpose());
  item.Optional("id", &rate.id);
  item.RejectUnknown();
  return rate;
}

/// The members of the list at `key`, which is all there is in the file.
template <typename Read>
auto ReadList(const std::string& path, std::string_view key, Read read)
    -> Result<std::vector<decltype(read(std::declval<YamlReader>()))>> {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader file, YamlReader::FromFile(path));
  std::vector<decltype(read(std::declval<YamlReader>()))> values;
  for (const YamlReader& item : file.RequireChild(key).Items()) values.push_back(read(item));
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
  return ReadList(path, "turns", [&](const YamlReader& item) { return ReadTurn(item, defaults); });
}

Result<std::vector<StatedRate>> ReadStatedRates(const std::string& path,
                                                const RateDefaults& defaults) {
  return ReadList(path, "rates", [&](const YamlReader& item) { return ReadRate(item, defaults); });
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
