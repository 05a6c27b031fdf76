// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "truetriad/report/report.h"

namespace truetriad {

// What is in src/report/assets.

/// report.css.
std::string_view PageStyle();
/// report.js.
EmbeddedScript PageScript();
/// sphere.js, which needs Plotly before it.
EmbeddedScript SphereScript();

}  // namespace truetriad
