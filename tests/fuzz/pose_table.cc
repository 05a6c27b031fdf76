// SPDX-License-Identifier: Apache-2.0
//
// A pose table (first byte even) or poses.yaml.
#include "fuzz/fuzz_target.h"
#include "truetriad/io/recording.h"

using namespace truetriad;  // NOLINT: of this source alone.

TRUETRIAD_FUZZ_TARGET(pose_table) {
  if (input.empty()) return -1;
  const std::string_view text = fuzz::TextOf(input.subspan(1));
  if (input[0] % 2 == 0) {
    const std::string path = fuzz::WriteInput("poses.csv", text);
    if (const Result<bool> is_table = IsPoseTable(path); !is_table) fuzz::MustSay(is_table.error());
    const Result<PoseTable> table = ReadPoseTable(path);
    if (!table) fuzz::MustSay(table.error());
    return 0;
  }
  const Result<std::vector<PoseRange>> ranges =
      ReadPoseRanges(fuzz::WriteInput("poses.yaml", text));
  if (!ranges) {
    fuzz::MustSay(ranges.error());
    return 0;
  }
  const std::string written = PoseRangesToYaml(*ranges);
  const Result<std::vector<PoseRange>> again =
      ReadPoseRanges(fuzz::WriteInput("again.yaml", written));
  fuzz::Must(again && PoseRangesToYaml(*again) == written, "poses.yaml reads back", written);
  return 0;
}
