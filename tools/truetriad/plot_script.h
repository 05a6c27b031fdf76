// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truetriad/report/report.h"

namespace truetriad {

/// Plotly's bundle gl3d with its licence; empty where it was not there at build time.
EmbeddedScript EmbeddedPlotScript();

}  // namespace truetriad
