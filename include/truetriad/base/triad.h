// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <optional>
#include <string_view>

namespace truetriad {

/// The kinds of three-axis sensor that are calibrated.
enum class Triad { kAccelerometer = 0, kGyroscope = 1, kMagnetometer = 2 };

inline constexpr std::array<Triad, 3> kTriads = {
    Triad::kAccelerometer, Triad::kGyroscope, Triad::kMagnetometer};

/// The names of the axes, and of the rows and columns of a matrix.
inline constexpr std::string_view kAxisLetters = "xyz";
constexpr char AxisLetter(std::integral auto axis) {
  return kAxisLetters[static_cast<std::size_t>(axis)];
}

/// "accelerometer", "gyroscope", "magnetometer": the names in every file.
constexpr std::string_view TriadName(Triad triad) {
  constexpr std::array<std::string_view, 3> kNames = {"accelerometer", "gyroscope", "magnetometer"};
  return kNames[static_cast<std::size_t>(triad)];
}

/// "accel", "gyro", "mag": the column prefixes of a self-describing CSV.
constexpr std::string_view TriadPrefix(Triad triad) {
  constexpr std::array<std::string_view, 3> kNames = {"accel", "gyro", "mag"};
  return kNames[static_cast<std::size_t>(triad)];
}

constexpr std::optional<Triad> TriadFromName(std::string_view name) {
  for (const Triad triad : kTriads) {
    if (name == TriadName(triad)) return triad;
  }
  return std::nullopt;
}

/// One T for each kind of triad, indexed by the kind.
template <typename T>
struct PerTriad {
  std::array<T, 3> items{};

  T& operator[](Triad triad) { return items[static_cast<std::size_t>(triad)]; }
  const T& operator[](Triad triad) const { return items[static_cast<std::size_t>(triad)]; }
  auto begin() { return items.begin(); }
  auto end() { return items.end(); }
  auto begin() const { return items.begin(); }
  auto end() const { return items.end(); }
  bool operator==(const PerTriad&) const = default;
};

}  // namespace truetriad
