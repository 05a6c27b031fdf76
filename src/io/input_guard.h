// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"

namespace truetriad {

/// While a guard exists, this process overwrites no file that it has read, whatever name or link
/// leads to the file: a measured log cannot be recovered. At most one guard exists at a time; the
/// program makes one per run. Users of the library have no guard and may overwrite their inputs.
class InputGuard {
 public:
  InputGuard();
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;

  /// Registers a file that is read. Does nothing without a guard or if `path` is not a regular
  /// file.
  static void Add(const std::string& path);
  static bool Holds(const std::string& path);
  /// The error for an output `path` that is a registered file.
  static Error Refusal(const std::string& path);
};

}  // namespace truetriad
