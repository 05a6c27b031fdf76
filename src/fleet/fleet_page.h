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
  std::string store;   ///< Its name as given; runs' files are also looked for beside it.
  std::string folder;  ///< Of the page.
  std::string where;   ///< As FromWhere; empty: all units.
};

/// What a page contains.
struct FleetPageSummary {
  std::size_t units = 0, good = 0, good_without_limits = 0, good_at_first = 0, runs = 0;
  std::size_t reports = 0;    ///< Runs whose own report is linked.
  bool draws_charts = false;  ///< This program includes uPlot.
};

/// A file in the folder of every page.
struct PageAsset {
  std::string_view name;  ///< "assets/fleet.css".
  std::string_view text;
};

/// The files of src/fleet/assets except the frame of a page.
const std::vector<PageAsset>& FleetPageAssets();
/// The frame of a page, with {names} as placeholders.
std::string_view FleetPageFrame();

/// uPlot, which draws the charts, and its licence; empty if it was missing at build time.
const std::vector<PageAsset>& ChartAssets();

/// The JSON as text for a script, in ASCII: <, quotes and U+2028, which could end a script, a line
/// or a string, are escaped; invalid UTF-8 becomes U+FFFD. (A page opened from disk may load
/// scripts but not JSON.)
std::string ScriptOf(const Json& json);

/// Writes index.html, data.js and assets into the folder after all of them are complete. They do
/// not depend on time or place, except for relative links to the reports of runs. Errors (bad
/// input): the store cannot be read or has no units that `where` selects, or the folder cannot be
/// written or has another index.html. Error (usage): `where` is not valid.
Result<FleetPageSummary> WriteFleetPage(Store& store, const FleetPageOptions& options);

}  // namespace truetriad::fleet
