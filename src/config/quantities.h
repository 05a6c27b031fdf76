// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "config/yaml_values.h"
#include "io/yaml_reader.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Quantities whose keys name the unit, so that people can copy what a data sheet says.

/// One way to state a quantity: value in the program's unit = number * scale.
struct QuantityKey {
  std::string key;
  double scale = 1.0;
};
using QuantityKeys = std::vector<QuantityKey>;

/// `stem`_`unit``tail` for every unit of the triad's truth: "bias_mps2", "bias_mg", …
QuantityKeys TriadKeys(std::string_view stem, Triad triad, std::string_view tail = "");
/// `stem`_s, _ms, _us; `stem`, _percent, _ppm; `stem`_rad, _mrad, _deg; `stem`_radps, _degps.
QuantityKeys TimeKeys(std::string_view stem);
QuantityKeys ShareKeys(std::string_view stem, std::string_view tail = "");
QuantityKeys AngleKeys(std::string_view stem);
QuantityKeys RateKeys(std::string_view stem);

/// Reads the value of whichever of `keys` is there; false when none is, or when it is wrong. Two of
/// them at once are an error. `range` is that of the number as it is written.
bool ReadQuantity(YamlReader& parent, const QuantityKeys& keys, const Range& range, double* value);
/// Three numbers [x, y, z], or one for all.
bool ReadQuantity(YamlReader& parent,
                  const QuantityKeys& keys,
                  const Range& range,
                  Eigen::Vector3d* value);
/// Three rows of any numbers.
bool ReadQuantity(YamlReader& parent, const QuantityKeys& keys, Eigen::Matrix3d* value);

}  // namespace truetriad
