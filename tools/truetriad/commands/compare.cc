// SPDX-License-Identifier: Apache-2.0
#include "truetriad/calibrate/compare.h"

#include <algorithm>
#include <cstdio>

#include <gflags/gflags.h>

#include "json/verb_json.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"
#include "truetriad/session/session.h"

DEFINE_string(a, "", "one calibration.yaml");
DEFINE_string(b, "", "the calibration.yaml to compare it with");

namespace truetriad {
namespace {

constexpr char kDiffer[] = "differ";
constexpr char kSameReadings[] =
    "Both were made from the same readings, so they share their noise and agree better than two "
    "separate recordings would.";

Result<VerbResult> RunCompare(const std::vector<std::string>&) {
  TRUETRIAD_RETURN_IF_ERROR(CheckFailOn(kDiffer));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration a, ReadCalibration(FLAGS_a));
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration b, ReadCalibration(FLAGS_b));
  TRUETRIAD_RETURN_IF_ERROR(CheckSameSensors(FLAGS_a, a, b));
  TRUETRIAD_ASSIGN_OR_RETURN(const Comparison comparison, Compare(a, b));
  std::vector<std::string> about = {"a: " + OriginOf(FLAGS_a, a), "b: " + OriginOf(FLAGS_b, b)};
  if (IsMadeFrom(a, b.inputs) || IsTooAlike(comparison)) {
    about.emplace_back(kSameReadings);
    Note("note: " + std::string(kSameReadings));
  }
  const bool has_failed = FLAGS_fail_on == kDiffer && AgreementOf(comparison) != Agreement::kAgree;
  VerbResult result{.exit_code = has_failed ? kExitOutsideLimits : kExitGood,
                    .text = ComparisonText(comparison, about),
                    .result = ToJson(comparison),
                    .grade = GradeOf(comparison)};
  TRUETRIAD_RETURN_IF_ERROR(WriteStatedReport(ComparisonHtml(comparison, about), &result));
  return result;
}

}  // namespace

Command CompareCommand() {
  return {
      .name = "compare",
      .summary = "Do two calibrations of one unit agree, in sigmas?",
      .examples =
          "build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/a\n"
          "build/truetriad calibrate --config=configs/experiments/accelerometer-only.yaml "
          "--output=out/b\n"
          "build/truetriad compare --a=out/a/calibration.yaml --b=out/b/calibration.yaml",
      .details =
          "The body frames are aligned first, so the gauges may differ; where different sensors "
          "lead,\nbiases and C^T C are compared, which no frame changes. The two calibrations are\n"
          "assumed to be independent. With --fail-on=differ exit code 4 says that they do not "
          "agree, "
          "or that\nnothing could be compared.\n",
      .flags = {{"a", "FILE", true},
                {"b", "FILE", true},
                {"fail-on", "differ", false, {kDiffer}},
                {"report", "PAGE.html"}},
      .words = {"a", "b"},
      .run = RunCompare};
}

}  // namespace truetriad
