// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

namespace truetriad::fleet {

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

}  // namespace truetriad::fleet
