// SPDX-License-Identifier: Apache-2.0
//
// By the first byte: turns.yaml, rates.yaml, a pose program, a mapping.
#include "fuzz/fuzz_target.h"
#include "io/known_motion_file.h"
#include "io/mapping.h"
#include "io/pose_program_file.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

/// What is read is written, read and written again: the two texts are equal.
void ComesBack(const auto& read, const auto& write, std::string_view text) {
  const auto first = read(fuzz::WriteInput("first.yaml", text));
  if (!first) {
    fuzz::MustSay(first.error());
    return;
  }
  const std::string written = write(*first);
  const auto second = read(fuzz::WriteInput("second.yaml", written));
  fuzz::Must(second.has_value(), "what was written can be read", written);
  fuzz::Must(write(*second) == written, "it is written as it was read", written + write(*second));
}

void TryMapping(std::string_view text) {
  static const std::vector<std::string> inputs = {
      fuzz::WriteInput("log.csv", "t,ax,ay,az,gx,gy,gz\n0,1,2,3,4,5,6\n"),
      fuzz::WriteInput("bare.txt", "0 1 2 3 4 5 6\n1 1 2 3 4 5 6\n")};
  const std::string copy(text);
  const Result<MappingInfo> about = ReadMappingInfo(copy, "mapping.yaml");
  if (!about) fuzz::MustSay(about.error());
  for (const std::size_t count : {std::size_t{1}, std::size_t{2}}) {
    const Result<std::string> manifest =
        ManifestFromMapping(copy,
                            "mapping.yaml",
                            {inputs.begin(), inputs.begin() + static_cast<std::ptrdiff_t>(count)},
                            fuzz::Folder());
    if (!manifest) fuzz::MustSay(manifest.error());
  }
}

}  // namespace

TRUETRIAD_FUZZ_TARGET(motion_files) {
  if (input.empty()) return -1;
  const std::string_view text = fuzz::TextOf(input.subspan(1));
  switch (input[0] % 4) {
    case 0:
      ComesBack(
          [](const std::string& path) {
            return ReadStatedTurns(path, {0.01, 0.01});
          },
          &StatedTurnsToYaml,
          text);
      break;
    case 1:
      ComesBack(
          [&](const std::string& path) {
            return ReadStatedRates(path, {0.01, 0.01, (input[0] & 64U) == 0});
          },
          &StatedRatesToYaml,
          text);
      break;
    case 2:
      ComesBack(&ReadPoseProgram, &PoseProgramToYaml, text);
      break;
    default:
      TryMapping(text);
  }
  return 0;
}
