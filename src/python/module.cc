// SPDX-License-Identifier: Apache-2.0
#include <glog/logging.h>
#include <pybind11/pybind11.h>

#include "python/calibration.h"
#include "truetriad/base/result.h"

PYBIND11_MODULE(_truetriad, module) {
  // Logs of the library and the solver are for developers, unless the process has set them up.
  if (!google::IsGoogleLoggingInitialized()) {
    FLAGS_logtostderr = true;
    FLAGS_minloglevel = google::GLOG_FATAL;
  }
  module.doc() = "The compiled part of truetriad for Python; import truetriad instead.";
  module.attr("version") = truetriad::Version();
  truetriad::python::BindCalibration(module);
  truetriad::python::BindVerbs(module);
}
