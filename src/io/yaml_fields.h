// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "tree/fields.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Visitors of lists of fields (tree/fields.h) that write a value as YAML and read it from there.

/// Writes fields: each into a line of its own, `indent` deep, or behind each other in one.
class YamlFieldWriter {
 public:
  static constexpr bool kReads = false;
  enum class Place { kLines, kFlowMap, kRow };

  YamlFieldWriter(YamlText& out, int indent, Place place = Place::kLines)
      : out_(out), indent_(static_cast<std::size_t>(indent), ' '), place_(place) {}

  template <typename T>
  bool operator()(std::string_view key, const T& field, Style style = Style::kUsual) {
    if constexpr (kIsOptional<T>) {
      return field && (*this)(key, *field, style);
    } else {
      Begin(key);
      WriteField(field, style);
      if (place_ == Place::kLines && !ends_lines_) out_ << "\n";
      ends_lines_ = false;
      return true;
    }
  }

  template <typename T>
  bool If(bool stated, std::string_view key, const T& field, Style style = Style::kUsual) {
    return stated && (*this)(key, field, style);
  }

  template <typename T>
  bool OrNull(std::string_view key, const std::optional<T>& field, Style style = Style::kUsual) {
    return field ? (*this)(key, *field, style) : (*this)(key, Word{kNull});
  }

  template <typename GroupFields>
  void Group(std::string_view key, Style style, const GroupFields& fields) {
    Begin(key);
    WriteMap(style, fields);
    if (place_ == Place::kLines && !ends_lines_) out_ << "\n";
    ends_lines_ = false;
  }

  template <typename T>
  void Named(bool stated, std::string_view key, const std::vector<T>& list) {
    if (!stated) return;
    Group(key, Style::kUsual, [&list](YamlFieldWriter& map) {
      for (const T& item : list) {
        map.Group(
            item.name, Style::kFlow, [&item](YamlFieldWriter& inner) { Fields(inner, item); });
      }
    });
  }

  void Comment(std::string_view text) {
    Open();
    out_ << indent_ << "# " << text << "\n";
  }

  template <typename Wrong>
  void Check(std::string_view, const Wrong&) {}

 private:
  static constexpr std::string_view kNull = "null";

  // A map by lines begins behind the line of its key, where it has something.
  void Open() {
    if (std::exchange(is_to_open_, false)) out_ << "\n";
  }

  void Begin(std::string_view key) {
    Open();
    if (place_ == Place::kLines) {
      // The first field of an item stands behind its dash.
      out_ << (is_item_ && is_first_ ? std::string_view() : std::string_view(indent_));
    } else {
      out_ << (is_first_ ? (place_ == Place::kRow ? "" : " ") : ", ");
    }
    is_first_ = false;
    if (place_ == Place::kRow) return;
    out_ << key << ":";
    // What takes lines of its own begins with the end of this one.
    follows_key_ = true;
  }

  // The blank between a key and what stands in its line.
  void Blank() {
    if (std::exchange(follows_key_, false)) out_ << " ";
  }

  template <typename GroupFields>
  void WriteMap(Style style, const GroupFields& fields) {
    if (style == Style::kFlow || place_ != Place::kLines) {
      Blank();
      out_ << "{";
      YamlFieldWriter inner(out_, 0, Place::kFlowMap);
      fields(inner);
      out_ << " }";
    } else {
      follows_key_ = false;
      YamlFieldWriter inner(out_, static_cast<int>(indent_.size()) + 2);
      inner.is_to_open_ = true;
      fields(inner);
      if (inner.is_to_open_) out_ << " {}\n";
      ends_lines_ = true;
    }
  }

  template <typename T>
  void WriteField(const T& field, Style style) {
    if constexpr (HasFields<T>) {
      WriteMap(style, [&field](YamlFieldWriter& inner) { Fields(inner, field); });
    } else if constexpr (kIsList<T>) {
      WriteItems(field, style);
    } else if constexpr (kIsVector<T>) {
      Blank();
      for (Eigen::Index i = 0; place_ == Place::kRow && i < field.size(); ++i) {
        out_ << (i == 0 ? "" : ", ") << field[i];
      }
      if (place_ != Place::kRow) out_ << field;
    } else {
      Blank();
      WriteScalar(field);
    }
  }

