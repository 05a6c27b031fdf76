// SPDX-License-Identifier: Apache-2.0
#include "config/documents.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <utility>

namespace truetriad {
namespace {

/// How messages name an override.
constexpr std::string_view kOverride = "--set=";

/// `key.sub=value` as a YAML document of its own.
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

/// Adds the errors of a document, without those about keys whose value an override replaces. An
/// override itself has no lines to name.
void CollectDocumentErrors(const YamlReader& document,
                           const std::vector<std::string>& overridden,
                           std::vector<Error>* errors) {
  const std::string& file = document.file();
  for (const Error& error : document.errors()) {
    const auto concerns = [&error](const std::string& name) {
      return error.key == name || error.key.starts_with(name + ".");
    };
    if (std::any_of(overridden.begin(), overridden.end(), concerns)) continue;
    errors->push_back(file.starts_with(kOverride) ? ErrorIn(error.code, file, error.What())
                                                  : error);
  }
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

std::set<std::string> Documents::Names() const {
  std::set<std::string> names;
  for (const YamlReader& document : documents_) CollectNames(document, "", &names);
  return names;
}

void Documents::CollectErrors(std::vector<Error>* errors) const {
  CollectDocumentErrors(documents_[0], overridden_, errors);
  for (std::size_t i = 1; i < documents_.size(); ++i) {
    CollectDocumentErrors(documents_[i], {}, errors);
  }
}

namespace {

void CollectPlaces(YamlReader reader,
                   const std::string& prefix,
                   std::map<std::string, std::string>* places) {
  if (!reader.IsMap()) return;
  for (const std::string& key : reader.Keys()) {
    YamlReader child = reader.Child(key);
    (*places)[prefix + child.name()] = child.file().starts_with(kOverride)
                                           ? child.file()
                                           : child.file() + ":" + std::to_string(child.line());
    CollectPlaces(child, prefix, places);
  }
}

}  // namespace

std::map<std::string, std::string> Documents::Places() const {
  std::map<std::string, std::string> places;
  for (const YamlReader& document : documents_) CollectPlaces(document, "", &places);
  return places;
}

std::string PlaceOf(std::string key, const std::map<std::string, std::string>& places) {
  while (!key.empty()) {
    if (const auto found = places.find(key); found != places.end()) return found->second;
    const std::size_t dot = key.rfind('.');
    key.erase(dot == std::string::npos ? 0 : dot);
  }
  return {};
}

void CollectNames(YamlReader reader, const std::string& prefix, std::set<std::string>* names) {
  if (!reader.IsMap()) return;
  for (const std::string& key : reader.Keys()) {
    YamlReader child = reader.Child(key);
    names->insert(prefix + child.name());
    CollectNames(child, prefix, names);
  }
}

std::string Resolve(const std::string& path, const std::string& file) {
  if (path.empty()) return path;
  return (std::filesystem::path(file).parent_path() / path).string();
}

}  // namespace truetriad
