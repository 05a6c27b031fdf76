// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "fleet/store.h"
#include "json/json.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The section "The line" of a page.
struct PageLine {
  Json summary;  ///< Yield, limits with capability, stations with their alarms, effects, golden
                 ///< units.
  std::vector<Json> charts = {};  ///< The control charts of each station of `summary`.
};

/// The statistics of the units that `where` lets through, as of the last of them. Errors: as
/// ReadUnits.
Result<PageLine> LineOfPage(Store& store, const std::string& where);

}  // namespace truetriad::fleet
