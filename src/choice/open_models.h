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

// One way in which a part of a triad's model can be.
struct Level {
  std::string words;
  std::function<void(TriadOptions*)> set;
};

enum class PartKind {
  kMatrix,       // of the reference temperature, which no model is without
  kTerm,         // there or not
  kThermalTerm,  // so, in the rate of temperature
  kBiasOrder,    // in temperature
  kMatrixOrder,
  kThermalShape,  // of the matrix in temperature, where it has an order
};

// A part of a triad's model that is open: levels of which each holds the one before.
struct OpenPart {
  Triad triad = Triad::kAccelerometer;
  PartKind kind = PartKind::kTerm;
  std::vector<Level> levels;
};

// The level of every open part.
using Choice = std::vector<std::size_t>;

// A model that differs by one step.
struct Neighbour {
  Choice choice;
  std::string description;
  bool is_larger = false;
  std::optional<Triad> thermal_triad;  // where the step is one of a triad's temperature terms
  bool is_of_bias = false;             // and of its bias
};

// The models that options leave open, of poses at so many temperatures.
class OpenModels {
 public:
  OpenModels(const CalibrateOptions& wanted, int temperatures);

  Choice Largest() const;

  // Something in temperature is open, and there are several.
  bool HasThermalChoice() const;

  // With nothing open.
  CalibrateOptions OptionsOf(const Choice& choice) const;

  // "accelerometer full; gyroscope full, g-sensitivity": what was open, as it was chosen.
  std::string DescriptionOf(const Choice& choice) const;

  std::vector<Neighbour> NeighboursOf(const Choice& choice) const;

  // Takes away what the poses may not determine, one step of one part. False where nothing is left
  // to take.
  bool Shrink(bool keep_matrices, Choice* choice) const;

  // What the least models that a choice does without would add to it: "gyroscope T'".
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
