// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <matio.h>

#include "tools/convert/common/variables.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// A .mat file of version 5 (plain or compressed) or 7.3, through libmatio: real numeric matrices
/// and vectors, those in (nested) 1×1 structs included.
class MatFile : public VariableFile {
 public:
  /// Error: unreadable, or no .mat file.
  static Result<std::unique_ptr<VariableFile>> Open(const std::string& path);

  Result<Matrix> Read(const Variable& variable) override;

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
};

}  // namespace truetriad::convert
