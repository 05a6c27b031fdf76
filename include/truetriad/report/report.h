// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/calibrate/compare.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// How good the news is that a text begins with.
enum class Grade { kGood, kCaution, kBad };
Grade GradeOf(const Calibration& calibration);
Grade GradeOf(const PoseSet& poses);
Grade GradeOf(const EvaluationSummary& evaluation, const Calibration& calibration);
Grade GradeOf(const Comparison& comparison);

/// What a person reads on the terminal after `calibrate`: verdict and limits first, then
/// parameters ± σ, predicted uncertainty, held-out error, residuals, weak directions.
std::string CalibrationText(const Calibration& calibration);

/// One self-contained HTML page (inline CSS and SVG, no network, no script): the same order.
/// Same input, same bytes.
std::string CalibrationHtml(const Calibration& calibration);

/// What other verbs say, on the terminal and as a page. `inspect`: rates, gaps, poses found, coverage, noise, temperature range, and
/// whether it is enough for which calibration.
std::string InspectionText(const PoseSet& poses);
std::string InspectionHtml(const PoseSet& poses);

std::string EvaluationText(const EvaluationSummary& evaluation, const Calibration& calibration);
std::string EvaluationHtml(const EvaluationSummary& evaluation, const Calibration& calibration);

std::string ComparisonText(const Comparison& comparison);
std::string ComparisonHtml(const Comparison& comparison);

}  // namespace truetriad
