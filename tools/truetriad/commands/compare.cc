// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include <gflags/gflags.h>

#include "tools/truetriad/command.h"
#include "truetriad/estimation/calibrate.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

DEFINE_string(a, "", "one calibration.yaml");
DEFINE_string(b, "", "the calibration.yaml to compare it with");

namespace truetriad {
namespace {

Result<int> Run(const std::vector<std::string>&) {
  const Result<Calibration> a = ReadCalibration(FLAGS_a);
  TRUETRIAD_RETURN_IF_ERROR(a);
  const Result<Calibration> b = ReadCalibration(FLAGS_b);
  TRUETRIAD_RETURN_IF_ERROR(b);
  const Result<Comparison> comparison = Compare(*a, *b);
  TRUETRIAD_RETURN_IF_ERROR(comparison);
  std::fputs(ComparisonText(*comparison).c_str(), stdout);
  return kExitGood;
}

}  // namespace

Command CompareCommand() {
  return {.name = "compare",
          .summary = "Do two calibrations of one unit agree, in sigmas?",
          .examples =
              "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/a\n"
              "build/truetriad calibrate --config=configs/experiments/accelerometer-only.yaml "
              "--output=out/b\n"
              "build/truetriad compare --a=out/a/calibration.yaml --b=out/b/calibration.yaml",
          .details =
              "The body frames are aligned first, so calibrations in different gauges can be "
              "compared.\nThe two are taken as independent.\n",
          .flags = {{"a", "FILE", true}, {"b", "FILE", true}},
          .run = Run};
}

}  // namespace truetriad
