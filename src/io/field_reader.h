// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/yaml_reader.h"
#include "io/yaml_values.h"

namespace truetriad {

// Each value in a file that users write has one list of its fields: a function template that takes
// a visitor.
//   visit("scale", robust.scale, kPositive);            a key, its value, its permitted range
//   visit.Map("robust", [&](auto& visit) { … });        a map of further fields
//   visit.List("exclude", ranges, [](auto& visit, auto& range) { … });
//   visit.Expect(file_is_given, "expected `file:`");    a condition on several keys of one map
// FieldReader reads such a list, FieldWriter (config/fields.h) writes it, FieldSchema
// (io/field_schema.h) states its JSON Schema. Several documents may be read into one value: if a
// document lacks a key, that field stays as it is.

/// A word that a file may state in place of a map, such as `auto`.
struct MapWord {
  std::string_view word;
  bool is_said = false;             ///< Writers: the word stands for the present value.
  std::function<void()> take = {};  ///< Sets the value that the word stands for.
};

/// How a map is written, and the words that may replace it.
struct MapForm {
  bool is_there = true;
  bool is_flow = false;  ///< Written on one line.
  std::vector<MapWord> words = {};
};

class FieldReader {
 public:
  static constexpr bool kReads = true, kWrites = false;
  explicit FieldReader(YamlReader map) : map_(std::move(map)) {}

  /// True if the value was read. Only writers use the last argument, the choice that replaced
  /// `auto`.
  template <typename Value, typename Kind, typename... Chosen>
  bool operator()(std::string_view key, Value&& value, const Kind& kind, const Chosen&...) {
    return ReadAs(kind, Child(key), &value);
  }

  /// Reads the one of `keys` that is present; two at once are an error. The permitted range applies
  /// to the number as written in the file.
  template <typename Value, typename Kind>
  bool operator()(const QuantityKeys& keys, Value& value, const Kind& kind) {
    const QuantityKey* found = nullptr;
    for (const QuantityKey& key : keys) {
      YamlReader child = Child(key.key);
      if (child && found != nullptr) {
        child.Fail("states the same quantity as `" + YamlReader(map_.Child(found->key)).name() +
                   "`; keep one");
      }
      if (child && found == nullptr) found = &key;
    }
    if (found == nullptr) return false;
    Value number = value;
    if (!ReadAs(kind, map_.Child(found->key), &number)) return false;
    value = found->scale * number;
    return true;
  }

  template <typename Value, typename Kind>
  bool operator()(const QuantityKeys& keys, std::optional<Value>& value, const Kind& kind) {
    Value number = value ? *value : Value();
    if (!(*this)(keys, number, kind)) return false;
    value = number;
    return true;
  }

  template <typename Of>
  void Map(std::string_view key, const Of& of, const MapForm& form = {}) {
    if (YamlReader child = Child(key)) ReadMap(std::move(child), of, form);
  }

  /// The list replaces the list of an earlier document.
  template <typename Item, typename Of>
  void List(std::string_view key, std::vector<Item>& items, const Of& of) {
    YamlReader list = Child(key);
    if (!list) return;
    items.clear();
    for (const YamlReader& item : list.Items()) {
      ReadMap(item, [&](FieldReader& visit) { of(visit, items.emplace_back()); });
    }
  }

  /// If `holds` is false, records an error: at the map if `key` is empty, otherwise at the value of
  /// `key`, if the map has this key. If the value should be a map but is not, it has an error
  /// already, and none is added.
  void Expect(bool holds, const std::string& problem, std::string_view key = "") {
    if (holds || !(key.empty() ? map_.IsMap() : Has(key))) return;
    (key.empty() ? map_ : YamlReader(map_.Child(key))).Fail(problem);
  }
  /// Records an error if the map lacks `key`. If the value is not a map, it has an error already.
  void Require(std::string_view key) {
    if (map_.IsMap()) map_.RequireChild(key);
  }

  // A list of fields uses these functions to ask about a key. A reader answers from the file. A
  // writer returns the second argument, which follows from the present value.
  bool Has(std::string_view key) { return bool(Child(key)); }
  bool IsMap(std::string_view key, bool) { return Child(key).IsMap(); }
  bool IsList(std::string_view key, bool) { return Child(key).IsSequence(); }
  bool IsNumber(std::string_view key) { return Child(key).IsScalar(); }
  bool Says(std::string_view key, std::string_view word) { return IsWord(Child(key), word); }
  /// A reader reads all fields, also those that a writer would leave out.
  static bool Shows(bool) { return true; }
  /// If the map has `key`, sets `value` to `when`, the alternative that this key stands for.
  template <typename Value>
  bool Is(std::string_view key, Value& value, Value when) {
    if (!Has(key)) return false;
    value = when;
    return true;
  }
  /// Where `key`, or the map if `key` is empty, is stated: "file:line: key".
  std::string PlaceOf(std::string_view key = "");

  YamlReader& map() { return map_; }
  YamlReader Child(std::string_view key) {
    keys_.emplace(key);
    return map_.Child(key);
  }

  /// Reads the fields that `of` lists; any other key is an error.
  template <typename Of>
  static void ReadMap(YamlReader map, const Of& of, const MapForm& form = {}) {
    for (const MapWord& word : form.words) {
      if (IsWord(map, word.word)) return word.take ? word.take() : void();
    }
    FieldReader visit(std::move(map));
    of(visit);
    visit.End(form);
  }

 private:
  void End(const MapForm& form);

  YamlReader map_;
  std::set<std::string> keys_;  ///< All keys that were asked for.
};

}  // namespace truetriad
