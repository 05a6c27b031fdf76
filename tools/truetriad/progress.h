// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "truetriad/data/pose_collection.h"

namespace truetriad {

/// One line on stderr that says how far the work is, wiped at the end; nothing unless stderr is a
/// terminal.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// From now on no line shows anything.
  static void Silence() { is_quiet_ = true; }

  /// To be called with the share of the work done; valid as long as the line.
  ProgressCallback callback();

  /// Shows a line instead of the share, several times a second at most.
  void ShowText(const std::string& text);
  /// Takes the line away, for something else to be written.
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
