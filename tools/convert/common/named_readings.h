// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/convert/common/converter.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// Numbers, column by column.
struct Matrix {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;

  double At(std::size_t row, std::size_t column) const { return values[column * rows + row]; }
};

/// A real matrix in a file of named ones, or a field of a struct in it, by its full name:
/// "imu.acc".
struct Variable {
  std::string name;
  std::string type;  ///< As the file calls it: "double", "int16", …
  std::size_t rows = 0, columns = 0;
  /// Error: it is not whole, or too large to be what it says.
  std::function<Result<Matrix>()> read = {};
  std::string path = {};       ///< Of its file.
  std::string full_name = {};  ///< "acc"; of several files "unit-acc/data", as the file is called.
};

/// A file of named matrices.
struct VariableFile {
  std::vector<Variable> variables;
  std::map<std::string, std::string> others;  ///< Beside them, by name: "complex", "text".
  std::string damage;  ///< Why it cannot be read to its end: then some variables may be missing.
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

/// Files of one format.
struct NamedFormat {
  std::string_view name;  ///< "json": the program is truetriad-convert-json.
  Result<VariableFile> (*open)(const std::string& path) = nullptr;
};

/// Converts, or lists, files of named matrices whose meaning the user states (--columns, --units)
/// or their names make clear.
Status ConvertNamedReadings(const NamedFormat& format, const Arguments& arguments);

/// The `main` of a converter of such files.
int RunNamedReadingsConverter(const NamedFormat& format, int argc, char** argv);

}  // namespace truetriad::convert
