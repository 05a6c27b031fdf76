// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

/// Two calibrations of one unit, after taking out the gauge.
struct ComparisonEntry {
  std::string parameter;
  double a = 0.0, b = 0.0;
  double difference = 0.0;
  double sigma = 0.0;  ///< Of the difference, the two taken as independent.
};
struct Comparison {
  std::vector<ComparisonEntry> entries;
  double chi2 = 0.0;
  int dof = 0;
  double p_value = 1.0;
  double largest_in_sigmas = 0.0;
  /// What only one of the two holds, or both without a σ, in words: nothing is said about it.
  std::vector<std::string> not_compared;
  /// The strength of the field was a convention in one of the two: the common scale of the
  /// magnetometer was taken out.
  bool field_scale_taken_out = false;
  /// The body frames have nothing to do with each other (that of the accelerometer, that of the
  /// magnetometer): what no frame changes was compared, biases and C^T C ("gram").
  bool frames_differ = false;
};

/// Whether two calibrations say the same.
enum class Agreement {
  kNotCompared,  ///< They have no common parameter with a σ.
  kAgree,        ///< p of all differences together is at least kAgreementProbability.
  kDiffer,
};
inline constexpr double kAgreementProbability = 0.01;
Agreement AgreementOf(const Comparison& comparison);
std::string_view AgreementName(Agreement agreement);  ///< "not-compared", "agree", "differ".

/// The two are more alike than two recordings can be, even were their σ three times too large: they
/// were made from the same readings.
bool IsTooAlike(const Comparison& comparison);

/// The entry that differs by the most σ; null where none has a σ.
const ComparisonEntry* LargestOf(const Comparison& comparison);

Result<Comparison> Compare(const Calibration& a, const Calibration& b);

}  // namespace truetriad
