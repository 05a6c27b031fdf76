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
#include "fleet/fields.h"
#include "model/finding_fields.h"
#include "report/content.h"
#include "tree/to_tree.h"
#include "truetriad/model/quality.h"
#include "verdict/presentation.h"

namespace truetriad::fleet {
namespace {

/// Splits each limit into its components, so that a line can examine every axis of its units.
std::vector<LimitCheck> ByComponent(const std::vector<LimitCheck>& limits) {
  std::vector<LimitCheck> list;
  for (const LimitCheck& check : limits) {
    LimitCheck one = check;
    one.components.clear();
    if (check.components.empty()) list.push_back(one);
    for (const LimitComponent& own : check.components) {
      // As in `check`, `component` is empty if the name includes the component.
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

/// A JSON list of TreeOf for each item.
template <typename Thing>
Json TreesOf(const std::vector<Thing>& things) {
  Json list = Json::array();
  for (const Thing& thing : things) list.push_back(TreeOf(thing));
  return list;
}

template <typename Thing>
void TakeTrees(const Json& list, std::vector<Thing>* things) {
  for (const Json& item : list) TakeTree(item, &things->emplace_back());
}

/// A name as of NewRunId for a time in microseconds since 1970.
std::string RunIdAt(std::int64_t us) {
  static std::mt19937 random(std::random_device{}());
  const auto seconds = static_cast<std::time_t>(us / 1'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 64> second{}, rest{};
  std::strftime(second.data(), second.size(), "%Y%m%dT%H%M%S", &utc);
  const auto part = static_cast<int>(us % 1'000'000);
  std::snprintf(rest.data(), rest.size(), ".%06dZ-%08x", part, static_cast<unsigned>(random()));
  return std::string(second.data()) + rest.data();
}

}  // namespace

const RunCode* RunCodeOf(std::string_view code) {
  // A code may end with a colon and any name, which are ignored here.
  const auto kind_of = [](std::string_view name) { return name.substr(0, name.find(':')); };
  const auto found = std::ranges::find_if(
      kRunCodes, [&](const RunCode& one) { return kind_of(one.name) == kind_of(code); });
  return found == kRunCodes.end() ? nullptr : &*found;
}

UnitRun UnitRunFrom(const Json& json) {
  UnitRun run;
  TakeTree(json, &run);
  run.tags = TagsFrom(json.at("tags"));
  TakeTrees(json.at("inputs"), &run.inputs);
  TakeTrees(json.at("readings"), &run.readings);
  for (const Json& item : json.at("parameters")) {
    run.parameters.push_back({item.at(0), item.at(1), item.at(2)});
  }
  for (const Json& item : json.at("findings")) run.findings.push_back(FindingFrom(item));
  TakeTrees(json.at("judgements"), &run.judgements);
  return run;
}

void SetTag(std::string_view name, const std::string& value, Tags* tags) {
  TagFields(
      [&](std::string_view key, std::string& own) {
        if (key == name) own = value;
      },
      *tags);
}

Json JsonOf(const Tags& tags) {
  Json json = Json::object();
  TagFields(
      [&json](std::string_view key, const std::string& value) {
        if (!value.empty()) json[std::string(key)] = value;
      },
      tags);
  return json;
}

Tags TagsFrom(const Json& json) {
  Tags tags;
  std::size_t known = 0;
  TagFields(
      [&](std::string_view key, std::string& value) {
        const auto found = json.find(key);
        if (found == json.end()) return;
        value = *found;
        ++known;
      },
      tags);
  if (known == json.size()) return tags;
  throw std::runtime_error("unknown tags among " + json.dump());
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

std::string ReasonOf(const Standing& unit) {
  const std::string verdict(VerdictWords(unit.final_verdict));
  if (unit.disposed_by.empty()) return verdict + " by its current run " + unit.run;
  return verdict + " by " + unit.disposed_by + " (" + unit.disposed_why + ")";
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
  if (rest == nullptr) return id + "+";  // Not made by this program.
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
  run->code = kLimit + worst.FullName();
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
  Json json = TreeOf(run);
  json["tags"] = JsonOf(run.tags);
  json["inputs"] = TreesOf(run.inputs);
  json["readings"] = TreesOf(run.readings);
  json["parameters"] = Json::array();
  for (const Parameter& parameter : run.parameters) {
    json["parameters"].push_back({parameter.name, parameter.value, parameter.sigma});
  }
  json["findings"] = ToTree(run.findings);
  json["judgements"] = TreesOf(run.judgements);
  return LineOfJson(json);
}

Result<UnitRun> ReadLine(std::string_view line) { return FromLine(line, UnitRunFrom); }

}  // namespace truetriad::fleet
