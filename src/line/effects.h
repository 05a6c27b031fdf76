// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/interval.h"
#include "line/line_data.h"

namespace truetriad::line {

struct EffectOptions {
  /// Tags that are looked at where units carry at least two values of them.
  std::vector<std::string> factors = {"station", "slot", "fixture", "operator", "lot"};
};

/// What one level of a factor (one fixture, say) adds to a parameter, against the mean of the
/// factor's levels.
struct LevelEffect {
  std::string level;
  int units = 0;
  double effect = 0.0;  // parameter's unit; NaN: cannot be told
  double sigma = 0.0;
};

/// One factor's effect upon one parameter, the other factors being allowed for.
struct ParameterEffect {
  int factor = 0;     // index in EffectReport::factors
  int parameter = 0;  // index in LineData::parameters
  std::vector<LevelEffect> levels;
  double f = 0.0, dof = 0.0, error_dof = 0.0;
  double p = 1.0;
  double p_adjusted = 1.0;  // Holm's, over all tests of the report that are of one parameter
  /// σ between levels (variance component), 0 if not more than chance; parameter's unit.
  double sigma_between = 0.0;
};

/// The spread of one parameter that no factor explains.
struct ResidualSpread {
  int parameter = 0;
  int units = 0;                         // used
  int outliers = 0;                      // beyond 5 σ of the model, left out
  double sigma = 0.0;                    // of units within all levels
  int without_sigma = 0;                 // of them: whose calibration states no (finite) σ
  double calibration_sigma = kNotKnown;  // root mean square of what the others state; NaN: none do
  double process_sigma =
      kNotKnown;  // what is left: sqrt(sigma^2 - calibration_sigma^2), at least 0
};

/// One factor's effect upon all parameters together: Wilks' Λ by Rao's F.
struct JointEffect {
  int factor = 0;
  int parameters = 0;  // that are independent of each other
  double wilks = 1.0;
  double f = 0.0, dof = 0.0, error_dof = 0.0;
  double p = 1.0;
  double p_adjusted = 1.0;  // Holm's, over the factors
};

struct FactorLevels {
  std::string name;
  std::vector<std::string> levels;  // empty text: units without the tag, of which nothing is said
};

struct EffectReport {
  std::vector<FactorLevels> factors;
  std::vector<ParameterEffect> effects;
  std::vector<ResidualSpread> spreads;
  std::vector<JointEffect> joint;
  /// What cannot be told apart, or was left out, and why: a sentence each.
  std::vector<std::string> notes;
};

/// Effects of stations, slots, fixtures, operators, ... that units' tags name: a linear model of
/// each parameter with all factors at once,
///
///   value = mean + sum over factors of effect(level) + rest,    effects of a factor sum to 0,
///
/// by least squares over the units (unbalanced as they are). Each factor is tested by what it adds
/// to the others (type III without interactions). Every unit has the same weight: the calibration's
/// own variance is in the rest, and is subtracted from it for `process_sigma`.
EffectReport Effects(const LineData& data, const EffectOptions& options = {});

}  // namespace truetriad::line
