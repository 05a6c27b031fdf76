// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

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
  const Variable* Find(const std::string& name) const {
    const auto found = std::find_if(
        variables_.begin(), variables_.end(), [&](const Variable& v) { return v.name == name; });
    return found == variables_.end() ? nullptr : &*found;
  }
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

}  // namespace truetriad::convert
