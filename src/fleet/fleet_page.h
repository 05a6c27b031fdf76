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

/// What of a store goes into the page.
struct FleetPageOptions {
  std::string store;   ///< Its name as it was given: where runs' files are looked for, too.
  std::string folder;  ///< Of the page.
  std::string where;   ///< As FromWhere; empty: all units.
};

/// What a page was made of.
struct FleetPageSummary {
  std::size_t units = 0, good = 0, good_without_limits = 0, good_at_first = 0, runs = 0;
  std::size_t reports = 0;    ///< Runs whose own report is linked.
  bool draws_charts = false;  ///< This program has what draws them.
};

/// A file that every page's folder has.
struct PageAsset {
  std::string_view name;  ///< "assets/fleet.css".
  std::string_view text;
};

/// What is in src/fleet/assets, but for the frame of a page.
const std::vector<PageAsset>& FleetPageAssets();
/// The frame of a page, with {names} for what goes in.
std::string_view FleetPageFrame();

/// uPlot, which draws the charts, with its licence; empty where it was not there at build time.
const std::vector<PageAsset>& ChartAssets();

/// Text of a script that is `json`, in ASCII: what ends a script, a line or a string in any browser
/// (<, quotes, U+2028) is escaped. What is no UTF-8 becomes U+FFFD. (A page from the disk may load
/// scripts, but no JSON.)
std::string ScriptOf(const Json& json);

/// Writes index.html, data.js and assets into the folder, once all of them are whole. Nothing in it
/// depends on when or where it is made, but for links to runs' reports, which lead from it to their
/// place. Errors (bad input): the store cannot be read, has no such units, or the folder cannot be
/// written or has another index.html. Error (usage): `where` is not understood.
Result<FleetPageSummary> WriteFleetPage(Store& store, const FleetPageOptions& options);

}  // namespace truetriad::fleet
