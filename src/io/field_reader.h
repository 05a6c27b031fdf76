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

// A value of a file that people write has one list of its fields, a function template of a visitor:
//   visit("scale", robust.scale, kPositive);            a key, what it says, what it may be
//   visit.Map("robust", [&](auto& visit) { … });        a map of further fields
//   visit.List("exclude", ranges, [](auto& visit, auto& range) { … });
//   visit.Expect(file_is_given, "expected `file:`");    what holds of several keys of one map
// FieldReader reads it, FieldWriter (config/fields.h) writes it. A document is read on top of those
// before it: what it does not say stays.

/// A word that may stand in the place of a map.
struct MapWord {
  std::string_view word;
  bool is_said = false;             ///< It is what is written.
  std::function<void()> take = {};  ///< What reading it does.
};

/// How a map is written, and the words that may stand in its place.
struct MapForm {
  bool is_there = true;
  bool is_flow = false;  ///< In one line.
  std::vector<MapWord> words = {};
};

class FieldReader {
 public:
  static constexpr bool kReads = true;
  explicit FieldReader(YamlReader map) : map_(std::move(map)) {}

  /// True when the value was read. `chosen`, of a writer, says what took the place of the value.
  template <typename Value, typename Kind, typename... Chosen>
  bool operator()(std::string_view key, Value&& value, const Kind& kind, const Chosen&...) {
    return ReadAs(kind, Child(key), &value);
  }

  /// Whichever of the keys is there; two at once are an error. The range is that of the number as
  /// it is written.
  template <typename Value, typename Kind>
  bool operator()(const QuantityKeys& keys, Value& value, const Kind& kind) {
    const QuantityKey* found = nullptr;
    for (const QuantityKey& key : keys) {
      YamlReader child = Child(key.key);
      if (child && found != nullptr) {
        child.Fail("says the same as `" + YamlReader(map_.Child(found->key)).name() +
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

  /// A list takes the place of what was said before.
  template <typename Item, typename Of>
  void List(std::string_view key, std::vector<Item>& items, const Of& of) {
    YamlReader list = Child(key);
    if (!list) return;
    items.clear();
    for (const YamlReader& item : list.Items()) {
      ReadMap(item, [&](FieldReader& visit) { of(visit, items.emplace_back()); });
    }
  }

  /// This map and no other kind of value: an error of the map, or of one of its keys that is there,
  /// unless `holds`.
  void Expect(bool holds, const std::string& problem, std::string_view key = "") {
    if (holds || !(key.empty() ? map_.IsMap() : Has(key))) return;
    (key.empty() ? map_ : YamlReader(map_.Child(key))).Fail(problem);
  }
  /// What is no map has its own error.
  void Require(std::string_view key) {
    if (map_.IsMap()) map_.RequireChild(key);
  }

  // What a list of fields asks about the key itself. A writer asks the value, which is the second
  // argument.
  bool Has(std::string_view key) { return bool(Child(key)); }
  bool IsMap(std::string_view key, bool) { return Child(key).IsMap(); }
  bool IsList(std::string_view key, bool) { return Child(key).IsSequence(); }
  bool IsNumber(std::string_view key) { return Child(key).IsScalar(); }
  bool Says(std::string_view key, std::string_view word) { return IsWord(Child(key), word); }
  /// All fields are read, whether or not they would be written.
  static bool Shows(bool) { return true; }
  /// The key says which of several things the map is about.
  template <typename Value>
  bool Is(std::string_view key, Value& value, Value when) {
    if (!Has(key)) return false;
    value = when;
    return true;
  }
  /// "file:line: key".
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
  std::set<std::string> keys_;  ///< That are known.
};

}  // namespace truetriad
