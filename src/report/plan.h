// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "truetriad/planning/plan.h"
#include "truetriad/report/report.h"

namespace truetriad {

Grade GradeOf(const Plan& plan);

/// What `plan` prints: the verdict, the poses in their order, σ of every quantity before and after,
/// what was wanted, what the poses cannot see, and the comparison with random poses.
std::string PlanText(const Plan& plan);

/// One self-contained HTML page for the person who takes the poses: a picture of the cube for each,
/// then the same tables. Same input, same bytes.
std::string PlanHtml(const Plan& plan);

}  // namespace truetriad
