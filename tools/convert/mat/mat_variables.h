// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <matio.h>

#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A real matrix of a .mat file, or a field of one of its structs, by its full name: "imu.acc".
struct MatVariable {
  std::string name;
  std::string class_name;  ///< "double", "int16", …
  std::size_t rows = 0, columns = 0;
};

/// A numeric matrix, column by column as MATLAB stores it.
struct MatMatrix {
  std::size_t rows = 0, columns = 0;
  std::vector<double> values;

  double At(std::size_t row, std::size_t column) const { return values[column * rows + row]; }
};

/// A .mat file of version 5 (plain or compressed) or 7.3, through libmatio.
class MatFile {
 public:
  /// Error: unreadable, or no .mat file.
  static Result<std::unique_ptr<MatFile>> Open(const std::string& path);

  /// Real numeric matrices and vectors, those in (nested) 1×1 structs included.
  const std::vector<MatVariable>& variables() const { return variables_; }
  const MatVariable* Find(const std::string& name) const;
  /// Whether the file ends, or goes astray, inside of a variable: then some may be missing.
  bool is_damaged() const { return is_damaged_; }
  /// Error: it is not whole, or too large to be what it says.
  Result<MatMatrix> Read(const MatVariable& variable);

 private:
  struct CloseFile {
    void operator()(mat_t* file) const { Mat_Close(file); }
  };
  MatFile(std::string path, mat_t* file) : path_(std::move(path)), file_(file) {}
  void Collect(const matvar_t& variable, const std::string& name, int depth);
  bool IsPlausible(const matvar_t& variable, int depth) const;

  std::string path_;
  std::unique_ptr<mat_t, CloseFile> file_;
  std::size_t file_size_ = 0;
  bool is_hdf5_ = false;
  bool is_damaged_ = false;
  std::vector<MatVariable> variables_;
};

}  // namespace truetriad::convert
