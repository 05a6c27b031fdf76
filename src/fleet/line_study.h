// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "fleet/line_summary.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The gauge study of the runs that `options.study` selects: parts are the serial numbers,
/// appraisers what the tag `options.study_by` says. Error (not enough): no quantity makes a study,
/// and what the first lacks; usage: a reference is of no quantity.
Result<StudySummary> SummariseStudy(Store& store, const SummaryOptions& options);

}  // namespace truetriad::fleet
