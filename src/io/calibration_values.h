// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/input_file.h"
#include "truetriad/base/triad.h"
#include "truetriad/base/units.h"

namespace truetriad {

// Values as calibration.yaml and allan.yaml have them: how several parts write and read theirs.

inline void WriteInputs(YamlText& out, const std::vector<InputFile>& inputs) {
  out << "inputs:" << (inputs.empty() ? " []\n" : "\n");
  for (const InputFile& input : inputs) {
    out << "  - { file: " << Quoted{input.file} << ", sha256: " << Quoted{input.sha256}
        << ", samples: " << input.samples << " }\n";
  }
}

inline void ReadInputs(YamlReader reader, std::vector<InputFile>* inputs) {
  for (YamlReader& item : reader.Items()) {
    InputFile& input = inputs->emplace_back();
    item.Require("file", &input.file);
    item.Require("sha256", &input.sha256);
    item.Require("samples", &input.samples);
    item.RejectUnknown();
  }
}

inline void WriteItem(YamlText& out, std::string_view key, bool empty) {
  out << "  " << key << (empty ? ": []\n" : ":\n");
}

template <typename T>
void WriteList(YamlText& out, const std::vector<T>& items) {
  out << "[";
  for (std::size_t i = 0; i < items.size(); ++i) out << (i == 0 ? "" : ", ") << items[i];
  out << "]";
}

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

}  // namespace truetriad
