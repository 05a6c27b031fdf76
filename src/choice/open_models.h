// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "truetriad/base/triad.h"
#include "truetriad/problem/options.h"

namespace truetriad {

// One possible form of a part of a triad's model.
struct Level {
  std::string words;
  std::function<void(TriadOptions*)> set;
};

enum class PartKind {
  kMatrix,       // at the reference temperature; every model has one
  kTerm,         // present or not
  kThermalTerm,  // a term in the temperature's rate, present or not
  kBiasOrder,    // order of the bias as a polynomial in temperature
  kMatrixOrder,
  kThermalShape,  // shape of the matrix' temperature terms, if their order is not 0
};

// A part of a triad's model that is open. Each of its levels contains the previous level.
struct OpenPart {
  Triad triad = Triad::kAccelerometer;
  PartKind kind = PartKind::kTerm;
  std::vector<Level> levels;
};

// The level of every open part.
using Choice = std::vector<std::size_t>;

// A model that differs from a choice by one level of one part.
struct Neighbour {
  Choice choice;
  std::string description;
  bool is_larger = false;
  std::optional<Triad> thermal_triad;  // set if the step is in a triad's temperature terms
  bool is_of_bias = false;             // whether these are terms of the bias
};

// The models that options leave open, for poses at `temperatures` different temperatures.
class OpenModels {
 public:
  OpenModels(const CalibrateOptions& wanted, int temperatures);

  Choice Largest() const;

  // Whether a part in temperature is open, and the poses have several temperatures.
  bool HasThermalChoice() const;

  // The options with every open part at its chosen level.
  CalibrateOptions OptionsOf(const Choice& choice) const;

  // The open parts with their chosen levels in words: "accelerometer full; gyroscope full,
  // g-sensitivity".
  std::string DescriptionOf(const Choice& choice) const;

  std::vector<Neighbour> NeighboursOf(const Choice& choice) const;

  // Lowers one part by one level: the part that the poses most probably do not determine. If
  // `keep_matrices`, matrices are not lowered. Returns false if no part can be lowered.
  bool Shrink(bool keep_matrices, Choice* choice) const;

  // What the next larger level of each part would add to the choice: "gyroscope T'".
  std::string Missing(const Choice& choice) const;

 private:
  bool IsOrder(std::size_t part) const;
  bool IsTerm(std::size_t part) const;
  bool Matters(std::size_t part, const CalibrateOptions& options) const;
  // "gyroscope without g-sensitivity", "accelerometer diagonal".
  std::string DescriptionOfStep(std::size_t part, std::size_t level) const;

  CalibrateOptions wanted_;
  int temperatures_ = 0;
  std::vector<OpenPart> parts_;
};

}  // namespace truetriad
