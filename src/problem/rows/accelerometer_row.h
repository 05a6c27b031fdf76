// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/rows/field_row.h"

namespace truetriad {

// The accelerometer at a rest, or at a moment of motion; the accelerations of the motion are noise:
//
//   rows   h(S R^T (0, 0, g)) + b - y        raw unit of the accelerometer
//
// S, b: sensitivity and bias at the pose's temperature; h: higher terms; R: the pose's attitude,
// world <- body; g: gravity. Parameters and the general form: FieldRow.
class AccelerometerRow final : public FieldRow {
 public:
  AccelerometerRow(const SharedLayout& layout, PoseKind state, const Reading& reading)
      : FieldRow(Triad::kAccelerometer, layout, state, reading) {}
};

}  // namespace truetriad
