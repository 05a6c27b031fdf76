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

ProgressLine::~ProgressLine() { Wipe(); }

void ProgressLine::Wipe() {
  if (shown_percent_ >= 0) std::fputs(kWipeLine, stderr);
  shown_percent_ = -1;
  next_text_ = {};
}

void ProgressLine::ShowText(const std::string& text) {
  constexpr auto kPause = std::chrono::milliseconds(200);  // 5 texts a second are legible.
  const auto now = std::chrono::steady_clock::now();
  if (!is_terminal_ || now < next_text_) return;
  next_text_ = now + kPause;
  shown_percent_ = 0;
  std::fprintf(stderr, "%s%s", kWipeLine, text.c_str());
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
