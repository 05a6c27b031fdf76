// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "fleet/fleet_page_reader.h"

namespace truetriad::fleet {

/// What one page of the folder is about.
struct PageScope {
  std::string title = {};
  std::string root = {};                ///< The folder as seen from the page: "", "../".
  std::string lot = {};                 ///< Empty: all units.
  std::vector<std::size_t> units = {};  ///< Places in PageUnits.
  bool draws_charts = false;
};

/// The file of a lot's page, from the folder.
std::string FileOfLot(const std::string& lot);

/// The page: a summary that needs no script, and what scripts fill in.
std::string FleetPageHtml(const PageUnits& units, const PageScope& scope);

/// Good in the end, or at its first run.
bool IsGood(const PageWords& verdict, std::size_t unit);

}  // namespace truetriad::fleet
