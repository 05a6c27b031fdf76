// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "config/documents.h"
#include "io/field_reader.h"
#include "io/yaml_text.h"

namespace truetriad {

/// Writes as YAML what a FieldReader reads: nested maps, one key per line. If no document states a
/// key, its line is marked as default.
class FieldWriter {
 public:
  static constexpr bool kReads = false, kWrites = true;
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
  /// Writes `chosen`. If `chosen` has replaced the value `auto`, a mark at the line says so.
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

  /// Writes one line of YAML; nothing if `text` is empty.
  void Line(std::string_view key, const std::string& text, std::string_view mark = "");
  template <typename Of>
  std::string Flow(const Of& of, int digits = 0) const {
    FieldWriter inside(*given_);
    inside.is_flow_ = true;
    inside.digits_ = digits;
    of(inside);
    return "{ " + inside.text_ + " }";
  }
  /// Appends `text` to a map that is being written on one line.
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
  std::string path_;  ///< Full name of the current map and a dot: "sensors.accelerometer."
  std::size_t depth_ = 0;
  bool is_flow_ = false;
  int digits_ = 0;
};

}  // namespace truetriad
