// SPDX-License-Identifier: Apache-2.0
#pragma once

// Before a function: it is compiled for processors with wide registers, too, and which one runs is
// found out at the start. For loops that are a good part of a run; last digits may differ. The
// resolver runs too early for the address and the thread sanitizer.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TRUETRIAD_WIDE_REGISTERS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define TRUETRIAD_WIDE_REGISTERS
#endif
