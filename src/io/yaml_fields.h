// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "tree/fields.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Visitors of lists of fields (tree/fields.h) that write a value as YAML and read it back.

/// Writes fields, either each on its own line, indented by `indent`, or all in one line.
class YamlFieldWriter {
 public:
  static constexpr bool kReads = false;
  enum class Place { kLines, kFlowMap, kRow };

  /// `digits`: significant digits, as in YamlText.
  explicit YamlFieldWriter(int digits = 0, std::size_t indent = 0, Place place = Place::kLines)
      : digits_(digits), indent_(indent, ' '), place_(place) {}

  template <typename T>
  bool operator()(std::string_view key, const T& field, Style style = Style::kUsual) {
    if constexpr (kIsOptional<T>) {
      return field && (*this)(key, *field, style);
    } else {
      Add(key, ValueOf(field, style));
      return true;
    }
  }

  template <typename T>
  bool If(bool stated, std::string_view key, const T& field, Style style = Style::kUsual) {
    return stated && (*this)(key, field, style);
  }

  template <typename T>
  bool OrNull(std::string_view key, const std::optional<T>& field, Style style = Style::kUsual) {
    if (!field) Add(key, "null");
    return (*this)(key, field, style);
  }

  template <typename GroupFields>
  void Group(std::string_view key, Style style, const GroupFields& fields) {
    Add(key, MapOf(style, fields));
  }

  template <typename T>
  void Named(bool stated, std::string_view key, const std::vector<T>& list) {
    if (!stated) return;
    Group(key, Style::kUsual, [&list](YamlFieldWriter& map) {
      for (const T& item : list) map(item.name, item, Style::kFlow);
    });
  }

  void Comment(std::string_view text) { text_.append(indent_).append("# ").append(text) += '\n'; }

  template <typename Wrong>
  void Check(std::string_view, const Wrong&) {}

  const std::string& text() const { return text_; }

 private:
  // A value follows its key on the same line, unless it begins with a line end.
  void Add(std::string_view key, const std::string& value) {
    const std::string_view blank = value.starts_with('\n') ? "" : " ";
    if (place_ == Place::kLines) {
      text_.append(indent_).append(key).append(":").append(blank).append(value);
      if (!text_.ends_with('\n')) text_ += '\n';
    } else if (place_ == Place::kFlowMap) {
      text_.append(text_.empty() ? " " : ", ").append(key).append(":").append(blank).append(value);
    } else {
      text_.append(text_.empty() ? "" : ", ").append(value);
    }
  }

  template <typename MapFields>
  std::string MapOf(Style style, const MapFields& fields) const {
    const bool is_flow = style == Style::kFlow || place_ != Place::kLines;
    YamlFieldWriter inner(
        digits_, is_flow ? 0 : indent_.size() + 2, is_flow ? Place::kFlowMap : Place::kLines);
    fields(inner);
    if (is_flow) return "{" + inner.text_ + " }";
    return inner.text_.empty() ? "{}" : "\n" + inner.text_;
  }

  template <typename T>
  std::string ValueOf(const T& field, Style style) const {
    if constexpr (HasFields<T>) {
      return MapOf(style, [&field](YamlFieldWriter& inner) { Fields(inner, field); });
    } else if constexpr (kIsList<T>) {
      return ListOf(field, style);
    } else if constexpr (kIsVector<T>) {
      std::string list = (YamlText(digits_) << field).str();
      return place_ == Place::kRow ? list.substr(1, list.size() - 2) : list;
    } else {
      return ScalarOf(field);
    }
  }

  template <typename T>
  std::string ListOf(const std::vector<T>& items, Style style) const {
    const bool has_lines = HasFields<T> || style == Style::kBlocks;
    if (items.empty()) return "[]";
    std::string text = has_lines ? "\n" : "[";
    for (const T& item : items) {
      if (has_lines) {
        text.append(indent_).append("  - ").append(ItemOf(item, style)) += '\n';
      } else {
        text.append(&item == &items.front() ? "" : ", ").append(ItemOf(item, style));
      }
    }
    return has_lines ? text : text + "]";
  }

  template <typename T>
  std::string ItemOf(const T& item, Style style) const {
    if constexpr (!HasFields<T>) {
      return ScalarOf(item);
    } else if (style == Style::kBlocks) {
      // The first field follows the dash.
      YamlFieldWriter inner(digits_, indent_.size() + 4);
      Fields(inner, item);
      return inner.text_.substr(inner.indent_.size(),
                                inner.text_.size() - inner.indent_.size() - 1);
    } else {
      YamlFieldWriter inner(digits_, 0, kIsRow<T> ? Place::kRow : Place::kFlowMap);
      Fields(inner, item);
      return kIsRow<T> ? "[" + inner.text_ + "]" : "{" + inner.text_ + " }";
    }
  }

