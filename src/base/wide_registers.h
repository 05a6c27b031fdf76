// SPDX-License-Identifier: Apache-2.0
#pragma once

// Before a function, this macro compiles a second version of the function, for processors with wide
// registers; the loader selects a version at program start. The macro is meant for loops that take
// a considerable part of a run. The results of the two versions may differ in the last digits.
// Under the address and thread sanitizers the macro is empty, since the selection runs too early
// for them.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TRUETRIAD_WIDE_REGISTERS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define TRUETRIAD_WIDE_REGISTERS
#endif
