// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/flags.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "base/utf8.h"
#include "io/yaml_text.h"
#include "truetriad/model/tags.h"

DEFINE_string(input,
              "",
              "the log: a self-describing CSV (also .gz), a manifest recording.yaml, or, for "
              "`convert`, another system's log, for `import` its calibration");
DEFINE_string(output, "", "file or folder to write");
DEFINE_string(config,
              "",
              "YAML file that describes the task; examples are in configs, all keys in docs");
DEFINE_string(calibration, "", "calibration.yaml written by `calibrate`");
DEFINE_string(poses,
              "",
              "how to find the poses: detect, every_row, every:N, column:NAME, file:PATH, sweep or "
              "sweep:SECONDS (default: as stated in the recording, else detect)");
DEFINE_string(set,
              "",
              "values that replace those in the --config file, separated by commas, as in "
              "robust.loss=none,gauge=accel-z; commas inside [] or {} do not separate");

DEFINE_string(tag,
              "",
              "what the record says of this run, as in lot=L17: lot, station, operator, slot, "
              "fixture, order, note, and part or revision of the unit");
DEFINE_string(
    report,
    "",
    "the HTML report: with `calibrate` whether to write it, true (default) or false; with "
    "other verbs the page to write");
DEFINE_string(fail_on, "", "what ends with exit code 4");
DEFINE_bool(json, false, "one JSON object on stdout instead of text");
DEFINE_bool(quiet, false, "no notes and no progress on stderr");

namespace truetriad {
namespace {

template <std::size_t N>
bool IsTag(const std::array<TagKey, N>& tags, std::string_view key) {
  return std::any_of(
      tags.begin(), tags.end(), [&](const TagKey& known) { return known.key == key; });
}

std::vector<std::string_view> TagNames() {
  std::vector<std::string_view> names;
  for (const TagKey& tag : kDeviceTags) names.push_back(tag.key);
  for (const TagKey& tag : kRunTags) names.push_back(tag.key);
  return names;
}

std::string TagList() {
  std::string list;
  for (const std::string_view name : TagNames()) {
    list.append(list.empty() ? "" : ", ").append(name);
  }
  return list;
}

/// "station=S3" of "L17,station=S3": what somebody took for a list. Empty: there is none.
std::string TagWithin(const std::string& value) {
  for (const std::string_view name : TagNames()) {
    const std::size_t at = value.find("," + std::string(name) + "=");
    if (at != std::string::npos) return value.substr(at + 1);
  }
  return "";
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

Status CheckFailOn(const std::string& word) {
  if (FLAGS_fail_on.empty() || FLAGS_fail_on == word) return {};
  return Error(ErrorCode::kInvalidArgument,
               "--fail-on=" + FLAGS_fail_on + " is not known; expected " + word);
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
    const bool is_of_device = IsTag(kDeviceTags, key);
    if (equals == std::string::npos || !(is_of_device || IsTag(kRunTags, key))) {
      return Error(ErrorCode::kInvalidArgument,
                   "--tag=" + tag +
                       (equals == std::string::npos
                            ? ": has no value"
                            : ": `" + key + "` is not known" + DidYouMean(key, TagNames())) +
                       "; expected KEY=VALUE with one of " + TagList());
    }
    const std::string value = tag.substr(equals + 1);
    if (const std::string next = TagWithin(value); !next.empty()) {
      return Error(ErrorCode::kInvalidArgument,
                   "--tag=" + tag + ": give the flag again for the next, --tag=" + next +
                       "; a comma belongs to the value");
    }
    if (!keys.insert(key).second) {
      return Error(ErrorCode::kConflictingArguments,
                   "--tag=" + tag + ": `" + key + "` is stated twice; leave one out");
    }
    YamlText item;
    item << (is_of_device ? "device." : "run.") << key << "=" << Quoted{value};
    items.push_back(item.str());
  }
  return items;
}

}  // namespace truetriad
