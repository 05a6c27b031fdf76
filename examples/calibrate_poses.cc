// SPDX-License-Identifier: Apache-2.0
// Calibrates an accelerometer from a table of six rests, one axis up or down each:
//   calibrate_poses datasets/six-rows/poses.csv 9.8
#include <cstdio>
#include <cstdlib>

#include "truetriad/calibrate/calibrate.h"
#include "truetriad/io/recording.h"
#include "truetriad/verdict/summary.h"

int main(int argc, char** argv) {
  using namespace truetriad;
  if (argc != 3) {
    std::fprintf(stderr, "usage: calibrate_poses POSES.csv GRAVITY\n");
    return 1;
  }
  const Result<PoseTable> table = ReadPoseTable(argv[1]);
  if (!table) {
    std::fprintf(stderr, "%s\n", table.error().message.c_str());
    return 2;
  }
  CalibrateOptions options;
  options.triads[Triad::kAccelerometer].enabled = true;
  options.reference.gravity_mps2 = {std::atof(argv[2]), 0.0};
  options.attitudes.kind = AttitudeKind::kSixFace;
  options.gauge = Gauge::kFixture;  // The body frame is that of the faces.
  const Result<CalibrationSummary> summary = Calibrate(table->poses, options);
  if (!summary || !summary->calibration.IsUsable()) {
    std::fprintf(stderr, "%s\n", summary ? "not usable" : summary.error().message.c_str());
    return 3;
  }
  const TriadCalibration& sensor = *summary->calibration.sensors[Triad::kAccelerometer];
  for (int axis = 0; axis < 3; ++axis) {
    std::printf("%c  bias %.4f ± %.4f m/s²  gain %.5f ± %.5f\n",
                "xyz"[axis],
                sensor.model.bias[axis],
                sensor.bias_sigma[axis],
                sensor.Scale()[axis],
                sensor.sensitivity_sigma(axis, axis));
  }
}
