// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/flags.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "base/spelling.h"
#include "base/utf8.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/tags.h"

DEFINE_string(input,
              "",
              "LOG: the log: a self-describing CSV (also .gz) or a manifest recording.yaml; for "
              "`convert`, another system's log; for `import`, another system's calibration");
DEFINE_string(output, "", "DIR: file or folder to write");
DEFINE_string(config,
              "",
              "EXPERIMENT.yaml: YAML file that describes the task; examples are in configs, all "
              "keys in docs");
DEFINE_string(calibration, "", "FILE: calibration.yaml written by `calibrate`");
DEFINE_string(poses,
              "",
              "HOW: how to find the poses: detect, every_row, every:N, column:NAME, file:PATH, "
              "sweep or sweep:SECONDS (default: as stated in the recording, else detect)");
DEFINE_string(set,
              "",
              "KEY=VALUE,...: values that replace those in the --config file, separated by commas, "
              "as in robust.loss=none,gauge=accel-z; commas inside [] or {} do not separate");

DEFINE_string(tag,
              "",
              "KEY=VALUE: a tag to record with the results, as in lot=L17; of the run: lot, "
              "station, operator, slot, fixture, order, note; of the unit: part, revision");
DEFINE_string(report,
              "",
              "PAGE.html: the HTML report: with `calibrate` whether to write it, true (default) or "
              "false; with other verbs the page to write");
DEFINE_bool(
    overwrite,
    false,
    "replace results of another unit, and files that are not exports, in the output folder");
DEFINE_string(fail_on, "", "WORD: the result that gives exit code 4");
DEFINE_string(to,
              "",
              "FORMAT,...: the format, from the list on this page or in `truetriad help export`");
DEFINE_string(instance,
              "",
              "N: the number of the sensor if there are several of its kind, as the other system "
              "counts them");
DEFINE_string(
    units,
    "",
    "UNIT[,UNIT]: units of the readings, as in g,deg/s,uT, if the format does not state them");
DEFINE_string(outside_limits,
              "refuse",
              "refuse|allow: refuse or allow exports of a unit that is outside its limits or "
              "refused by a person; the exported files state this");
DEFINE_bool(interactive,
            true,
            "whether the spheres of the HTML report can be turned; adds 1.7 MB (only if the "
            "program was built with Plotly)");
DEFINE_bool(json, false, "one JSON object on stdout instead of text");
DEFINE_bool(quiet, false, "no notes and no progress on stderr");

namespace truetriad {
namespace {

/// Names of tags in order, with their section in an experiment: "device." or "run.".
std::vector<std::pair<std::string_view, const char*>> TagNames() {
  std::vector<std::pair<std::string_view, const char*>> tags;
  for (const TagKey& tag : kDeviceTags) tags.emplace_back(tag.key, "device.");
  for (const TagKey& tag : kRunTags) tags.emplace_back(tag.key, "run.");
  return tags;
}

/// The tag that a mistaken comma put into a value: "station=S3" in "L17,station=S3". Empty: none.
std::string TagWithin(const std::string& value) {
  for (const auto& [name, place] : TagNames()) {
    const std::size_t at = value.find("," + std::string(name) + "=");
    if (at != std::string::npos) return value.substr(at + 1);
  }
  return "";
}

template <typename Number>
Result<Number> Parse(const std::string& flag, const std::string& text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) {
    return Error(ErrorCode::kInvalidArgument,
                 "--" + flag + ": `" + text + "` is not a valid number");
  }
  return value;
}

}  // namespace

std::vector<std::string> CommaSeparated(const std::string& values) {
  std::vector<std::string> items;
  std::istringstream list(values);
  for (std::string item; std::getline(list, item, ',');) items.push_back(item);
  return items;
}

std::vector<std::string> StatedInputs(const std::vector<std::string>& words) {
  std::error_code failure;
  std::vector<std::string> inputs = std::filesystem::exists(FLAGS_input, failure)
                                        ? std::vector<std::string>{FLAGS_input}
                                        : CommaSeparated(FLAGS_input);
  inputs.insert(inputs.end(), words.begin(), words.end());
  return inputs;
}

Error BadValue(std::string_view flag, const std::string& value, const std::string& what) {
  return Error(ErrorCode::kInvalidArgument, "--" + std::string(flag) + "=" + value + what);
}

Status CheckOneOf(std::string_view flag,
                  const std::string& value,
                  const std::vector<std::string>& words,
                  const std::string& is_not) {
  std::string expected;
  for (const std::string& word : words) {
    if (value == word) return {};
    const bool is_last = &word == &words.back();
    expected += (expected.empty() ? "" : is_last ? " or " : ", ") + word;
  }
  return BadValue(flag, value, is_not + "; expected " + expected);
}

Status CheckFailOn(const std::string& word) {
  if (FLAGS_fail_on.empty()) return {};
  return CheckOneOf("fail-on", FLAGS_fail_on, {word}, " is not known");
}

Result<bool> StatedReport(const std::string& hint) {
  if (FLAGS_report.empty()) return true;
  if (const Status valid = CheckOneOf("report", FLAGS_report, {"true", "false"}); !valid) {
    return Error(valid.error().code, valid.error().message + hint);
  }
  return FLAGS_report == "true";
}

