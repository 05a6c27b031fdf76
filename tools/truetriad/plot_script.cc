// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/plot_script.h"

#include <gflags/gflags.h>

DEFINE_bool(interactive,
            true,
            "whether spheres of the HTML report can be turned, which adds 1.7 MB to it (where the "
            "program was built with what draws them)");

namespace truetriad {

ReportLooks StatedLooks() {
  return FLAGS_interactive ? ReportLooks{.plots = EmbeddedPlotScript()} : ReportLooks();
}

}  // namespace truetriad
