// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/converter.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A real matrix in a file of named ones, or a field of a struct in it, by its full name:
/// "imu.acc".
struct Variable {
  std::string name;
  std::string type;  ///< As the file calls it: "double", "int16", …
  std::size_t rows = 0, columns = 0;
};

/// Its numbers, column by column.
struct Matrix {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;

  double At(std::size_t row, std::size_t column) const { return values[column * rows + row]; }
};

/// A file of named matrices.
class VariableFile {
 public:
  VariableFile() = default;
  virtual ~VariableFile() = default;
  VariableFile(const VariableFile&) = delete;
  VariableFile& operator=(const VariableFile&) = delete;

  const std::vector<Variable>& variables() const { return variables_; }
  /// What is there beside them, by name: "complex", "text".
  const std::map<std::string, std::string>& others() const { return others_; }
  /// Empty, or why it cannot be read to its end: then some variables may be missing.
  const std::string& damage() const { return damage_; }
  /// Error: it is not whole, or too large to be what it says.
  virtual Result<Matrix> Read(const Variable& variable) = 0;

 protected:
  std::string damage_;
  std::vector<Variable> variables_;
  std::map<std::string, std::string> others_;
};

/// By role: "time", "accelerometer", …, "temperature".
using ByRole = std::map<std::string, std::string>;

/// What --columns calls each role, "accelerometer=acc,…". `example`: of an item, behind `roles`.
/// Error (usage): a role that is none of `roles`, or one twice.
Result<ByRole> ParseColumns(const std::string& columns,
                            std::span<const std::string_view> roles,
                            const std::string& example);

/// Units as --units says; `counts` for every triad that has no other. `columns`: what the user
/// calls each role, "acc@t" where it has a time of its own.
/// Error (usage): unknown, given twice, or missing.
Result<ByRole> ReadUnits(const ByRole& columns, const Arguments& arguments);

/// Files of one format. Reading is in a process of its own: a damaged file can bring a library
/// down.
struct NamedFormat {
  std::string_view name;   ///< "json": the program is truetriad-convert-json.
  std::string_view input;  ///< "JSON files with arrays of readings"
  Result<std::unique_ptr<VariableFile>> (*open)(const std::string& path) = nullptr;
};

/// Converts, or lists, files of named matrices whose meaning the user states (--columns, --units)
/// or their names make clear.
Status ConvertNamedReadings(const NamedFormat& format, const Arguments& arguments);

/// The `main` of a converter of such files.
int RunNamedReadingsConverter(const NamedFormat& format, int argc, char** argv);

}  // namespace truetriad::convert
