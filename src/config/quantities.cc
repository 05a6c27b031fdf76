// SPDX-License-Identifier: Apache-2.0
#include "config/quantities.h"

#include <array>
#include <span>
#include <utility>

#include "truetriad/base/units.h"

namespace truetriad {
namespace {

using UnitScale = std::pair<std::string_view, double>;

constexpr std::array<UnitScale, 4> kAccelerometerUnits = {{{"mps2", 1.0},
                                                           {"g", kStandardGravityMps2},
                                                           {"mg", kStandardGravityMps2 * 1e-3},
                                                           {"ug", kStandardGravityMps2 * 1e-6}}};
constexpr std::array<UnitScale, 3> kGyroscopeUnits = {
    {{"radps", 1.0}, {"degps", kRadPerDeg}, {"degph", kRadPerDeg / 3600.0}}};
constexpr std::array<UnitScale, 3> kMagnetometerUnits = {
    {{"ut", 1.0}, {"nt", 1e-3}, {"mgauss", 0.1}}};

std::span<const UnitScale> UnitsOf(Triad triad) {
  switch (triad) {
    case Triad::kAccelerometer:
      return kAccelerometerUnits;
    case Triad::kGyroscope:
      return kGyroscopeUnits;
    case Triad::kMagnetometer:
      return kMagnetometerUnits;
  }
  return {};
}

QuantityKeys Keys(std::string_view stem,
                  std::span<const UnitScale> units,
                  std::string_view tail = "") {
  QuantityKeys keys;
  for (const auto& [unit, scale] : units) {
    std::string key(stem);
    if (!unit.empty()) key.append("_").append(unit);
    keys.push_back({key.append(tail), scale});
  }
  return keys;
}

/// The one of `keys` that is there; the reader stands for no value when none is.
std::pair<YamlReader, double> FindQuantity(YamlReader& parent, const QuantityKeys& keys) {
  // Collected, not assigned: assigning a YAML node changes the document.
  std::vector<std::pair<YamlReader, double>> found;
  for (const QuantityKey& key : keys) {
    YamlReader child = parent.Child(key.key);
    if (!child) continue;
    if (!found.empty()) {
      child.Fail("says the same as `" + found.front().first.name() + "`; keep one");
    }
    found.emplace_back(child, key.scale);
  }
  if (!found.empty()) return found.front();
  return {parent.Child(keys.front().key), 1.0};
}

}  // namespace

QuantityKeys TriadKeys(std::string_view stem, Triad triad, std::string_view tail) {
  return Keys(stem, UnitsOf(triad), tail);
}

QuantityKeys TimeKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 3>{{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}}});
}

QuantityKeys ShareKeys(std::string_view stem, std::string_view tail) {
  return Keys(stem, std::array<UnitScale, 3>{{{"", 1.0}, {"percent", 1e-2}, {"ppm", 1e-6}}}, tail);
}

QuantityKeys AngleKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 3>{{{"rad", 1.0}, {"mrad", 1e-3}, {"deg", kRadPerDeg}}});
}

QuantityKeys RateKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 2>{{{"radps", 1.0}, {"degps", kRadPerDeg}}});
}

bool ReadQuantity(YamlReader& parent, const QuantityKeys& keys, const Range& range, double* value) {
  const auto [reader, scale] = FindQuantity(parent, keys);
  double number = 0.0;
  if (!ReadNumber(reader, range, &number)) return false;
  *value = scale * number;
  return true;
}

bool ReadQuantity(YamlReader& parent,
                  const QuantityKeys& keys,
                  const Range& range,
                  Eigen::Vector3d* value) {
  const auto [reader, scale] = FindQuantity(parent, keys);
  const auto read = [&range](const YamlReader& entry, double* number) {
    return ReadNumber(entry, range, number);
  };
  Eigen::Vector3d numbers;
  if (!ReadEntries(reader, true, read, &numbers)) return false;
  *value = scale * numbers;
  return true;
}

bool ReadQuantity(YamlReader& parent, const QuantityKeys& keys, Eigen::Matrix3d* value) {
  const auto [reader, scale] = FindQuantity(parent, keys);
  Eigen::Matrix3d numbers;
  if (!ReadNumbers(reader, &numbers)) return false;
  *value = scale * numbers;
  return true;
}

}  // namespace truetriad
