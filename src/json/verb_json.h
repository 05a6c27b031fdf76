// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "json/json.h"
#include "truetriad/allan/allan.h"
#include "truetriad/base/result.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/calibrate/side_by_side.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/finding.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

/// What verbs find, for programs. share/truetriad/schema says what is in each; names are those of
/// calibration.yaml, or of the units that they end in.
Json ToJson(const Finding& finding);
Json ToJson(const Findings& findings);
/// Code, message, and where it is in which file, where that is known.
Json ToJson(const Error& error);
Json ToJson(const PoseSet& poses);
Json ToJson(const Comparison& comparison);
Json ToJson(const EvaluationSummary& evaluation);
Json ToJson(const SideBySide& both);
Json ToJson(const Plan& plan);
Json ToJson(const AllanResult& result);

}  // namespace truetriad