  std::string ScalarOf(const std::string& text) const { return (YamlText() << Quoted{text}).str(); }
  template <typename T>
  std::string ScalarOf(const Word<T>& word) const {
    return std::string(word.text);
  }
  template <typename T>
  std::string ScalarOf(const AxisLetterOf<T>& letter) const {
    return std::string(1, kAxisLetters[static_cast<std::size_t>(letter.axis)]);
  }
  template <typename T>
  std::string ScalarOf(const T& value) const {
    if constexpr (std::is_enum_v<T>) {
      return std::string(WordsOf(value).first(value));
    } else {
      return (YamlText(digits_) << value).str();
    }
  }

  int digits_;
  std::string indent_;
  Place place_;
  std::string text_;
};

/// Reads any double that YamlText writes, also NaN and infinities, which YamlReader::Read refuses.
inline bool ReadNumber(YamlReader reader, double* value) {
  std::string text;
  if (reader.IsScalar() && reader.Read(&text)) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const auto& [word, number] : {std::pair(".nan", std::numeric_limits<double>::quiet_NaN()),
                                       std::pair(".inf", kInfinity),
                                       std::pair("-.inf", -kInfinity)}) {
      if (text == word) {
        *value = number;
        return true;
      }
    }
  }
  return reader.Read(value);
}

inline bool IsNull(const YamlReader& reader) {
  return reader && !reader.IsScalar() && !reader.IsSequence() && !reader.IsMap();
}

/// Reads a list of exactly values.size() numbers.
inline bool ReadNumbers(YamlReader reader, std::span<double> values) {
  if (!reader) return false;
  std::vector<YamlReader> items = reader.Items();
  if (items.size() != values.size()) {
    if (reader.IsSequence()) {
      reader.Fail("has " + std::to_string(items.size()) + " numbers; expected " +
                  std::to_string(values.size()));
    }
    return false;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!ReadNumber(items[i], &values[i])) return false;
  }
  return true;
}

template <typename Matrix>
bool ReadMatrix(YamlReader reader, Eigen::Index size, Matrix* matrix) {
  if (!reader) return false;
  std::vector<YamlReader> rows = reader.Items();
  if (rows.size() != static_cast<std::size_t>(size)) {
    if (reader.IsSequence()) {
      reader.Fail("has " + std::to_string(rows.size()) + " rows; expected " + std::to_string(size));
    }
    return false;
  }
  matrix->resize(size, size);
  Eigen::VectorXd row(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (!ReadNumbers(rows[static_cast<std::size_t>(i)], {row.data(), rows.size()})) return false;
    matrix->row(i) = row.transpose();
  }
  return true;
}

/// Reads a word that `from_name` knows.
template <typename T>
bool ReadWord(YamlReader reader, std::optional<T> (*from_name)(std::string_view), T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  const std::optional<T> known = from_name(word);
  if (!known) {
    reader.Fail("`" + word + "` is unknown to this version; a later version may have written it");
    return false;
  }
  *value = *known;
  return true;
}

/// Reads an axis: x, y or z.
inline void ReadAxis(YamlReader reader, int* axis) {
  std::string text;
  if (!reader.Read(&text)) return;
  const std::size_t place = text.size() == 1 ? kAxisLetters.find(text) : std::string_view::npos;
  if (place == std::string_view::npos) {
    reader.Fail("expected x, y or z");
  } else {
    *axis = static_cast<int>(place);
  }
}

/// Which numbers a file may hold: all that YamlText writes, or only finite ones.
enum class Numbers { kAny, kFinite };

/// Reads fields; errors are recorded in `map`. The caller rejects unknown keys.
template <Numbers kAllowed>
class NumbersFieldReader {
 public:
  static constexpr bool kReads = true;

  explicit NumbersFieldReader(YamlReader& map) : map_(map) {}

  template <typename T>
  bool operator()(std::string_view key, T&& field, Style = Style::kUsual) {
    if constexpr (kIsOptional<std::decay_t<T>>) {
      return If(false, key, field);
    } else {
      return ReadField(map_.RequireChild(key), field);
    }
  }

