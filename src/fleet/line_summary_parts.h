// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fleet/line_summary.h"
#include "json/json.h"
#include "report/table.h"

namespace truetriad::fleet {

// Parts of the summary that stand in files of their own.

/// Control charts: member "charts".
Json ProcessJson(const LineSummary& summary);
/// The same for people.
std::string ProcessText(const LineSummary& summary);

/// A heading and the first rows below it; nothing of none.
std::string Section(const std::string& heading, truetriad::Table table);

/// Below this p, what was assumed is doubted.
inline constexpr double kDoubt = 0.01;

}  // namespace truetriad::fleet
