// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "io/field_reader.h"
#include "io/yaml_values.h"
#include "tree/json.h"

namespace truetriad {

// SchemaOf gives the JSON Schema (draft 2020-12) of a kind of value. Editors use the schema to
// complete and check the files that users write. It accepts all that ReadAs accepts, except numbers
// in quotes. The pointer only selects the type of the value.

/// The schema of a value that fits either schema. If both are lists of words, they become one list.
Json AnyOf(const Json& first, const Json& second);
/// The schema of one of these words. `true` and `false` become truth values, as in YAML.
Json WordSchema(const std::vector<std::string_view>& words);
/// The schema of a number in the range.
Json RangeSchema(const Range& range, std::string_view type);
Json ListSchema(const Json& items);

template <typename Number>
requires std::is_arithmetic_v<Number> Json SchemaOf(const Range& range, const Number*) {
  return RangeSchema(range, std::is_integral_v<Number> ? "integer" : "number");
}
Json SchemaOf(const Entries& entries, const Eigen::Vector3d*);
Json SchemaOf(const Entries& entries, const Eigen::Matrix3d*);
Json SchemaOf(BodyAxis, const Eigen::Vector3d*);
Json SchemaOf(NumberList, const std::vector<double>*);
Json SchemaOf(const Text&, const std::string*);
Json SchemaOf(FormatVersion, const int*);
Json SchemaOf(Flag, const bool*);
Json SchemaOf(const OnlyWord& word, const OnlyWord*);
Json SchemaOf(Seed, const std::uint64_t*);
Json SchemaOf(const ReadingsUnit& kind, const Unit*);
Json SchemaOf(const StatedNumber& kind, const Stated*);

template <typename T, std::size_t N>
Json SchemaOf(const NamedValues<T, N>& choices, const T*) {
  std::vector<std::string_view> names;
  for (const auto& entry : choices.entries) names.push_back(entry.second);
  return WordSchema(names);
}
template <typename Kind, typename Value>
Json SchemaOf(const Kind& kind, const std::optional<Value>*) {
  return SchemaOf(kind, static_cast<const Value*>(nullptr));
}
template <typename Kind, typename Any, typename Value>
Json SchemaOf(const OrWord<Kind, Any>& kind, const std::optional<Value>*) {
  return AnyOf(WordSchema({kind.word}), SchemaOf(kind.kind, static_cast<const Value*>(nullptr)));
}
template <typename Kind, typename Value>
Json SchemaOf(const OrWord<Kind, Value>& kind, const Open<Value>*) {
  return AnyOf(WordSchema({kind.word}), SchemaOf(kind.kind, static_cast<const Value*>(nullptr)));
}
template <typename Kind, typename Value>
Json SchemaOf(const ListOf<Kind>& list, const std::vector<Value>*) {
  return ListSchema(SchemaOf(list.kind, static_cast<const Value*>(nullptr)));
}
template <typename T, std::size_t N, typename Flags>
Json SchemaOf(const ListOf<NamedValues<T, N>>& names, const Flags*) {
  return ListSchema(SchemaOf(names.kind, static_cast<const T*>(nullptr)));
}
template <typename Kind, typename Value>
Json SchemaOf(const MapOf<Kind>& map, const std::map<std::string, Value>*) {
  return {{"type", "object"},
          {"additionalProperties", SchemaOf(map.kind, static_cast<const Value*>(nullptr))}};
}

/// Makes the schema of what a FieldReader reads with the same list of fields. Conditions on several
/// keys are left out.
///
/// A list of fields is walked four times. The list may ask whether a key is there, and of which
/// form a value is; the walks combine the answers yes and no to these two kinds of questions. A key
/// may have any value that it has in one of the walks. It is required if all walks require it.
class FieldSchema {
 public:
  static constexpr bool kReads = false, kWrites = false;

  /// The schema of a map with the fields that `of` lists.
  template <typename Of>
  static Json OfMap(const Of& of, const std::vector<MapWord>& words = {}) {
    FieldSchema visit;
    for (visit.walk_ = kWalks; visit.walk_-- > 0;) of(visit);
    return visit.Taken(words);
  }
  /// The schema of a whole file with the fields that `of` lists.
  template <typename Of>
  static Json OfFile(std::string_view title, const Of& of) {
    Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}};
    schema.update(OfMap(of));
    return schema;
  }

  template <typename Value, typename Kind, typename... Chosen>
  bool operator()(std::string_view key, const Value&, const Kind& kind, const Chosen&...) {
    Add(key, SchemaOf(kind, static_cast<const Value*>(nullptr)));
    return false;
  }
  template <typename Value, typename Kind>
  bool operator()(const QuantityKeys& keys, const Value& value, const Kind& kind) {
    for (const QuantityKey& key : keys) (*this)(key.key, value, kind);
    return false;
  }
  template <typename Of>
  void Map(std::string_view key, const Of& of, const MapForm& form = {}) {
    Add(key, OfMap(of, form.words));
  }
  template <typename Item, typename Of>
  void List(std::string_view key, const std::vector<Item>&, const Of& of) {
    Add(key, ListSchema(OfMap([&of](FieldSchema& visit) {
          Item item{};
          of(visit, item);
        })));
  }
  /// Adds a schema that the values of a key may have. An empty schema, which allows any value,
  /// counts only if the key has no other.
  void Add(std::string_view key, const Json& schema);

  static void Expect(bool, std::string_view, std::string_view = "") {}
  void Require(std::string_view key) { required_[walk_].emplace(key); }

  bool Has(std::string_view key) {
    Add(key, Json::object());
    return walk_ % 2 == 1;
  }
  bool IsMap(std::string_view, bool) const { return walk_ / 2 == 1; }
  bool IsList(std::string_view, bool) const { return walk_ / 2 == 1; }
  bool IsNumber(std::string_view) const { return walk_ / 2 == 1; }
  bool Says(std::string_view key, std::string_view word) {
    Add(key, WordSchema({word}));
    return walk_ / 2 == 1;
  }
  static bool Shows(bool) { return true; }
  template <typename Value>
  bool Is(std::string_view key, Value& value, Value when) {
    if (!Has(key)) return false;
    value = when;
    return true;
  }
  static std::string PlaceOf(std::string_view = "") { return {}; }

 private:
  Json Taken(const std::vector<MapWord>& words) const;

  static constexpr std::size_t kWalks = 4;  // 2 answers to each of 2 kinds of questions.
  std::size_t walk_ = 0;                    ///< Counts down; its two bits are the answers.
  Json properties_ = Json::object();
  std::array<std::set<std::string>, kWalks> required_;  ///< Required keys, by walk.
};

}  // namespace truetriad
