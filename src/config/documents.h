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

/// The place where each key is stated: "file:line", or the override's text (`--set=a.b=1`). The
/// map's keys are full names (a.b.c). A key with an empty place was filled in by the program.
using Places = std::map<std::string, std::string>;

/// The YAML documents that state one experiment or scenario, in reading order: a file that a user
/// writes, then one document per override (`--set=key.sub=value`, the value in YAML flow style).
class Documents {
 public:
  /// Error: an override is not one line of the form key.sub=value, or is not YAML.
  static Result<Documents> Of(const YamlReader& file, const std::vector<std::string>& overrides);

  /// All documents in reading order: the base if one was put below, the file, the overrides.
  std::deque<YamlReader>& all() { return documents_; }

  /// Adds a document that is read before the file. Documents are copied, never assigned: assigning
  /// to a YAML::Node changes all nodes that share its data.
  void PutBelow(const YamlReader& base) { documents_.push_front(base); }

  /// The place of each key. If several documents state a key, its place is in the last of them.
  Places AllPlaces() const;

  /// Adds the errors of all documents, except errors of a file about keys that an override
  /// replaces. Errors of overrides have no line.
  void CollectErrors(std::vector<Error>* errors) const;

 private:
  std::deque<YamlReader> documents_;
  std::vector<std::string> overridden_;  ///< Full names of the keys that the overrides replace.
};

/// Whether `place`, which may also be the name of a document, names an override.
bool IsOverride(std::string_view place);

/// Whether the document is an override of this key itself, not of a key below it.
bool IsOverrideOf(const YamlReader& document, std::string_view key);

/// Adds the place of each key below `reader`, and of each item of a list (`motion[1]`). Each name
/// in `places` begins with `prefix`.
void CollectPlaces(YamlReader reader, const std::string& prefix, Places* places);

/// The place that states `key`. If nothing states the key a.b.c, this is the place of a.b, or else
/// of a. Empty if none of these has a place.
std::string PlaceOf(std::string key, const Places& places);

/// Puts the folder of `file` in front of the relative `path` that is written in `file`. An absolute
/// or empty path stays as it is.
std::string Resolve(const std::string& path, const std::string& file);

}  // namespace truetriad