  template <typename T>
  void WriteItems(const std::vector<T>& items, Style style) {
    if (HasFields<T> || style == Style::kBlocks) {
      out_ << (items.empty() ? " []" : "\n");
      follows_key_ = false;
      ends_lines_ = !items.empty();
      for (const T& item : items) WriteItem(item, style);
    } else if constexpr (!HasFields<T>) {
      Blank();
      std::string_view separator = "[";
      for (const T& item : items) {
        out_ << std::exchange(separator, ", ");
        WriteScalar(item);
      }
      out_ << (items.empty() ? "[]" : "]");
    }
  }

  template <typename T>
  void WriteItem(const T& item, Style style) {
    out_ << indent_ << "  - ";
    if constexpr (!HasFields<T>) {
      WriteScalar(item);
      out_ << "\n";
    } else if (style == Style::kBlocks) {
      YamlFieldWriter inner(out_, static_cast<int>(indent_.size()) + 4);
      inner.is_item_ = true;
      Fields(inner, item);
    } else {
      out_ << (kIsRow<T> ? "[" : "{");
      YamlFieldWriter inner(out_, 0, kIsRow<T> ? Place::kRow : Place::kFlowMap);
      Fields(inner, item);
      out_ << (kIsRow<T> ? "]\n" : " }\n");
    }
  }

  void WriteScalar(const std::string& text) { out_ << Quoted{text}; }
  template <typename T>
  void WriteScalar(const Word<T>& word) {
    out_ << std::string_view(word.text);
  }
  template <typename T>
  void WriteScalar(const AxisLetterOf<T>& letter) {
    out_ << kAxisLetters.substr(static_cast<std::size_t>(letter.axis), 1);
  }
  template <typename T>
  void WriteScalar(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      out_ << WordsOf(value).first(value);
    } else {
      out_ << value;
    }
  }

  YamlText& out_;
  std::string indent_;
  Place place_;
  bool is_item_ = false;
  bool is_first_ = true;
  bool follows_key_ = false;
  bool ends_lines_ = false;
  bool is_to_open_ = false;
};

/// Any double that YamlText writes, so also those that a person may not write in a configuration.
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

/// A list of exactly as many numbers as `values` has room for.
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

template <int kSize>
bool ReadVector(const YamlReader& reader, Eigen::Matrix<double, kSize, 1>* vector) {
  return ReadNumbers(reader, std::span<double>(vector->data(), kSize));
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

inline bool ReadMatrix3(const YamlReader& reader, Eigen::Matrix3d* matrix) {
  return ReadMatrix(reader, 3, matrix);
}

/// A word that `from_name` knows.
template <typename T>
bool ReadWord(YamlReader reader, std::optional<T> (*from_name)(std::string_view), T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  const std::optional<T> known = from_name(word);
  if (!known) {
    reader.Fail("`" + word + "` is unknown to this version; a later one may have written it");
    return false;
  }
  *value = *known;
  return true;
}

/// x, y or z.
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

/// Reads fields; errors are recorded in `map`. Who uses it rejects unknown keys.
class YamlFieldReader {
 public:
  static constexpr bool kReads = true;

  explicit YamlFieldReader(YamlReader& map) : map_(map) {}

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
      ReadMap(map.Child(name), [&list](YamlFieldReader& inner) { Fields(inner, list.back()); });
    }
  }

  void Comment(std::string_view) {}

  /// An empty key: of the whole map.
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
    YamlFieldReader inner(map);
    fields(inner);
    map.RejectUnknown();
    return true;
  }

  template <typename T>
  static bool ReadField(YamlReader reader, T& field) {
    if constexpr (HasFields<T>) {
      return ReadMap(reader, [&field](YamlFieldReader& inner) { Fields(inner, field); });
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
      return ReadNumber(reader, &field);
    } else if constexpr (kIsVector<T>) {
      return ReadVector(reader, &field);
    } else if constexpr (std::same_as<T, Eigen::Matrix3d>) {
      return ReadMatrix3(reader, &field);
    } else {
      return reader.Read(&field);
    }
  }
  template <typename T>
  static bool ReadField(YamlReader reader, Word<T>& word) {
    return reader.Read(&word.text);
  }
  template <typename T>
  static bool ReadField(YamlReader reader, AxisLetterOf<T>& letter) {
    if (reader) ReadAxis(reader, &letter.axis);
    return static_cast<bool>(reader);
  }

  // Gives the fields of a row their entries, one after the other.
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

}  // namespace truetriad
