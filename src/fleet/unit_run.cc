// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_run.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>

#include "calibrate/compared_values.h"
#include "json/verb_json.h"
#include "report/content.h"
#include "truetriad/model/limits.h"
#include "verdict/presentation.h"

namespace truetriad::fleet {
namespace {

/// Each number that a limit is for by itself, so that a line can look at every axis of its units.
std::vector<LimitCheck> ByComponent(const std::vector<LimitCheck>& limits) {
  std::vector<LimitCheck> list;
  for (const LimitCheck& check : limits) {
    LimitCheck one = check;
    one.components.clear();
    if (check.components.empty()) list.push_back(one);
    for (const LimitComponent& own : check.components) {
      // As in the check: a name that has its component does not say it again.
      one.component = check.component.empty() ? "" : own.component;
      one.worst = own.value, one.sigma = own.sigma, one.outside = own.outside, one.pass = own.pass;
      list.push_back(one);
    }
  }
  return list;
}

void TakeParameters(const Calibration& calibration, UnitRun* run) {
  if (calibration.covariance.parameters.empty()) return;
  const ComparedValues values = ValuesInFrame(SolutionOf(calibration));
  const auto size = static_cast<Eigen::Index>(values.names.size());
  run->parameters.reserve(values.names.size());
  run->covariance.reserve(static_cast<std::size_t>(size * (size + 1) / 2));
  for (Eigen::Index row = 0; row < size; ++row) {
    run->parameters.push_back({values.names[static_cast<std::size_t>(row)],
                               values.values[row],
                               std::sqrt(std::max(0.0, values.covariance(row, row)))});
    for (Eigen::Index col = 0; col <= row; ++col) {
      run->covariance.push_back(values.covariance(row, col));
    }
  }
}

Json OpenAsNull(double side) { return std::isfinite(side) ? Json(side) : Json(nullptr); }

Json JsonOf(const LimitCheck& check) {
  Json json = {{"name", check.name},
               {"component", check.component},
               {"lower", OpenAsNull(check.limit.lower)},
               {"upper", OpenAsNull(check.limit.upper)},
               {"value", check.worst},
               {"sigma", check.sigma},
               {"outside", check.outside},
               {"pass", check.pass}};
  if (check.limit.target) json["target"] = *check.limit.target;
  return json;
}

LimitCheck LimitCheckFrom(const Json& json) {
  LimitCheck check;
  check.name = json.at("name");
  check.component = json.at("component");
  if (!json.at("lower").is_null()) check.limit.lower = json["lower"];
  if (!json.at("upper").is_null()) check.limit.upper = json["upper"];
  if (json.contains("target")) check.limit.target = json["target"].get<double>();
  check.worst = json.at("value");
  check.sigma = json.at("sigma");
  check.outside = json.at("outside");
  check.pass = json.at("pass");
  return check;
}

/// The fields that are text, under their names in a line.
constexpr std::array<std::pair<const char*, std::string UnitRun::*>, 10> kTexts = {
    {{"run", &UnitRun::id},
     {"serial", &UnitRun::serial},
     {"log", &UnitRun::log},
     {"created", &UnitRun::created},
     {"software", &UnitRun::software_version},
     {"config_sha256", &UnitRun::config_sha256},
     {"shard", &UnitRun::shard},
     {"folder", &UnitRun::folder},
     {"code", &UnitRun::code},
     {"message", &UnitRun::message}}};

Verdict VerdictIn(const Json& json) {
  const std::string name = json.at("verdict");
  if (const std::optional<Verdict> verdict = VerdictFromName(name)) return *verdict;
  throw std::runtime_error("`" + name + "` is no verdict");
}

/// A name of NewRunId's kind for a moment, microseconds since 1970.
std::string RunIdAt(std::int64_t us) {
  static std::mt19937 random(std::random_device{}());
  const auto seconds = static_cast<std::time_t>(us / 1'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 64> text{};
  std::snprintf(text.data(),
                text.size(),
                "%04d%02d%02dT%02d%02d%02d.%06dZ-%08x",
                utc.tm_year + 1900,
                utc.tm_mon + 1,
                utc.tm_mday,
                utc.tm_hour,
                utc.tm_min,
                utc.tm_sec,
                static_cast<int>(us % 1'000'000),
                static_cast<unsigned>(random()));
  return text.data();
}

}  // namespace

UnitRun UnitRunFrom(const Json& json) {
  UnitRun run;
  for (const auto& [name, field] : kTexts) run.*field = json.at(name);
  run.verdict = VerdictIn(json);
  run.log_bytes = json.at("log_bytes");
  run.log_modified_ns = json.at("log_modified_ns");
  run.mode = json.value("mode", "");
  run.recorded = json.value("recorded", "");
  run.recorded_by = json.value("recorded_by", "");
  run.tags = TagsFrom(json.at("tags"));
  run.wall_s = json.at("wall_s");
  run.cpu_s = json.at("cpu_s");
  run.effective_dof = json.at("effective_dof");
  if (json.contains("temperature_degc")) run.temperature_degc = json["temperature_degc"];
  for (const Json& item : json.at("inputs")) {
    run.inputs.push_back({item.at("file"), item.at("sha256"), item.at("samples")});
  }
  for (const Json& item : json.at("parameters")) {
    run.parameters.push_back({item.at(0), item.at(1), item.at(2)});
  }
  run.covariance = json.at("covariance").get<std::vector<double>>();
  for (const Json& item : json.at("findings")) run.findings.push_back(FindingFrom(item));
  for (const Json& item : json.at("judgements")) run.judgements.push_back(LimitCheckFrom(item));
  return run;
}

void SetTag(std::string_view name, const std::string& value, Tags* tags) {
  for (const TagKey& tag : kDeviceTags) {
    if (tag.key == name) tags->*tag.value = value;
  }
  for (const TagKey& tag : kRunTags) {
    if (tag.key == name) tags->*tag.value = value;
  }
}

Json JsonOf(const Tags& tags) {
  Json json = Json::object();
  const auto add = [&](const TagKey& tag) {
    if (!(tags.*tag.value).empty()) json[std::string(tag.key)] = tags.*tag.value;
  };
  for (const TagKey& tag : kDeviceTags) add(tag);
  for (const TagKey& tag : kRunTags) add(tag);
  return json;
}

Tags TagsFrom(const Json& json) {
  Tags tags;
  std::size_t known = 0;
  const auto take = [&](const TagKey& tag) {
    const auto found = json.find(tag.key);
    if (found == json.end()) return;
    tags.*tag.value = *found;
    ++known;
  };
  for (const TagKey& tag : kDeviceTags) take(tag);
  for (const TagKey& tag : kRunTags) take(tag);
  if (known == json.size()) return tags;
  throw std::runtime_error("there are tags that no experiment has: " + json.dump());
}

Finding FindingFrom(const Json& json) {
  Finding finding;
  finding.code =
      FindingCodeFromName(json.at("code").get<std::string>()).value_or(FindingCode::kMessage);
  finding.severity =
      SeverityFromName(json.at("severity").get<std::string>()).value_or(Severity::kNote);
  if (json.contains("sensor")) finding.sensor = TriadFromName(json["sensor"].get<std::string>());
  if (json.contains("axis")) finding.axis = json["axis"].get<std::string>().at(0) - 'x';
  if (json.contains("pose")) finding.pose = json["pose"].get<int>();
  if (json.contains("values")) {
    for (const auto& [name, item] : json["values"].items()) {
      FindingValue value;
      value.name = name;
      const Json& number = item.at("value");
      value.value =
          number.is_null() ? std::numeric_limits<double>::quiet_NaN() : number.get<double>();
      if (item.contains("sigma") && !item["sigma"].is_null())
        value.sigma = item["sigma"].get<double>();
      value.unit = item.value("unit", "");
      finding.values.push_back(std::move(value));
    }
  }
  finding.treatment = TreatmentFromName(json.value("treatment", "")).value_or(Treatment::kNone);
  finding.text = json.at("text");
  finding.remedy = json.value("remedy", "");
  return finding;
}

std::string NewRunId() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return RunIdAt(std::chrono::duration_cast<std::chrono::microseconds>(now).count());
}

std::string NewRunIdAfter(const std::string& id) {
  std::string now = NewRunId();
  if (now > id) return now;
  std::tm utc{};
  const char* const rest = strptime(id.c_str(), "%Y%m%dT%H%M%S.", &utc);
  if (rest == nullptr) return id + "+";  // Not of this program's making.
  std::int64_t us = 0;
  std::from_chars(rest, id.c_str() + id.size(), us);
  return RunIdAt(std::int64_t{timegm(&utc)} * 1'000'000 + us + 1);
}

void Fill(const Calibration& calibration, UnitRun* run) {
  run->created = calibration.created;
  run->software_version = calibration.software_version;
  run->mode = ModeName(calibration.mode);
  run->tags = calibration.tags;
  run->effective_dof = calibration.quality.effective_dof;
  if (const auto& recorded = calibration.reference.recorded_degc) {
    run->temperature_degc = (*recorded)[1];
  }
  run->inputs = calibration.inputs;
  run->findings = calibration.findings;
  run->judgements = ByComponent(calibration.quality.limits);
  run->verdict = calibration.verdict();
  if (run->verdict == Verdict::kNoResult) {
    run->code = calibration.ReasonNotUsable();
    const Finding* const refusal = FirstRefusal(calibration.findings);
    run->message = refusal == nullptr ? run->code : refusal->Message();
    return;
  }
  TakeParameters(calibration, run);
  if (run->verdict != Verdict::kFail) return;
  const LimitCheck& worst = WorstLimit(calibration.quality.limits);
  run->code = "limit:" + worst.FullName();
  run->message = MissedText(worst);
}

void Fill(const Error& error, UnitRun* run) {
  run->verdict = Verdict::kNoResult;
  run->code =
      error.finding != nullptr ? FindingCodeName(error.finding->code) : InfoOf(error.code).name;
  run->message = error.message;
  if (error.finding != nullptr) run->findings.push_back(*error.finding);
}

std::string LineOf(const UnitRun& run) {
  Json json;
  for (const auto& [name, field] : kTexts) json[name] = run.*field;
  json["verdict"] = VerdictName(run.verdict);
  json["log_bytes"] = run.log_bytes;
  json["log_modified_ns"] = run.log_modified_ns;
  json["mode"] = run.mode;
  if (!run.recorded.empty()) {
    json["recorded"] = run.recorded;
    json["recorded_by"] = run.recorded_by;
  }
  json["tags"] = JsonOf(run.tags);
  json["wall_s"] = run.wall_s;
  json["cpu_s"] = run.cpu_s;
  json["effective_dof"] = run.effective_dof;
  if (std::isfinite(run.temperature_degc)) json["temperature_degc"] = run.temperature_degc;
  json["inputs"] = Json::array();
  for (const InputFile& input : run.inputs) {
    json["inputs"].push_back(
        {{"file", input.file}, {"sha256", input.sha256}, {"samples", input.samples}});
  }
  json["parameters"] = Json::array();
  for (const Parameter& parameter : run.parameters) {
    json["parameters"].push_back({parameter.name, parameter.value, parameter.sigma});
  }
  json["covariance"] = run.covariance;
  json["findings"] = ToJson(run.findings);
  json["judgements"] = Json::array();
  for (const LimitCheck& check : run.judgements) json["judgements"].push_back(JsonOf(check));
  return json.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + '\n';
}

Result<UnitRun> ReadLine(std::string_view line) {
  try {
    return UnitRunFrom(Json::parse(line));
  } catch (const std::exception& failure) {
    return Error(ErrorCode::kWrongFormat,
                 std::string("is no line of a fleet's run: ") + failure.what());
  }
}

}  // namespace truetriad::fleet
