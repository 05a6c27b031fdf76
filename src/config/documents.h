// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/yaml_reader.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// Where keys stand, by their full names: "file:line", or the override; empty: nowhere.
using Places = std::map<std::string, std::string>;

/// A file that people write and the overrides (`--set=key.sub=value`, the value in YAML flow style)
/// that are read on top of it, each a document of its own.
class Documents {
 public:
  /// Error: an override that is not a line of the form key.sub=value, or not YAML.
  static Result<Documents> Of(const YamlReader& file, const std::vector<std::string>& overrides);

  /// The file, then the overrides in their order.
  std::deque<YamlReader>& all() { return documents_; }

  /// A document that the file is read on top of. None is assigned to another: a YAML::Node that is
  /// assigned to changes all that share it.
  void PutBelow(const YamlReader& base) { documents_.push_front(base); }

  /// Where all keys stand; of several documents the last.
  Places AllPlaces() const;

  /// Adds the errors of all documents, without those of the file about keys whose value an override
  /// replaces. An override itself has no lines to name.
  void CollectErrors(std::vector<Error>* errors) const;

 private:
  std::deque<YamlReader> documents_;
  std::vector<std::string> overridden_;  ///< Full names of the keys that the overrides replace.
};

/// The place, or the file, is an override.
bool IsOverride(std::string_view place);

/// The document is an override of this key itself, not of one below it.
bool IsOverrideOf(const YamlReader& document, std::string_view key);

/// Notes where all keys below `reader` stand, and the items of lists (`motion[1]`), with `prefix`
/// in front of their names.
void CollectPlaces(YamlReader reader, const std::string& prefix, Places* places);

/// The place of a key, or of the longest part of it that has one: of a, a.b and a.b.c for a.b.c;
/// else empty.
std::string PlaceOf(std::string key, const Places& places);

/// `path` as seen from the folder of `file`; empty stays empty.
std::string Resolve(const std::string& path, const std::string& file);

}  // namespace truetriad
