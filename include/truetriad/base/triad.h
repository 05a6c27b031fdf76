// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "truetriad/base/result.h"

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

/// Standard gravity, by which the unit g is defined. CGPM 1901.
inline constexpr double kStandardGravityMps2 = 9.80665;

/// Angles are in rad; files and reports state degrees. A half turn is pi rad or 180 degrees.
inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;  ///< 1 / kRadPerDeg.

inline constexpr double kAbsoluteZeroDegc = -273.15;  ///< Definition of the degree Celsius.

/// The unit of a triad's raw readings; true values are in m/s^2, rad/s or uT.
struct Unit {
  std::string name;            ///< As in files: "m/s^2", "g", "deg/s", "uT", "mG", "counts", …
  double truth_per_raw = 1.0;  ///< Size of a raw unit in true units; 1 for counts (size unknown).
  bool is_counts = false;      ///< ADC counts (or any arbitrary unit): the scale is not known.
};

/// Parses the name of a unit of `triad`; other spellings (dps, µT, LSB) are accepted. Error (bad
/// input): `name` is unknown; the message lists the units of `triad`.
Result<Unit> ParseTriadUnit(Triad triad, std::string_view name);

/// The true unit of `triad`: "m/s^2", "rad/s" or "uT".
std::string_view TruthUnitName(Triad triad);

/// Number of nanoseconds in the time unit `name` (s, ms, us or ns); nullopt for another name.
std::optional<double> NanosecondsPer(std::string_view name);

/// A unit of temperature, in which degC = scale * raw + offset. ParseTemperatureUnit returns
/// nullopt unless `name` is degC, C, °C or K.
struct TemperatureUnit {
  double scale = 1.0;
  double offset = 0.0;
};
std::optional<TemperatureUnit> ParseTemperatureUnit(std::string_view name);

/// A value that may be missing, like std::optional, but memory for the value is allocated only if
/// it is present. Meant for large members of many thousand objects in which most lack the value.
/// Copies are deep.
template <typename T>
class Boxed {
 public:
  Boxed() = default;
  Boxed(std::nullopt_t) {}  // NOLINT(google-explicit-constructor): as std::optional.
  Boxed(T value) : value_(std::make_unique<T>(std::move(value))) {}  // NOLINT: likewise.
  Boxed(const Boxed& other) : value_(other ? std::make_unique<T>(*other) : nullptr) {}
  Boxed(Boxed&&) noexcept = default;
  Boxed& operator=(const Boxed& other) { return *this = Boxed(other); }
  Boxed& operator=(Boxed&&) noexcept = default;
  ~Boxed() = default;

  bool has_value() const { return value_ != nullptr; }
  explicit operator bool() const { return has_value(); }
  T& operator*() { return *value_; }
  const T& operator*() const { return *value_; }
  T* operator->() { return value_.get(); }
  const T* operator->() const { return value_.get(); }

  T& emplace() { return *(value_ = std::make_unique<T>()); }
  void reset() { value_.reset(); }

 private:
  std::unique_ptr<T> value_;
};

}  // namespace truetriad
