// SPDX-License-Identifier: Apache-2.0
#include "config/documents.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <utility>

namespace truetriad {
namespace {

/// An override's name in places and messages begins with this text.
constexpr std::string_view kOverride = "--set=";

/// Parses `key.sub=value` as a YAML document of its own.
Result<YamlReader> ParseOverride(const std::string& text) {
  const std::string name = std::string(kOverride) + text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || text.find_first_of("\n\r") != std::string::npos) {
    return Error(
        ErrorCode::kInvalidArgument, {name}, "expected one line of the form key.sub=value");
  }
  std::string yaml;
  std::string indent;
  std::string rest = text.substr(0, equals);
  while (!rest.empty()) {
    const std::size_t dot = rest.find('.');
    yaml += (indent.empty() ? "" : "\n") + indent + rest.substr(0, dot) + ":";
    indent += "  ";
    rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
  }
  yaml += " " + text.substr(equals + 1);
  return YamlReader::FromText(yaml, name);
}

}  // namespace

Result<Documents> Documents::Of(const YamlReader& file, const std::vector<std::string>& overrides) {
  Documents documents;
  documents.documents_.push_back(file);
  for (const std::string& text : overrides) {
    TRUETRIAD_ASSIGN_OR_RETURN(YamlReader document, ParseOverride(text));
    documents.documents_.push_back(document);
    documents.overridden_.push_back(text.substr(0, text.find('=')));
  }
  return documents;
}

void Documents::CollectErrors(std::vector<Error>* errors) const {
  for (const YamlReader& document : documents_) {
    const bool is_override = IsOverride(document.file());
    for (const Error& error : document.errors()) {
      const auto concerns = [&error](const std::string& name) {
        return error.key == name || error.key.starts_with(name + ".");
      };
      if (is_override) {
        errors->push_back(ErrorIn(error.code, document.file(), error.What()));
      } else if (std::none_of(overridden_.begin(), overridden_.end(), concerns)) {
        errors->push_back(error);
      }
    }
  }
}

Places Documents::AllPlaces() const {
  Places places;
  for (const YamlReader& document : documents_) CollectPlaces(document, "", &places);
  return places;
}

void CollectPlaces(YamlReader reader, const std::string& prefix, Places* places) {
  if (!reader.IsMap()) return;
  const auto note = [&](const YamlReader& value) {
    (*places)[prefix + value.name()] =
        IsOverride(value.file()) ? value.file() : value.file() + ":" + std::to_string(value.line());
  };
  for (const std::string& key : reader.Keys()) {
    YamlReader child = reader.Child(key);
    note(child);
    if (child.IsSequence()) std::ranges::for_each(child.Items(), note);
    CollectPlaces(child, prefix, places);
  }
}

bool IsOverride(std::string_view place) { return place.starts_with(kOverride); }

bool IsOverrideOf(const YamlReader& document, std::string_view key) {
  return document.file().starts_with(std::string(kOverride).append(key) + "=");
}

std::string PlaceOf(std::string key, const Places& places) {
  while (!key.empty()) {
    const auto found = places.find(key);
    if (found != places.end() && !found->second.empty()) return found->second;
    const std::size_t dot = key.rfind('.');
    key.erase(dot == std::string::npos ? 0 : dot);
  }
  return {};
}

std::string Resolve(const std::string& path, const std::string& file) {
  if (path.empty()) return path;
  return (std::filesystem::path(file).parent_path() / path).string();
}

}  // namespace truetriad
