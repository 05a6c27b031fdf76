// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>

#include "faults/scene.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/triad_model.h"

namespace truetriad {

// The time course of a fault: the factors of its columns over the run.
enum class FaultShape {
  kThroughout,   // 1
  kDrift,        // τ: time, from -1 to 1 over the run
  kWarmUp,       // exp(-3 (τ + 1))
  kTemperature,  // the temperature, scaled to a range of 2
  kWander,       // cos(π j (τ + 1) / 2), j = 1 … 4: four times the unknowns
  kStep,         // 0 before a position, 1 at and after it
  kWindow,       // 1 between two positions
  kOnce,         // 1 at one position
};

// The calibrated value that varies over the run if the fault is real. The result states the mean of
// this value; its σ includes the variation.
enum class Varies { kNothing, kBias, kGain, kMatrix, kMounting, kField };

// An effect that recordings may contain and that the fitted model lacks. To add a kind, add a row
// to kKinds (kinds.cc).
struct FaultKind {
  std::string_view name;  // in messages, after the sensor's name: "bias drift"
  std::initializer_list<Triad> sensors;
  FaultForm form;
  std::string_view remedy;
  std::string_view unit = {};  // unit of h; empty: the unit of the readings
  FaultShape shape = FaultShape::kThroughout;
  Varies varies = Varies::kNothing;
  // The form is only the first term of a series: a large effect cannot be corrected in full.
  bool is_truncated = false;
  // The parameter that describes the effect if a user adds it to the model; unset: there is none.
  std::optional<ParameterKind> parameter = {};
};

std::span<const FaultKind> FaultKinds();

// Whether a fault of this shape is tested at many positions.
constexpr bool IsScan(FaultShape shape) {
  return shape == FaultShape::kStep || shape == FaultShape::kWindow || shape == FaultShape::kOnce;
}

// Whether the fault is a nonlinearity of an axis. Only well distributed poses separate such a fault
// from the model.
constexpr bool IsBend(const FaultKind& kind) {
  return kind.form == FaultForm::kSquare || kind.form == FaultForm::kCube ||
         kind.form == FaultForm::kSize;
}

}  // namespace truetriad
