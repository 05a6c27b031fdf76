// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/documents.h"
#include "config/values.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/error.h"

namespace truetriad {

// A value of a file that people write has one list of its fields, a function template of a visitor:
//   visit("scale", robust.scale, kPositive);            a key, what it says, what it may be
//   visit.Map("robust", [&](auto& visit) { … });        a map of further fields
//   visit.List("exclude", ranges, [](auto& visit, auto& range) { … });
//   visit.Expect(file_is_given, "expected `file:`");    what holds of several keys of one map
// FieldReader reads it, FieldWriter writes it. A document is read on top of those before it: what
// it does not say stays.

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

/// Writes nested maps, one key a line, and marks the lines that no document asked for.
class FieldWriter {
 public:
  static constexpr bool kReads = false;
  explicit FieldWriter(const Places& given) : given_(&given) {}

  template <typename Value, typename Kind>
  bool operator()(std::string_view key, const Value& value, const Kind& kind) {
    if constexpr (std::is_same_v<Value, double>) {
      Line(key, (YamlText(digits_) << value).str());
    } else {
      Line(key, TextOf(kind, value));
    }
    return false;
  }
  template <typename Kind>
  bool operator()(std::string_view key, const std::optional<double>& value, const Kind& kind) {
    return value && (*this)(key, *value, kind);
  }
  /// A value that took the place of `auto` is marked so.
  template <typename Value, typename Kind>
  bool operator()(std::string_view key, const Value& value, const Kind& kind, const Value& chosen) {
    const std::string text = TextOf(kind, value), text_chosen = TextOf(kind, chosen);
    Line(key, text_chosen, text == text_chosen ? "" : "  # chosen by auto");
    return false;
  }
  template <typename Value, typename Kind>
  bool operator()(const QuantityKeys& keys, const Value& value, const Kind& kind) {
    return (*this)(keys.front().key, value, kind);
  }

  template <typename Of>
  void Map(std::string_view key, const Of& of, const MapForm& form = {}) {
    if (!form.is_there) return;
    for (const MapWord& word : form.words) {
      if (word.is_said) return Line(key, std::string(word.word));
    }
    if (is_flow_ || form.is_flow) return Line(key, Flow(of));
    text_ += std::string(2 * depth_++, ' ').append(key) + ":\n";
    path_.append(key) += '.';
    of(*this);
    path_.erase(path_.size() - key.size() - 1);
    --depth_;
  }

  template <typename Item, typename Of>
  void List(std::string_view key, const std::vector<Item>& items, const Of& of) {
    std::string text;
    for (Item item : items) {
      text += (text.empty() ? " " : ", ") + Flow([&](FieldWriter& visit) { of(visit, item); });
    }
    Line(key, "[" + text + (text.empty() ? "]" : " ]"));
  }

  /// One line of YAML; empty: none.
  void Line(std::string_view key, const std::string& text, std::string_view mark = "");
  template <typename Of>
  std::string Flow(const Of& of, int digits = 0) const {
    FieldWriter inside(*given_);
    inside.is_flow_ = true;
    inside.digits_ = digits;
    of(inside);
    return "{ " + inside.text_ + " }";
  }
  /// Within a map in one line.
  void Append(const std::string& text) { text_ += text; }

  static void Expect(bool, std::string_view, std::string_view = "") {}
  static void Require(std::string_view) {}
  static bool Has(std::string_view) { return false; }
  static bool IsMap(std::string_view, bool is_said) { return is_said; }
  static bool IsList(std::string_view, bool is_said) { return is_said; }
  static bool Says(std::string_view, std::string_view) { return false; }
  static bool Shows(bool is_shown) { return is_shown; }
  template <typename Value>
  static bool Is(std::string_view, const Value& value, Value when) {
    return value == when;
  }
  static std::string PlaceOf(std::string_view = "") { return {}; }

  const std::string& text() const { return text_; }

 private:
  const Places* given_;
  std::string text_;
  std::string path_;  ///< "sensors.accelerometer."
  std::size_t depth_ = 0;
  bool is_flow_ = false;
  int digits_ = 0;
};

}  // namespace truetriad
