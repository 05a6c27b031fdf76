// SPDX-License-Identifier: Apache-2.0
//
// recording.yaml, beside the CSV files that it may name.
#include "fuzz/fuzz_target.h"
#include "truetriad/io/recording.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

std::string Manifest() {
  fuzz::WriteInput(
      "recording.csv",
      "time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2],gyro_x[rad/s],gyro_y[rad/s],"
      "gyro_z[rad/s],temperature[degC],pose\n0,1,2,3,4,5,6,20,1\n0.01,1,2,3,4,5,6,20,1\n"
      "0.02,1,2,3,,,,,2\n");
  fuzz::WriteInput("mag.csv", "t;x;y;z\n1;2;3;4\n2;2;3;4\n3;2;3;5\n");
  fuzz::WriteInput("bare.csv", "0 1 2 3 4 5 6\n1 1 2 3 4 5 6\n");
  fuzz::WriteInput("poses.yaml", "poses: [ { first: 0, last: 1, face: +x } ]\n");
  return fuzz::Folder() + "/recording.yaml";
}

}  // namespace

TRUETRIAD_FUZZ_TARGET(manifest) {
  static const std::string path = Manifest();
  fuzz::WriteInput("recording.yaml", fuzz::TextOf(input));
  Result<std::unique_ptr<SampleSource>> source = OpenRecording(path);
  if (!source) {
    fuzz::MustSay(source.error());
    return 0;
  }
  std::vector<SampleBlock> blocks;
  for (int i = 0; i < 20; ++i) {
    const Result<bool> more = (*source)->Next(&blocks);
    if (!more) fuzz::MustSay(more.error());
    if (!more || !*more) break;
  }
  const Result<std::optional<PoseSelection>> selection = ManifestPoseSelection(path);
  if (!selection) fuzz::MustSay(selection.error());
  return 0;
}
