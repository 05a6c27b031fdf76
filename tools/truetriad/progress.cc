// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/progress.h"

#include <cstdio>
#include <utility>

#include <unistd.h>

namespace truetriad {
namespace {

constexpr char kWipeLine[] = "\r\033[K";

}  // namespace

bool ProgressLine::is_quiet_ = false;

ProgressLine::ProgressLine(std::string what)
    : what_(std::move(what)), is_terminal_(!is_quiet_ && isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (shown_percent_ >= 0) std::fputs(kWipeLine, stderr);
}

ProgressCallback ProgressLine::callback() {
  if (!is_terminal_) return {};
  return [this](double share) { Show(static_cast<int>(100.0 * share)); };
}

void ProgressLine::Show(int percent) {
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  std::fprintf(stderr, "%s%s: %d %%", kWipeLine, what_.c_str(), percent);
}

}  // namespace truetriad
