// SPDX-License-Identifier: Apache-2.0
//
// A fuzzer: libFuzzer's main calls the one target that is linked.
#include <cstddef>
#include <cstdint>

#include <glog/logging.h>

#include "fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return truetriad::fuzz::Targets().front().fuzz_one({data, size});
}
