// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>

#include "faults/scene.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/terms.h"

namespace truetriad {

// When a fault is there: what its columns are multiplied with over the run.
enum class FaultShape {
  kThroughout,   // 1
  kDrift,        // τ from -1 to 1
  kWarmUp,       // exp(-3 (τ + 1))
  kTemperature,  // the temperature, from -1 to 1
  kWander,       // cos(π j (τ + 1) / 2), j = 1 … 4: four times the unknowns
  kStep,         // 0 before a position, 1 from there on
  kWindow,       // 1 between two positions
  kOnce,         // 1 at one position
};

// Whose value was not one and the same over the run if the fault is there; what is printed is then
// its mean, and as uncertain as it varied.
enum class Varies { kNothing, kBias, kGain, kMatrix, kMounting, kField };

// One thing that a recording may do and the model does not have. A new one is a row of the table.
struct FaultKind {
  std::string_view name;  // after that of the sensor: "bias drift"
  std::initializer_list<Triad> sensors;
  FaultForm form;
  std::string_view remedy;
  std::string_view unit = {};  // of h; empty: that of the readings
  FaultShape shape = FaultShape::kThroughout;
  Varies varies = Varies::kNothing;
  // The first term of a series: where it is large its form decides the correction.
  bool is_truncated = false;
  // Where the model has it as a parameter, which.
  std::optional<ParameterKind> parameter = {};
};

std::span<const FaultKind> FaultKinds();

// Whether it is looked for at many positions.
constexpr bool IsScan(FaultShape shape) {
  return shape == FaultShape::kStep || shape == FaultShape::kWindow || shape == FaultShape::kOnce;
}

// A bend of an axis, throughout: the poses tell it from the model only where they lie well.
constexpr bool IsBend(const FaultKind& kind) {
  return kind.form == FaultForm::kSquare || kind.form == FaultForm::kCube ||
         kind.form == FaultForm::kSize;
}

}  // namespace truetriad
