// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "line/interval.h"

namespace truetriad::line {

/// One part, measured again and again: does the gauge repeat, and is it right?
struct Type1Study {
  Eigen::Index runs = 0;
  double mean = kNotKnown;
  Estimate sigma;                                 ///< Repeatability.
  double reference = kNotKnown;                   ///< What the part is known to be; NaN: it is not.
  Estimate bias;                                  ///< mean - reference.
  double bias_t = kNotKnown, bias_p = kNotKnown;  ///< That the bias is none (Student, runs - 1).
  double cg = kNotKnown;                          ///< 0.2 tolerance / (6 sigma); good from 1.33 on.
  double cgk = kNotKnown;                  ///< (0.1 tolerance - |bias|) / (3 sigma); likewise.
  double repeatability_share = kNotKnown;  ///< 6 sigma / tolerance; 15 % where Cg is 1.33.
};

/// `tolerance`: width of the limits; NaN: none. Two runs at least; all NaN of fewer. AIAG (2010)
/// asks for 25, VDA 5 for 25 to 50.
Type1Study FindType1Study(const Eigen::VectorXd& values,
                          double reference,
                          double tolerance,
                          double confidence = 0.95);

}  // namespace truetriad::line
