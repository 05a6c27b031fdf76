// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "fleet/store.h"
#include "tree/fields.h"
#include "tree/json.h"

namespace truetriad::fleet {

// What a store keeps: Fields(visit, thing) calls visit(name, field) for each field of a struct, in
// the order of its columns. Tables, rows, lines of JSON and exports are all generated from it. A
// non-finite number is unknown or an open limit: NULL in tables, null in JSON.

/// The version of the fields, tables and lines of JSON; stores of another version are rejected.
inline constexpr int kSchemaVersion = 6;
inline constexpr std::string_view kSchemaVersionName = "schema_version";
/// Error (bad input): the version `found` in the store `name` is not kSchemaVersion, or empty (none
/// stated).
Status CheckSchemaVersion(const std::string& name, const std::string& found);

/// The table `run`; tags, inputs, readings, parameters, findings and judgements have their own.
void Fields(auto&& visit, Like<UnitRun> auto& run) {
  visit("run", run.id);
  visit("serial", run.serial);
  visit("log", run.log);
  visit("log_bytes", run.log_bytes);
  visit("log_modified_ns", run.log_modified_ns);
  visit("created", run.created);
  visit("software", run.software_version);
  visit("config_sha256", run.config_sha256);
  visit("shard", run.shard);
  visit("folder", run.folder);
  visit("verdict", run.verdict);
  visit("code", run.code);
  visit("message", run.message);
  visit("mode", run.mode);
  visit("wall_s", run.wall_s);
  visit("cpu_s", run.cpu_s);
  visit("effective_dof", run.effective_dof);
  visit("covariance", run.covariance);
  visit("temperature_degc", run.temperature_degc);
  visit("recorded", run.recorded);
  visit("recorded_by", run.recorded_by);
}

void Fields(auto&& visit, Like<InputFile> auto& input) {
  visit("file", input.file);
  visit("sha256", input.sha256);
  visit("samples", input.samples);
}

void Fields(auto&& visit, Like<SensorReadings> auto& readings) {
  visit("sensor", readings.sensor);
  visit("digest", readings.digest);
}

void Fields(auto&& visit, Like<Parameter> auto& parameter) {
  visit("name", parameter.name);
  visit("value", parameter.value);
  visit("sigma", parameter.sigma);
}

void Fields(auto&& visit, Like<LimitCheck> auto& check) {
  visit("name", check.name);
  visit("component", check.component);
  visit("lower", check.limit.lower);
  visit("target", check.limit.target);
  visit("upper", check.limit.upper);
  visit("value", check.worst);
  visit("sigma", check.sigma);
  visit("outside", check.outside);
  visit("pass", check.pass);
}

void Fields(auto&& visit, Like<Disposition> auto& disposition) {
  visit("disposition", disposition.id);
  visit("run", disposition.run);
  visit("created", disposition.created);
  visit("who", disposition.who);
  visit("verdict", disposition.verdict);
  visit("wrong_serial", disposition.wrong_serial);
  visit("why", disposition.why);
}

void Fields(auto&& visit, Like<StationCheck> auto& check) {
  visit("station_check", check.id);
  visit("station", check.station);
  visit("serial", check.serial);
  visit("created", check.created);
  visit("recorded", check.recorded);
  visit("agrees", check.agrees);
  visit("p", check.p);
  visit("largest", check.largest);
  visit("parameter", check.parameter);
  visit("log", check.log);
  visit("recording", check.recording);
  visit("repeatability", check.repeatability);
}

// Selections for queries to a store.

void Fields(auto&& visit, Like<Standing> auto& standing) {
  visit("run", standing.run);
  visit("first_verdict", standing.first_verdict);
  visit("final_verdict", standing.final_verdict);
  visit("attempts", standing.attempts);
  visit("disposed_by", standing.disposed_by);
  visit("disposed_why", standing.disposed_why);
  visit("disposed_at", standing.disposed_at);
  visit("log", standing.log);
  visit("recorded", standing.recorded);
  visit("recorded_by", standing.recorded_by);
}

/// Visits the name and value of every tag.
void TagFields(auto&& visit, Like<Tags> auto& tags) {
  for (const TagKey& tag : kDeviceTags) visit(tag.key, tags.*tag.value);
  for (const TagKey& tag : kRunTags) visit(tag.key, tags.*tag.value);
}

inline std::vector<std::string_view> TagNames() {
  std::vector<std::string_view> names;
  const Tags none;
  TagFields([&names](std::string_view name, const auto&) { names.push_back(name); }, none);
  return names;
}

/// A struct as a JSON object.
template <typename Thing>
Json TreeOf(const Thing& thing) {
  Json json = Json::object();
  Fields(
      [&json](const char* name, const auto& field) {
        using Field = std::decay_t<decltype(field)>;
        if constexpr (std::is_same_v<Field, Verdict>) {
          json[name] = VerdictName(field);
        } else if constexpr (std::is_same_v<Field, double>) {
          json[name] = std::isfinite(field) ? Json(field) : Json();
        } else if constexpr (kIsOptional<Field>) {
          json[name] = field ? Json(*field) : Json();
        } else if constexpr (std::is_same_v<Field, Tags>) {
          json[name] = JsonOf(field);
        } else {
          json[name] = field;
        }
      },
      thing);
  return json;
}

/// Sets the fields of a struct from the JSON of TreeOf; null leaves a field unchanged. Throws an
/// exception of the JSON library, or one with a message, if the JSON does not fit.
template <typename Thing>
void TakeTree(const Json& json, Thing* thing) {
  Fields(
      [&json](const char* name, auto& field) {
        using Field = std::decay_t<decltype(field)>;
        const Json& stated = json.at(name);
        if constexpr (std::is_same_v<Field, Verdict>) {
          const std::string verdict = stated;
          const std::optional<Verdict> known = VerdictFromName(verdict);
          if (!known) throw std::runtime_error("`" + verdict + "` is no verdict");
          field = *known;
        } else if constexpr (std::is_same_v<Field, double>) {
          if (!stated.is_null()) field = stated.get<double>();
        } else if constexpr (kIsOptional<Field>) {
          if (!stated.is_null()) field = stated.get<typename Field::value_type>();
        } else if constexpr (std::is_same_v<Field, Tags>) {
          field = TagsFrom(stated);
        } else {
          field = stated.get<Field>();
        }
      },
      *thing);
}

template <typename Thing>
Thing ThingFrom(const Json& json) {
  Thing thing;
  TakeTree(json, &thing);
  return thing;
}

/// JSON as one line. Invalid UTF-8 becomes U+FFFD.
inline std::string LineOfJson(const Json& json) {
  return json.dump(-1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + '\n';
}
/// The result of `read` for a line's JSON. Error (bad input): parsing or `read` threw an exception.
template <typename Read>
auto FromLine(std::string_view line, Read read) -> Result<decltype(read(Json()))> {
  try {
    return read(Json::parse(line));
  } catch (const std::exception& failure) {
    return Error(ErrorCode::kWrongFormat,
                 std::string("is not a valid record of a fleet run: ") + failure.what());
  }
}

}  // namespace truetriad::fleet
