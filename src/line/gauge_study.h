// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "line/line_data.h"
#include "truetriad/base/result.h"

namespace truetriad::line {

/// One run of a study: the part (unit), the appraiser or fixture, and the value.
struct GaugeReading {
  std::string part, appraiser;
  double value = 0.0;
};

enum class StudyDesign {
  kCrossed,       ///< Every appraiser measures every part.
  kNested,        ///< Each appraiser has parts of its own.
  kOneAppraiser,  ///< Only one, so the effect of appraisers is unknown.
};
std::string_view StudyDesignName(StudyDesign design);  ///< "crossed", "nested", "one appraiser".

/// A line of the analysis of variance; NaN if the design has no such line.
struct AnovaLine {
  double sum_of_squares = kNotKnown, dof = kNotKnown, mean_square = kNotKnown;
  double f = kNotKnown, p = kNotKnown;
};

struct VarianceComponent {
  double variance = kNotKnown;         ///< Never below zero.
  Interval interval;                   ///< Of the variance; NaN for reproducibility and total.
  double study_share = kNotKnown;      ///< sigma / sigma of the total.
  double tolerance_share = kNotKnown;  ///< 6 sigma / width of the limits.
};

/// A gauge study by analysis of variance: value = part + appraiser + interaction + error.
struct GaugeStudy {
  StudyDesign design = StudyDesign::kCrossed;
  int parts = 0, appraisers = 0, repeats = 0;  ///< kNested: `parts` is for each appraiser.
  AnovaLine part, appraiser, interaction, error;
  bool is_pooled = false;           ///< The interaction is insignificant and part of the error.
  VarianceComponent repeatability;  ///< The error.
  VarianceComponent appraiser_alone, interaction_alone;
  VarianceComponent reproducibility;  ///< Appraisers and interaction.
  VarianceComponent gauge;            ///< Repeatability and reproducibility.
  VarianceComponent part_to_part, total;
  int distinct_categories = 0;  ///< 1.41 sigma of the parts / sigma of the gauge, rounded down.
};

struct GaugeStudyOptions {
  double tolerance = kNotKnown;  ///< Upper limit - lower limit; NaN: none.
  double confidence = 0.95;
  double pool_above_p = 0.25;  ///< The interaction is pooled if its p is larger (AIAG 2010).
};

/// Error (not enough): there are fewer than two parts or repeats, or the study is not balanced,
/// since a part or a repeat is missing somewhere. The message states which.
Result<GaugeStudy> FindGaugeStudy(const std::vector<GaugeReading>& readings,
                                  const GaugeStudyOptions& options = {});

/// The study of one part measured repeatedly: the repeatability and the bias of the gauge.
struct Type1Study {
  Eigen::Index runs = 0;
  double mean = kNotKnown;
  Estimate sigma;                                 ///< Repeatability.
  double reference = kNotKnown;                   ///< The known value of the part; NaN: unknown.
  Estimate bias;                                  ///< mean - reference.
  double bias_t = kNotKnown, bias_p = kNotKnown;  ///< Student's test: is the bias zero?
  double cg = kNotKnown;                          ///< 0.2 tolerance / (6 sigma); good from 1.33.
  double cgk = kNotKnown;  ///< (0.1 tolerance - |bias|) / (3 sigma); good from 1.33.
  double repeatability_share = kNotKnown;  ///< 6 sigma / tolerance; 15 % if Cg is 1.33.
};

/// `tolerance`: width of the limits; NaN: none. With fewer than two runs only `mean` is found. AIAG
/// (2010) requires 25 runs; VDA volume 5 requires 25 to 50 runs.
Type1Study FindType1Study(const Eigen::VectorXd& values,
                          double reference,
                          double tolerance,
                          double confidence = 0.95);

}  // namespace truetriad::line
