// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <pybind11/pybind11.h>

#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad::python {

/// truetriad.Calibration.
struct HeldCalibration {
  explicit HeldCalibration(Calibration calibration, std::shared_ptr<const PoseSet> from = {})
      : value(std::make_shared<const Calibration>(std::move(calibration))),
        poses(std::move(from)) {}

  std::shared_ptr<const Calibration> value;
  std::shared_ptr<const PoseSet> poses;  ///< What it was made from; null if it was loaded.
};

void BindCalibration(pybind11::module_& module);
void BindVerbs(pybind11::module_& module);

}  // namespace truetriad::python
