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

/// The place of each key by its full name: "file:line", or the override; empty: no place.
using Places = std::map<std::string, std::string>;

/// A file that a user writes and the overrides (`--set=key.sub=value`, the value in YAML flow
/// style) that are read after it, each as a document of its own.
class Documents {
 public:
  /// Error: an override that is not a line of the form key.sub=value, or not YAML.
  static Result<Documents> Of(const YamlReader& file, const std::vector<std::string>& overrides);

  /// The file, then the overrides in their order.
  std::deque<YamlReader>& all() { return documents_; }

  /// Adds a document that is read before the file. No document is assigned to another: an assigned
  /// YAML::Node changes all that share it.
  void PutBelow(const YamlReader& base) { documents_.push_front(base); }

  /// The places of all keys; for a key in several documents that of the last.
  Places AllPlaces() const;

  /// Adds the errors of all documents, except those of the file about keys whose value an override
  /// replaces. The error of an override has no line.
  void CollectErrors(std::vector<Error>* errors) const;

 private:
  std::deque<YamlReader> documents_;
  std::vector<std::string> overridden_;  ///< Full names of the keys that the overrides replace.
};

/// Whether the place, or the file, is an override.
bool IsOverride(std::string_view place);

/// Whether the document is an override of this key itself, not of one below it.
bool IsOverrideOf(const YamlReader& document, std::string_view key);

/// Adds the places of all keys below `reader` and of the items of lists (`motion[1]`), with
/// `prefix` in front of their names.
void CollectPlaces(YamlReader reader, const std::string& prefix, Places* places);

/// The place of a.b.c, else of a.b, else of a: of the longest part of `key` that has one; else
/// empty.
std::string PlaceOf(std::string key, const Places& places);

/// `path` relative to the folder of `file`; empty stays empty.
std::string Resolve(const std::string& path, const std::string& file);

}  // namespace truetriad