Result<std::int64_t> ParseInteger(const std::string& flag, const std::string& text) {
  return Parse<std::int64_t>(flag, text);
}

Result<double> ParseReal(const std::string& flag, const std::string& text) {
  const Result<double> value = Parse<double>(flag, text);
  if (value && !std::isfinite(*value))
    return Error(ErrorCode::kInvalidArgument, "--" + flag + ": must be finite");
  return value;
}

Result<double> ParseDuration(const std::string& flag, const std::string& text) {
  constexpr std::string_view kUnits = "smhd";
  constexpr std::array<double, 4> kSeconds = {1.0, 60.0, 3600.0, 86400.0};
  const std::size_t unit = text.empty() ? kUnits.npos : kUnits.find(text.back());
  if (unit != kUnits.npos) {
    const Result<double> number = ParseReal(flag, text.substr(0, text.size() - 1));
    if (number && *number > 0.0) return *number * kSeconds[unit];
  }
  return BadValue(flag, text, ": expected a duration, as in 8h, 30m or 1d");
}

Result<std::optional<int>> ParseInstance() {
  if (FLAGS_instance.empty()) return std::optional<int>();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t instance, ParseInteger("instance", FLAGS_instance));
  if (instance < 0 || instance > std::numeric_limits<int>::max()) {
    return BadValue("instance", FLAGS_instance, ": no such instance; expected 0 or more");
  }
  return std::optional<int>(static_cast<int>(instance));
}

Result<bool> AllowsOutsideLimits() {
  TRUETRIAD_RETURN_IF_ERROR(
      CheckOneOf("outside-limits", FLAGS_outside_limits, {"refuse", "allow"}));
  return FLAGS_outside_limits == "allow";
}

Result<PerTriad<std::optional<std::string>>> ParseUnits() {
  PerTriad<std::optional<std::string>> units;
  for (const std::string& item : CommaSeparated(FLAGS_units)) {
    bool known = false;
    for (const Triad triad : kTriads) {
      if (!ParseTriadUnit(triad, item)) continue;
      if (units[triad] && item != "counts" && *units[triad] != "counts") {
        return Error(ErrorCode::kConflictingArguments,
                     "--units: `" + *units[triad] + "` and `" + item + "` are both units of the " +
                         std::string(TriadName(triad)) + "; give one");
      }
      if (!units[triad] || item != "counts") units[triad] = item;
      known = true;
    }
    if (!known) {
      return Error(ErrorCode::kInvalidArgument,
                   "--units: `" + item +
                       "` is not a unit; expected one of m/s^2, g, mg, rad/s, deg/s, uT, nT, mT, "
                       "T, G, mG, counts");
    }
  }
  return units;
}

ReportLooks StatedLooks() {
  return FLAGS_interactive ? ReportLooks{.plots = EmbeddedPlotScript()} : ReportLooks();
}

std::string Formatted(const char* format, ...) {
  std::array<char, 256> text{};
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(text.data(), text.size(), format, values);
  va_end(values);
  return text.data();
}

void Note(const std::string& text) {
  if (!FLAGS_quiet) std::fprintf(stderr, "%s\n", Printable(text).c_str());
}

void Warn(const std::string& text) {
  std::fprintf(stderr, "warning: %s\n", Printable(text).c_str());
}

std::vector<std::string> Overrides() {
  std::vector<std::string> items;
  std::string item;
  int depth = 0;
  char quote = '\0';
  for (const char c : FLAGS_set) {
    if (quote != '\0' && c != '\n') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == '\n' || (c == ',' && depth <= 0)) {
      items.push_back(std::exchange(item, ""));
      continue;
    }
    item += c;
  }
  if (!item.empty()) items.push_back(item);
  return items;
}

Result<std::vector<std::string>> OverridesAndTags() {
  std::vector<std::string> items = Overrides();
  std::istringstream lines(FLAGS_tag);
  std::set<std::string> keys;
  for (std::string tag; std::getline(lines, tag);) {
    const std::size_t equals = tag.find('=');
    const std::string key = tag.substr(0, equals);
    std::string place, list;
    std::vector<std::string_view> names;
    for (const auto& [name, of_name] : TagNames()) {
      if (name == key) place = of_name;
      names.push_back(name);
      list.append(list.empty() ? "" : ", ").append(name);
    }
    if (equals == std::string::npos || place.empty()) {
      const std::string what = equals == std::string::npos
                                   ? ": has no value"
                                   : ": `" + key + "` is not known" + DidYouMean(key, names);
      return BadValue("tag", tag, what + "; expected KEY=VALUE with one of " + list);
    }
    const std::string value = tag.substr(equals + 1);
    if (const std::string next = TagWithin(value); !next.empty()) {
      return BadValue(
          "tag",
          tag,
          ": this comma would be part of the value; give each tag its own flag, --tag=" + next);
    }
    if (!keys.insert(key).second) {
      return Error(ErrorCode::kConflictingArguments,
                   "--tag=" + tag + ": `" + key + "` is stated twice; leave one out");
    }
    YamlText item;
    item << place << key << "=" << Quoted{value};
    items.push_back(item.str());
  }
  return items;
}

}  // namespace truetriad
