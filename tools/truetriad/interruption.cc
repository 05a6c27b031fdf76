// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/interruption.h"

#include <csignal>
#include <initializer_list>

namespace truetriad {
namespace {

/// The signal that asked the program to end; 0: none.
volatile std::sig_atomic_t ended_by = 0;

extern "C" void NoteEnd(int signal) {
  ended_by = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void NoteInterruptions() {
  for (const int signal : {SIGINT, SIGTERM}) {
    if (std::signal(signal, NoteEnd) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
}

bool IsInterrupted() { return ended_by != 0; }

void EndAsInterrupted() {
  if (ended_by == 0) return;
  std::signal(ended_by, SIG_DFL);
  std::raise(ended_by);
}

}  // namespace truetriad
