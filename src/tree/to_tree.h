// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <Eigen/Core>

#include "base/utf8.h"
#include "tree/fields.h"
#include "tree/json.h"

namespace truetriad {

template <typename T>
Json ToTree(const T& value);

/// Collects the fields of a value (tree/fields.h): the members of a map, or the entries of a row.
class TreeWriter {
 public:
  static constexpr bool kReads = false;
  explicit TreeWriter(Json empty) : tree_(std::move(empty)) {}

  template <typename T>
  bool operator()(std::string_view key, const T& field, Style = Style::kUsual) {
    if constexpr (kIsOptional<T>) {
      return field && (*this)(key, *field);
    } else {
      Json tree = ToTree(field);
      if (tree_.is_object()) {
        tree_[std::string(key)] = std::move(tree);
      } else if (kIsVector<T>) {
        tree_.insert(tree_.end(), tree.begin(), tree.end());
      } else {
        tree_.push_back(std::move(tree));
      }
      return true;
    }
  }

  template <typename T>
  bool If(bool stated, std::string_view key, const T& field, Style = Style::kUsual) {
    return stated && (*this)(key, field);
  }

  template <typename T>
  bool OrNull(std::string_view key, const std::optional<T>& field, Style = Style::kUsual) {
    if (!field) tree_[std::string(key)] = nullptr;
    return (*this)(key, field);
  }

  template <typename GroupFields>
  void Group(std::string_view key, Style, const GroupFields& fields) {
    TreeWriter group(Json::object());
    fields(group);
    tree_[std::string(key)] = std::move(group.tree_);
  }

  template <typename T>
  void Named(bool stated, std::string_view key, const std::vector<T>& list) {
    if (!stated) return;
    Json& map = tree_[std::string(key)];
    for (const T& item : list) map[item.name] = ToTree(item);
  }

  void Comment(std::string_view) {}

  template <typename Wrong>
  void Check(std::string_view, const Wrong&) {}

  Json Take() { return std::move(tree_); }

 private:
  Json tree_;
};

/// A value as JSON. Names, values and order of the fields are those of the YAML file.
template <typename T>
Json ToTree(const T& value) {
  if constexpr (HasFields<T>) {
    TreeWriter fields(kIsRow<T> ? Json::array() : Json::object());
    Fields(fields, value);
    return fields.Take();
  } else if constexpr (kIsList<T>) {
    Json list = Json::array();
    for (const auto& item : value) list.push_back(ToTree(item));
    return list;
  } else if constexpr (std::is_base_of_v<Eigen::EigenBase<T>, T>) {
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < value.rows(); ++i) {
      if constexpr (T::ColsAtCompileTime == 1) {
        rows.push_back(value[i]);
      } else {
        rows.push_back(ToTree(Eigen::VectorXd(value.row(i).transpose())));
      }
    }
    return rows;
  } else if constexpr (std::is_enum_v<T>) {
    return WordsOf(value).first(value);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return value;
  } else {
    return AsUtf8(value);
  }
}
/// An empty word becomes null.
template <typename T>
Json ToTree(const Word<T>& word) {
  const std::string_view text(word.text);
  return text.empty() ? Json(nullptr) : Json(text);
}
template <typename T>
Json ToTree(const AxisLetterOf<T>& letter) {
  return kAxisLetters.substr(static_cast<std::size_t>(letter.axis), 1);
}

}  // namespace truetriad
