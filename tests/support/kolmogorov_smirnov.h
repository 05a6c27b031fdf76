// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace truetriad {

/// One-sample Kolmogorov-Smirnov test against the uniform distribution on [0, 1].
struct KolmogorovSmirnov {
  double statistic = 0.0;
  double p_value = 1.0;  ///< Asymptotic, with Stephens' finite-sample factor.
};
/// `values`: at least one, none NaN; those outside [0, 1] count as very unlikely, as they should.
KolmogorovSmirnov KolmogorovSmirnovUniform(std::vector<double> values);

}  // namespace truetriad
