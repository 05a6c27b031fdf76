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

/// A matrix whose numbers are in column-major order.
struct Matrix {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;

  double At(std::size_t row, std::size_t column) const { return values[column * rows + row]; }
};

/// A real matrix in a file of named matrices. If it is a field of a struct, its name is "imu.acc".
struct Variable {
  std::string name;
  std::string type;  ///< In the file's terms: "double", "int16", …
  std::size_t rows = 0, columns = 0;
  /// Reads the numbers. Error: they are incomplete, or too many.
  std::function<Result<Matrix>()> read = {};
  std::string path = {};       ///< The variable's file.
  std::string full_name = {};  ///< if there are several files, with the file: "unit-acc/data".
};

/// A file of named matrices.
struct VariableFile {
  std::vector<Variable> variables;
  std::map<std::string, std::string> others;  ///< Other contents by name: "complex", "text".
  std::string damage;  ///< Why the end is unreadable and may have variables; empty: it is readable.
};

/// Names by role: "time", "accelerometer", …, "temperature".
using ByRole = std::map<std::string, std::string>;

/// The name of each role in --columns, "accelerometer=acc,…". `example`: follows the list of
/// `roles` in the message. Error (usage): an unknown role, or one given twice.
Result<ByRole> ParseColumns(const std::string& columns,
                            std::span<const std::string_view> roles,
                            const std::string& example);

/// The unit of each role from --units. If --units contains `counts`, triads without another unit
/// are in counts. `columns`: the names by role; a sensor "acc@t" has a time of its own. Error
/// (usage): a unit is unknown, given twice, or missing.
Result<ByRole> ReadUnits(const ByRole& columns, const Arguments& arguments);

/// A file format of named matrices.
struct NamedFormat {
  std::string_view name;  ///< "json": the program is truetriad-convert-json.
  Result<VariableFile> (*open)(const std::string& path) = nullptr;
};

/// Converts or lists files of named matrices. The meaning of the matrices is stated by --columns
/// and --units or shown by their names.
Status ConvertNamedReadings(const NamedFormat& format, const Arguments& arguments);

/// The `main` of a converter for such a format.
int RunNamedReadingsConverter(const NamedFormat& format, int argc, char** argv);

}  // namespace truetriad::convert
