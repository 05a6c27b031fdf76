// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/base/result.h"

namespace truetriad {

/// While one lives, no output of this process takes the place of a file that it reads, by whatever
/// name or link: a log that was measured cannot be had again. One at a time; the program makes one
/// a run. A library's user, who has none, may write what he read.
class InputGuard {
 public:
  InputGuard();
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;

  /// A file that is read. Nothing, where no guard lives or `path` is no regular file.
  static void Add(const std::string& path);
  static bool Holds(const std::string& path);
  /// What is said of an output `path` that it holds.
  static Error Refusal(const std::string& path);
};

}  // namespace truetriad
