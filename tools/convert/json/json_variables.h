// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "tools/convert/common/variables.h"
#include "truetriad/base/result.h"

namespace truetriad::convert {

/// The numbers of a JSON file. What an object holds is called by its keys, "imu.acc"; a list of
/// numbers is one column, of lists of numbers a matrix, of objects (or a file with one on each
/// line) a row each: {"t": 0, "acc": [1, 2, 3]} makes `t` and `acc`. null, and NaN as some programs
/// write it, is no number. Anything else is left out.
class JsonFile : public VariableFile {
 public:
  /// Error: unreadable, or no JSON.
  static Result<std::unique_ptr<VariableFile>> Open(const std::string& path);

  Result<Matrix> Read(const Variable& variable) override;

 private:
  explicit JsonFile(std::map<std::string, Matrix> matrices);

  std::map<std::string, Matrix> matrices_;
};

}  // namespace truetriad::convert
