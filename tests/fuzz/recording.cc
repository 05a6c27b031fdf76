// SPDX-License-Identifier: Apache-2.0
//
// A log as text, read to its end and reduced to poses. The first two bytes say where poses are.
#include "truetriad/io/recording.h"

#include "fuzz/fuzz_target.h"
#include "fuzz/selection.h"
#include "truetriad/data/pose_collection.h"

using namespace truetriad;  // NOLINT: of this source alone.

TRUETRIAD_FUZZ_TARGET(recording) {
  if (input.size() < 3) return -1;
  const std::string path = fuzz::WriteInput("recording.csv", fuzz::TextOf(input.subspan(2)));
  OpenRecordingOptions options;
  options.may_be_joined = (input[0] & 128U) != 0;
  const PoseSelection selection = fuzz::SelectionOf(input[0], input[1]);
  options.ambient = selection.sweep.ambient;
  Result<std::unique_ptr<SampleSource>> source = OpenRecording(path, options);
  if (!source) {
    fuzz::MustSay(source.error());
    return 0;
  }
  const Result<PoseSet> poses = CollectPoses(**source, selection);
  if (!poses) fuzz::MustSay(poses.error());
  return 0;
}
