// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "problem/start_values.h"
#include "problem/thermal_block.h"
#include "verdict/presentation.h"

namespace truetriad {

// A quantity whose σ is predicted, as a linear function of the free coordinates.
struct PlanQuantity {
  std::string name, group, unit;
  double typical = 1.0;    // as large as the signal
  Eigen::RowVectorXd row;  // by the free coordinates in typical units
};

// All that `solution` estimates, by sensing axis and in the units in which limits are stated;
// `rows`: of its parameters, by the free coordinates.
std::vector<PlanQuantity> QuantitiesOf(const PresentedSolution& solution,
                                       const Eigen::MatrixXd& rows,
                                       const ReferenceVector& reference,
                                       const ThermalScale& scale);

}  // namespace truetriad
