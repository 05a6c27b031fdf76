// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// One parameter of two calibrations of one unit, both in the same body frame.
struct ComparisonEntry {
  std::string parameter;
  double a = 0.0, b = 0.0;
  double difference = 0.0;
  double sigma = 0.0;  ///< σ of the difference if the two are independent.
};
struct Comparison {
  std::vector<ComparisonEntry> entries;
  double chi2 = 0.0;
  int dof = 0;
  double p_value = 1.0;
  double largest_in_sigmas = 0.0;
  /// Parameters that are not compared, in words: those that one of the two lacks, holds fixed or
  /// states without a σ.
  std::vector<std::string> not_compared;
  /// In one of the two, or both, the field strength was a convention. The comparison therefore
  /// leaves out the common scale of the magnetometer.
  bool field_scale_taken_out = false;
  /// The body frames are unrelated (one is the accelerometer's, the other the magnetometer's). Only
  /// values that no rotation changes were compared, such as biases and C^T C ("gram").
  bool frames_differ = false;
};

/// Whether two calibrations agree.
enum class Agreement {
  kNotCompared,  ///< They have no common parameter with a σ.
  kAgree,        ///< p of all differences together is at least kAgreementProbability.
  kDiffer,
};
/// Of the pairs of calibrations of an unchanged unit, one in a hundred counts as kDiffer by chance.
inline constexpr double kAgreementProbability = 0.01;
Agreement AgreementOf(const Comparison& comparison);
std::string_view AgreementName(Agreement agreement);  ///< "not-compared", "agree", "differ".

/// Whether the two are more alike than two recordings can be, even if their σ were three times too
/// large: they were made from the same readings.
bool IsTooAlike(const Comparison& comparison);

/// The entry that differs by the most σ; null if none has a σ.
const ComparisonEntry* LargestOf(const Comparison& comparison);

Result<Comparison> Compare(const Calibration& a, const Calibration& b);

}  // namespace truetriad
