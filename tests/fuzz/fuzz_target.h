// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::fuzz {

/// What a fuzzer, or the replay of its corpus, hands over: any bytes.
using Bytes = std::span<const std::uint8_t>;

/// One entry into the product. Whatever the bytes are, it must come back: with a value or an error
/// that says something. Returns 0, or -1 where the input is not worth keeping (libFuzzer's own).
struct Target {
  std::string_view name;  ///< Of its source file and of its folder in corpus/.
  int (*fuzz_one)(Bytes input) = nullptr;
};

/// All targets that are linked: one in a fuzzer, every one in the replay.
std::vector<Target>& Targets();

struct Registration {
  explicit Registration(const Target& target) { Targets().push_back(target); }
};

inline std::string_view TextOf(Bytes input) {
  return {reinterpret_cast<const char*>(input.data()), input.size()};
}

/// A folder of this process alone, in memory where there is one; removed at the end.
const std::string& Folder();
/// Writes a file into it and returns its path. Old contents go.
std::string WriteInput(const std::string& name, std::string_view text);
/// A folder in it that is not there.
std::string FreshOutput();

/// Ends the process, loudly, when what must hold does not.
void Must(bool holds, const char* what, std::string_view detail = {});
/// An error without words would leave a user alone.
void MustSay(const Error& error);

}  // namespace truetriad::fuzz

/// Defines the target `id` (of the name `id`): TRUETRIAD_FUZZ_TARGET(manifest) { … `input` … }
#define TRUETRIAD_FUZZ_TARGET(id)                                                        \
  static int FuzzOne(truetriad::fuzz::Bytes input);                                      \
  static const truetriad::fuzz::Registration registration({#id, &FuzzOne}); /* NOLINT */ \
  static int FuzzOne([[maybe_unused]] truetriad::fuzz::Bytes input)
