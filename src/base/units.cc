// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <span>

#include "base/unit_names.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

struct NamedScale {
  std::string_view name;
  double truth_per_raw;
};

constexpr std::array<NamedScale, 3> kAccelUnits = {{
    {"m/s^2", 1.0},
    {"g", kStandardGravityMps2},
    {"mg", kStandardGravityMps2 * 1e-3},
}};
constexpr std::array<NamedScale, 2> kGyroUnits = {{
    {"rad/s", 1.0},
    {"deg/s", kRadPerDeg},
}};
constexpr std::array<NamedScale, 6> kMagUnits = {{
    {"uT", 1.0},
    {"nT", 1e-3},
    {"mT", 1e3},
    {"T", 1e6},
    {"G", 100.0},
    {"mG", 0.1},
}};

// Other spellings of units, as users and other programs write them.
struct Spelling {
  std::string_view other, usual;
};
constexpr std::array<Spelling, 15> kOtherSpellings = {{{"count", "counts"},
                                                       {"LSB", "counts"},
                                                       {"lsb", "counts"},
                                                       {"adc", "counts"},
                                                       {"ADC", "counts"},
                                                       {"raw", "counts"},
                                                       {"dps", "deg/s"},
                                                       {"°/s", "deg/s"},
                                                       {"m/s2", "m/s^2"},
                                                       {"m/s²", "m/s^2"},
                                                       {"m/s/s", "m/s^2"},
                                                       {"\u00b5T", "uT"},
                                                       {"\u03bcT", "uT"},
                                                       {"Gauss", "G"},
                                                       {"gauss", "G"}}};

std::span<const NamedScale> UnitsOf(Triad triad) {
  switch (triad) {
    case Triad::kAccelerometer:
      return kAccelUnits;
    case Triad::kGyroscope:
      return kGyroUnits;
    case Triad::kMagnetometer:
      return kMagUnits;
  }
  return {};
}

}  // namespace

Result<Unit> ParseTriadUnit(Triad triad, std::string_view name) {
  for (const auto& [other, usual] : kOtherSpellings) {
    if (name == other) name = usual;
  }
  if (name == "counts") return Unit{"counts", 1.0, true};
  std::string message = "`";
  message.append(name).append("` is not a unit of the ").append(TriadName(triad));
  message.append("; expected one of ");
  for (const NamedScale& unit : UnitsOf(triad)) {
    if (name == unit.name) return Unit{std::string(name), unit.truth_per_raw, false};
    message.append(unit.name).append(", ");
  }
  return Error(ErrorCode::kUnknownUnit, message.append("counts"));
}

std::vector<std::string_view> TriadUnitNames(Triad triad) {
  std::vector<std::string_view> names = {"counts"};
  for (const NamedScale& unit : UnitsOf(triad)) names.push_back(unit.name);
  for (const auto& [other, usual] : kOtherSpellings) {
    if (std::find(names.begin(), names.end(), usual) != names.end()) names.push_back(other);
  }
  return names;
}

std::string_view TruthUnitName(Triad triad) { return UnitsOf(triad).front().name; }

std::optional<double> NanosecondsPer(std::string_view name) {
  if (name == "s") return 1e9;
  if (name == "ms") return 1e6;
  if (name == "us") return 1e3;
  if (name == "ns") return 1.0;
  return std::nullopt;
}

std::optional<TemperatureUnit> ParseTemperatureUnit(std::string_view name) {
  if (name == "degC" || name == "C" || name == "\u00b0C") return TemperatureUnit{1.0, 0.0};
  if (name == "K") return TemperatureUnit{1.0, kAbsoluteZeroDegc};
  return std::nullopt;
}

}  // namespace truetriad
