// SPDX-License-Identifier: Apache-2.0
#include "fuzz/conversion.h"
#define main MatConverterMain  // The program's own, whose functions are wanted.
#include "tools/convert/mat.cc"
#undef main

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
/// HDF5 allocates what a file claims to hold. The converter's memory is bounded
/// (common/memory_bound.cc); here what is too large is not there, either.
extern "C" const char* __asan_default_options() {  // NOLINT: the sanitizer's name.
  return "allocator_may_return_null=1:max_allocation_size_mb=128";
}
#endif
#endif

TRUETRIAD_FUZZ_TARGET(convert_mat) {
  return truetriad::fuzz::TryNamedReadings(truetriad::convert::kFormat, "log.mat", input);
}
