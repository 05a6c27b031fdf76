// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "problem/rows/field_row.h"

namespace truetriad {

// The magnetometer at a rest, or at a moment of motion:
//
//   rows   h(S R^T m) + b - y        raw unit of the magnetometer
//
// m = B (cos dip cos heading, cos dip sin heading, -sin dip): the field in the frame of the
// attitudes. Parameters and the general form: FieldRow.
class MagnetometerRow final : public FieldRow {
 public:
  MagnetometerRow(const SharedLayout& layout, PoseKind state, const Reading& reading)
      : FieldRow(Triad::kMagnetometer, layout, state, reading) {}
};

}  // namespace truetriad
