// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/named_values.h"
#include "io/yaml_reader.h"
#include "truetriad/base/units.h"

namespace truetriad {

// The values of files that people write. All readers follow YamlReader: true when the value was
// read; false when there is none, or when it is wrong, which is then an error of its file.

struct Range {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  std::string_view expected;  ///< "a positive number".
};
constexpr Range kAnyNumber{.expected = "a number"};
constexpr Range kPositive{.lowest = std::numeric_limits<double>::denorm_min(),
                          .expected = "a positive number"};
constexpr Range kTemperatureDegc{kAbsoluteZeroDegc, 1000.0, "a temperature in degC"};
constexpr Range kLatitudeDeg{-90.0, 90.0, "a latitude of -90 to 90 degrees"};
constexpr Range kDeclinationDeg{
    -180.0, 180.0, "a declination of -180 to 180 degrees, east positive"};
constexpr Range kDipDeg{
    -90.0, 90.0, "a dip of -90 to 90 degrees, positive if the field points down"};
constexpr Range kNotNegative{.lowest = 0.0, .expected = "a number of at least zero"};

bool ReadNumber(YamlReader reader, const Range& range, double* value);

/// A σ; `.inf` says that nothing is known.
bool ReadSigma(YamlReader reader, double* value);

/// True when the value is exactly this word.
bool IsWord(YamlReader reader, std::string_view word);

/// Refuses every format version but 1.
void ReadVersion(YamlReader reader);

/// `number`, `{ value, sigma }` or `unknown`, as far as it has been said.
struct Stated {
  std::optional<double> value;
  std::optional<double> sigma;
};
void ReadStated(YamlReader reader, const Range& range, bool may_be_unknown, Stated* stated);

/// The named values of a table that another layer owns, for messages that list them.
template <typename T, std::size_t N>
NamedValues<T, N> Named(std::string_view (*name)(T), const std::array<T, N>& values) {
  NamedValues<T, N> named;
  for (std::size_t i = 0; i < N; ++i) named.entries[i] = {values[i], name(values[i])};
  return named;
}

template <typename T, std::size_t N>
bool ReadChoice(YamlReader reader, const NamedValues<T, N>& choices, T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  if (const std::optional<T> choice = choices.Find(word)) {
    *value = *choice;
    return true;
  }
  std::string known;
  for (const auto& entry : choices.entries) {
    known += (known.empty() ? "" : ", ") + std::string(entry.second);
  }
  reader.Fail("`" + word + "` is unknown; expected one of " + known);
  return false;
}

/// A matrix as a list of rows, or a vector as a list, each entry read by `read`; `may_be_number`:
/// one number may stand for all entries.
template <typename Matrix, typename ReadEntry>
bool ReadEntries(YamlReader reader, bool may_be_number, ReadEntry read, Matrix* matrix) {
  constexpr bool kIsVector = Matrix::ColsAtCompileTime == 1;
  if (!reader) return false;
  if (may_be_number && reader.IsScalar()) {
    double value = 0.0;
    if (!read(reader, &value)) return false;
    matrix->setConstant(value);
    return true;
  }
  std::vector<YamlReader> rows = reader.IsSequence() ? reader.Items() : std::vector<YamlReader>();
  if (rows.size() != 3) {
    reader.Fail(std::string("expected ") +
                (kIsVector ? "three numbers [x, y, z]" : "three rows [[a, b, c], …]") +
                (may_be_number ? " or one number for all" : ""));
    return false;
  }
  Matrix result;
  for (int i = 0; i < 3; ++i) {
    YamlReader& row = rows[static_cast<std::size_t>(i)];
    if constexpr (kIsVector) {
      if (!read(row, &result(i))) return false;
    } else {
      Eigen::Vector3d entries;
      if (!ReadEntries(row, false, read, &entries)) return false;
      result.row(i) = entries.transpose();
    }
  }
  *matrix = result;
  return true;
}

template <typename Matrix>
bool ReadNumbers(const YamlReader& reader, Matrix* matrix) {
  const auto read = [](const YamlReader& entry, double* value) {
    return ReadNumber(entry, kAnyNumber, value);
  };
  return ReadEntries(reader, false, read, matrix);
}

template <typename Matrix>
bool ReadSigmas(const YamlReader& reader, Matrix* matrix) {
  return ReadEntries(reader, true, ReadSigma, matrix);
}

}  // namespace truetriad
