// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "line/chart_plan.h"
#include "line/control_chart.h"

namespace truetriad::line {

/// Shifts of level within each parameter's baseline, as alarms of kind "baseline": `value` is
/// the shift in σ within both levels, `limit` what exceeds chance there. `level`: probability that
/// baselines in control have one.
///
/// Every run of consecutive units, 10 at least, is held against all others by Hotelling's T^2 (of
/// one parameter: Student's t), its p adjusted by Bonferroni for the number of runs, half of the
/// level for those that last to the baseline's end. Outliers are left out. Units that judge each
/// other have no baseline.
std::vector<ChartAlarm> BaselineShifts(const LineData& data,
                                       const std::vector<ParameterValues>& watched,
                                       double level);

/// The same of all parameters together: `value` is a Mahalanobis distance, `most` the parameter
/// that moves farthest. Unset: none.
std::optional<ChartAlarm> JointBaselineShift(const LineData& data,
                                             const std::vector<ParameterValues>& shared,
                                             double level);

}  // namespace truetriad::line