  template <typename T>
  bool If(bool, std::string_view key, T&& field, Style = Style::kUsual) {
    YamlReader child = map_.Child(key);
    if (!child) return false;
    if constexpr (kIsOptional<std::decay_t<T>>) {
      return ReadField(child, field.emplace());
    } else {
      return ReadField(child, field);
    }
  }

  template <typename T>
  bool OrNull(std::string_view key, std::optional<T>& field, Style = Style::kUsual) {
    const YamlReader child = map_.Child(key);
    return child && !IsNull(child) && ReadField(child, field.emplace());
  }

  template <typename GroupFields>
  void Group(std::string_view key, Style, const GroupFields& fields) {
    ReadMap(map_.RequireChild(key), fields);
  }

  template <typename T>
  void Named(bool, std::string_view key, std::vector<T>& list) {
    YamlReader map = map_.Child(key);
    for (const std::string& name : map.Keys()) {
      list.emplace_back().name = name;
      ReadMap(map.Child(name), [&list](NumbersFieldReader& inner) { Fields(inner, list.back()); });
    }
  }

  void Skip(std::string_view key) { map_.Child(key); }
  void Comment(std::string_view) {}

  /// If `key` is empty, the check concerns the whole map.
  template <typename Wrong>
  void Check(std::string_view key, const Wrong& wrong) {
    const std::string text(wrong());
    if (text.empty()) return;
    (key.empty() ? map_ : map_.Child(key)).Fail(text);
  }

 private:
  template <typename MapFields>
  static bool ReadMap(YamlReader map, const MapFields& fields) {
    if (!map) return false;
    NumbersFieldReader inner(map);
    fields(inner);
    map.RejectUnknown();
    return true;
  }

  template <typename T>
  static bool ReadField(YamlReader reader, T& field) {
    if constexpr (HasFields<T>) {
      return ReadMap(reader, [&field](NumbersFieldReader& inner) { Fields(inner, field); });
    } else if constexpr (kIsList<T>) {
      for (YamlReader& item : reader.Items()) {
        if constexpr (kIsRow<typename T::value_type>) {
          ReadRow(item, &field.emplace_back());
        } else {
          ReadField(item, field.emplace_back());
        }
      }
      return static_cast<bool>(reader);
    } else if constexpr (std::is_enum_v<T>) {
      return ReadWord(reader, WordsOf(field).second, &field);
    } else if constexpr (std::same_as<T, double>) {
      return kAllowed == Numbers::kFinite ? reader.Read(&field) : ReadNumber(reader, &field);
    } else if constexpr (kIsVector<T>) {
      return ReadNumbers(reader, {field.data(), static_cast<std::size_t>(field.size())});
    } else if constexpr (std::same_as<T, Eigen::Matrix3d>) {
      return ReadMatrix(reader, 3, &field);
    } else {
      return reader.Read(&field);
    }
  }
  template <typename T>
  static bool ReadField(YamlReader reader, Word<T>& word) {
    return IsNull(reader) || reader.Read(&word.text);
  }
  template <typename T>
  static bool ReadField(YamlReader reader, AxisLetterOf<T>& letter) {
    if (reader) ReadAxis(reader, &letter.axis);
    return static_cast<bool>(reader);
  }

  // Assigns the entries of a row, which is a list without keys, to its fields in order.
  struct Row {
    static constexpr bool kReads = true;
    std::vector<YamlReader> entries;
    std::size_t used = 0;
    bool only_counts = true;

    template <typename T>
    void operator()(std::string_view, T& field) {
      const std::size_t first = used;
      used += SizeOf(field);
      if (only_counts) return;
      if constexpr (kIsVector<T>) {
        for (std::size_t i = first; i < used; ++i) {
          ReadNumber(entries[i], &field[static_cast<Eigen::Index>(i - first)]);
        }
      } else {
        ReadField(entries[first], field);
      }
    }
    template <typename T>
    static std::size_t SizeOf(const T& field) {
      if constexpr (kIsVector<T>) return static_cast<std::size_t>(field.size());
      return 1;
    }
  };

  template <typename T>
  static void ReadRow(YamlReader& item, T* thing) {
    Row row{.entries = item.Items()};
    Fields(row, *thing);
    if (row.entries.size() != row.used) {
      item.Fail("has " + std::to_string(row.entries.size()) + " entries; expected " +
                std::to_string(row.used));
      return;
    }
    row.used = 0;
    row.only_counts = false;
    Fields(row, *thing);
  }

  YamlReader& map_;
};
using YamlFieldReader = NumbersFieldReader<Numbers::kAny>;

}  // namespace truetriad
