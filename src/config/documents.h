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

/// From the full name of a key to the place that states it: "file:line" or an override; empty:
/// none.
using Places = std::map<std::string, std::string>;

/// A file that a user writes and the overrides (`--set=key.sub=value`, the value in YAML flow
/// style) that are read after it, each as a document of its own.
class Documents {
 public:
  /// Error: an override that is not a line of the form key.sub=value, or not YAML.
  static Result<Documents> Of(const YamlReader& file, const std::vector<std::string>& overrides);

  /// The file, then the overrides in their order.
  std::deque<YamlReader>& all() { return documents_; }

  /// Adds a document that is read before the file. Documents are copied, never assigned: assigning
  /// to a YAML::Node changes all nodes that share its data.
  void PutBelow(const YamlReader& base) { documents_.push_front(base); }

  /// Where each key is stated; if several documents state a key, the place in the last of them.
  Places AllPlaces() const;

  /// Adds the errors of all documents, except errors of a file about keys that an override
  /// replaces. Errors of overrides have no line.
  void CollectErrors(std::vector<Error>* errors) const;

 private:
  std::deque<YamlReader> documents_;
  std::vector<std::string> overridden_;  ///< Full names of the keys that the overrides replace.
};

/// Whether a place, or the file name of a document, is that of an override.
bool IsOverride(std::string_view place);

/// Whether the document is an override of this key itself, not of a key below it.
bool IsOverrideOf(const YamlReader& document, std::string_view key);

/// Adds the places of all keys below `reader` and of the items of lists (`motion[1]`), with
/// `prefix` in front of their names.
void CollectPlaces(YamlReader reader, const std::string& prefix, Places* places);

/// The place of `key`, such as a.b.c; if it has none, the place of a.b, or else of a. Empty if none
/// of them has a place.
std::string PlaceOf(std::string key, const Places& places);

/// `path`, which `file` states, with the folder of `file` in front; an empty path stays empty.
std::string Resolve(const std::string& path, const std::string& file);

}  // namespace truetriad
