// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "model/gyro_increment.h"
#include "problem/parameters.h"
#include "problem/rows/row.h"
#include "problem/rows/triad_blocks.h"

namespace truetriad {

// The gyroscope's turn from one moment of motion to the next, which are few readings apart:
//
//   rows   Log(dR(b, S, G)^T R_k^T R_k+1)      rad, in the body frame of the second
//
// As TurnRow, but integrated at the very parameters that it is asked about.
//
// Parameters: the gyroscope's (TriadBlocks); g-sensitivity (9), where there is one; both attitudes.
class IntegratedTurnRow final : public Row {
 public:
  // What `readings` refers to must outlive the row.
  IntegratedTurnRow(const SharedLayout& layout, const GyroReadings& readings);

  bool Evaluate(double const* const* parameters,
                double* residuals,
                double** jacobians) const override;

 private:
  GyroReadings readings_;
  bool has_g_sensitivity_ = false;
  TriadBlocks triad_blocks_;
};

}  // namespace truetriad
