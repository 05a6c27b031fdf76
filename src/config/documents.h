// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "io/yaml_reader.h"
#include "truetriad/base/result.h"

namespace truetriad {

/// A file that people write and the overrides (`--set=key.sub=value`, the value in YAML flow style)
/// that are read on top of it, each a document of its own.
class Documents {
 public:
  /// Error: an override that is not a line of the form key.sub=value, or not YAML.
  static Result<Documents> Of(const YamlReader& file, const std::vector<std::string>& overrides);

  /// The file, then the overrides in their order.
  std::vector<YamlReader>& all() { return documents_; }

  /// Full names of all keys that any document has.
  std::set<std::string> Names() const;

  /// Where each of these keys stands: "file:line", or the override; of several documents the last.
  std::map<std::string, std::string> Places() const;

  /// Adds the errors of all documents, without those of the file about keys whose value an override
  /// replaces. An override itself has no lines to name.
  void CollectErrors(std::vector<Error>* errors) const;

 private:
  std::vector<YamlReader> documents_;
  std::vector<std::string> overridden_;  ///< Full names of the keys that the overrides replace.
};

/// Adds the full names of all keys below `reader`.
void CollectNames(YamlReader reader, const std::string& prefix, std::set<std::string>* names);

/// The place of a key, or of the longest part of it that is there: of a, a.b and a.b.c for a.b.c;
/// else empty.
std::string PlaceOf(std::string key, const std::map<std::string, std::string>& places);

/// `path` as seen from the folder of `file`; empty stays empty.
std::string Resolve(const std::string& path, const std::string& file);

}  // namespace truetriad
