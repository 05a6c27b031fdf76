// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "truetriad/data/pose_collection.h"

namespace truetriad {

/// A line on stderr with the share of the work done. It is shown only if stderr is a terminal, and
/// erased at the end.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Disables all progress lines from now on.
  static void Silence() { is_quiet_ = true; }

  /// A callback for the share of the work done; valid as long as this object.
  ProgressCallback callback();

  /// Shows a text instead of the share, at most 5 times a second.
  void ShowText(const std::string& text);
  /// Erases the line before other output.
  void Wipe();

 private:
  void Show(int percent);

  static bool is_quiet_;

  std::string what_;
  bool is_terminal_;
  int shown_percent_ = -1;
  std::chrono::steady_clock::time_point next_text_;
};

}  // namespace truetriad
