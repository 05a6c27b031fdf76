// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "line/effects.h"

namespace truetriad::line {

/// Factors of the units: who belongs to which level.
struct Factors {
  std::vector<FactorLevels> factors;
  std::vector<std::vector<int>> level_of;  // by factor, by unit; -1: the unit has no values
  /// related[a][b]: each level of one of them goes with one level of the other, so that both in one
  /// model would say nothing of that other. Also of a factor with itself.
  std::vector<std::vector<bool>> related;
  std::vector<std::string> notes;  // what cannot be told apart or was left out

  std::size_t count() const { return factors.size(); }
  /// Whether the unit carries the factor's tag. Those that do not are a level without a name in the
  /// models of other factors, and no part of this one's.
  bool IsNamed(std::size_t factor, std::size_t unit) const {
    const int level = level_of[factor][unit];
    return level >= 0 && !factors[factor].levels[static_cast<std::size_t>(level)].empty();
  }
};

/// Those of the wanted tags that distinguish units: at least two levels, and at least three times
/// as many units as levels.
Factors FactorsOf(const LineData& data, const std::vector<std::string>& wanted);

/// The factors of the model in which `factor` is estimated: itself and all that are not related to
/// it, without those that others of the model determine.
std::vector<std::size_t> ModelFor(const Factors& factors, std::size_t factor);

/// The factors of the model of everything: those that no other determines.
std::vector<std::size_t> FullModel(const Factors& factors);

}  // namespace truetriad::line
