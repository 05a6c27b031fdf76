// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/content.h"
#include "truetriad/estimation/plan.h"

namespace truetriad {

// What is said of a plan and in which order, once for the terminal and for HTML.

Verdict VerdictOf(const Plan& plan);

struct PlanSection {
  std::string title;
  std::vector<Block> blocks;
};

/// All but the poses themselves: wanted σ, what cannot be seen, messages, σ of every quantity, the
/// comparison with random poses; one with nothing to say is left out.
std::vector<PlanSection> SectionsOf(const Plan& plan);

/// "magnetometer scale x (× 1.50)": what would be so much less certain without the pose.
std::string PurposeText(const PosePurpose& purpose);

/// Number, attitude, temperature and purpose of every pose.
Table ProgramTable(const Plan& plan);

}  // namespace truetriad
