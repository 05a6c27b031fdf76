// SPDX-License-Identifier: Apache-2.0
#pragma once

// This macro before a function compiles it for processors with wide registers, too; the loader
// selects one of the two versions at program start. It is meant for loops that take a considerable
// part of a run. The last digits of both versions may differ. The selection runs too early for the
// address and thread sanitizers.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TRUETRIAD_WIDE_REGISTERS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define TRUETRIAD_WIDE_REGISTERS
#endif
