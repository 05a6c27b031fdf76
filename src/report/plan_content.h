// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "report/content.h"
#include "truetriad/planning/plan.h"

namespace truetriad {

// What is said of a plan and in which order, once for the terminal and for HTML.

Headline HeadlineOf(const Plan& plan);

/// All but the poses themselves: wanted σ, what cannot be seen, messages, σ of every quantity, the
/// noise that this is for, the comparison with random poses; one with nothing to say is left out.
std::vector<PageSection> SectionsOf(const Plan& plan);

/// What the operator goes by: the label, or the attitude in words where a program has none.
std::string LabelOf(const ProgramPose& pose);

/// "magnetometer scale x, σ × 1.50": what would suffer most without pose `k`, counted from zero.
std::string PurposeText(const Plan& plan, std::size_t k);

/// "Let the unit rest for 5 s in each pose.", or what else decides how long.
std::string RestText(const Plan& plan);

/// Number, attitude, temperature and purpose of every pose.
Table ProgramTable(const Plan& plan);

}  // namespace truetriad
