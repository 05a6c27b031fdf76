// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/store.h"
#include "tree/json.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The store and the selection of units for a page.
struct FleetPageOptions {
  std::string store;   ///< Name as the user stated it; the runs' files may be beside it.
  std::string folder;  ///< The page is written here.
  std::string where;   ///< Condition as for FromWhere; empty: all units.
};

/// What a page contains.
struct FleetPageSummary {
  std::size_t units = 0, good = 0, good_without_limits = 0, good_at_first = 0, runs = 0;
  std::size_t reports = 0;    ///< Number of runs with a link to their report.
  bool draws_charts = false;  ///< This program includes uPlot.
};

/// A file in the folder of every page.
struct PageAsset {
  std::string_view name;  ///< "assets/fleet.css".
  std::string_view text;
};

/// The files of src/fleet/assets except page.html.
const std::vector<PageAsset>& FleetPageAssets();
/// The text of page.html, with placeholders such as {headline}.
std::string_view FleetPageFrame();

/// uPlot, which draws the charts, and its licence; empty if it was missing at build time.
const std::vector<PageAsset>& ChartAssets();

/// The JSON as ASCII text for a script, since a page opened from disk may load scripts but not
/// JSON. <, which could end the script, and quotes and U+2028, which could end a string or a line,
/// are escaped. Invalid UTF-8 becomes U+FFFD.
std::string ScriptOf(const Json& json);

/// Writes index.html, data.js and assets into the folder, once all of them are complete. They do
/// not depend on the time or the folder, except for the relative links to the reports of runs.
/// Errors (bad input): the store cannot be read; `where` selects no unit; the folder cannot be
/// written; its index.html was not written by this function. Error (usage): `where` is not valid.
Result<FleetPageSummary> WriteFleetPage(Store& store, const FleetPageOptions& options);

}  // namespace truetriad::fleet
