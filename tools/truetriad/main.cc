// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>

#include <glog/logging.h>
#include <malloc.h>

#include "tools/truetriad/command_line.h"

namespace {

// Memory that is given back is taken again soon: pages that stay need not be cleared and mapped
// anew, which was a tenth of the time of a calibration.
void KeepFreedMemory() {
  constexpr int kMiB = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMiB);
  mallopt(M_TRIM_THRESHOLD, 32 * kMiB);
  mallopt(M_TOP_PAD, kMiB);
}

}  // namespace

int main(int argc, char** argv) {
  KeepFreedMemory();
  // What the library and the solver log is for developers: nothing without --v, and never a file.
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  google::InitGoogleLogging(argv[0]);
  // A file that grows beyond what the shell permits is one that cannot be written, and is said so.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return truetriad::RunCommandLine({argv + 1, argv + argc});
  } catch (const std::bad_alloc&) {
    std::fputs(
        "truetriad: memory is short; close other programs, raise `ulimit -v`, or give a shorter "
        "log\n",
        stderr);
    return 2;
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "truetriad: %s\n", failure.what());
    return 2;
  }
}
