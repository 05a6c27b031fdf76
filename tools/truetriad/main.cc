// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>

#include <glog/logging.h>

#include "tools/truetriad/command_line.h"

int main(int argc, char** argv) {
  // What the library and the solver log is for developers: nothing without --v, and never a file.
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  google::InitGoogleLogging(argv[0]);
  try {
    return truetriad::RunCommandLine({argv + 1, argv + argc});
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "truetriad: %s\n", failure.what());
    return 2;
  }
}
