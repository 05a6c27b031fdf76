// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "truetriad/base/triad.h"

namespace truetriad {

// Each kind of parameter that the model of a sensor may have is defined once, here. Layout, names,
// options, files, tables, comparison, export and the simulator loop over these tables; a new axis
// term needs an enumerator, a row, and a case in each of ValueOf and SlopeOf.

/// The response of one sensing axis to its input u, beyond gain and bias (triad_model.h):
///
///   raw_i = u_i + sum of a_i f(u_i) over the terms + bias_i
///
/// New terms are appended, so that the simulator's random numbers of the old ones do not change.
enum class AxisTerm { kQuadratic, kAsymmetry, kCubic };
inline constexpr std::size_t kAxisTermCount = 3;  ///< Number of enumerators of AxisTerm.

/// Terms of the bias that depend on the temperature's rate T'; tau is temperature minus reference.
enum class RateTerm { kLinear, kQuadratic, kCross };
inline constexpr std::size_t kRateTermCount = 3;  ///< Number of enumerators of RateTerm.

enum class ParameterKind {
  kBias,
  kSensitivity,
  kGSensitivity,
  kRateLinear,
  kRateQuadratic,
  kRateCross,
  kQuadratic,
  kAsymmetry,
  kCubic,
};

/// f(u) of an axis term.
template <typename Scalar>
Scalar ValueOf(AxisTerm term, const Scalar& felt) {
  switch (term) {
    case AxisTerm::kQuadratic:
      return felt * felt;
    case AxisTerm::kAsymmetry:
      return felt < Scalar(0) ? Scalar(-felt) : felt;
    case AxisTerm::kCubic:
      return felt * felt * felt;
  }
  return Scalar(0);
}

/// The slope f'(u); at the kink of the asymmetry, u = 0, the mean of both sides' slopes.
template <typename Scalar>
Scalar SlopeOf(AxisTerm term, const Scalar& felt) {
  switch (term) {
    case AxisTerm::kQuadratic:
      return Scalar(2) * felt;
    case AxisTerm::kAsymmetry:
      return Scalar((felt > Scalar(0)) - (felt < Scalar(0)));
    case AxisTerm::kCubic:
      return Scalar(3) * felt * felt;
  }
  return Scalar(0);
}

struct AxisTermInfo {
  AxisTerm term;
  ParameterKind kind;
  Triad triad;             ///< The kind of sensor that may have the term.
  std::string_view name;   ///< In files: "quadratic".
  std::string_view words;  ///< For readers: "quadratic term".
  std::string_view label;  ///< Title of its row in a table.
  /// f(u) grows like u^(1 + power): the unit of a is raw^-power, and a = (raw of the signal)^-power
  /// makes the term as large as the signal itself.
  int power;
  /// Largest |f(u) - line| over |u| <= 1 for the line that fits f best by least squares: 2/3 for
  /// u^2 (line: 1/3), 1/2 for |u| (line: 1/2), 2/5 for u^3 (line: 3/5 u).
  double beyond_line;
  /// If all terms of an axis have this flag, TriadModel::Felt inverts the axis in closed form.
  bool is_closed_form;
  /// `model: auto` decides whether the term is estimated.
  bool is_in_auto_model;

  /// If the raw unit is replaced by one that is `per_raw` times smaller, a is divided by this.
  double PowerOf(double per_raw) const { return std::pow(per_raw, power); }
};

inline constexpr std::array<AxisTermInfo, kAxisTermCount> kAxisTerms = {{
    {.term = AxisTerm::kQuadratic,
     .kind = ParameterKind::kQuadratic,
     .triad = Triad::kAccelerometer,
     .name = "quadratic",
     .words = "quadratic term",
     .label = "quadratic term",
     .power = 1,
     .beyond_line = 2.0 / 3.0,
     .is_closed_form = true,
     .is_in_auto_model = true},
    {.term = AxisTerm::kAsymmetry,
     .kind = ParameterKind::kAsymmetry,
     .triad = Triad::kGyroscope,
     .name = "asymmetry",
     .words = "asymmetry",
     .label = "asymmetry ±",
     .power = 0,
     .beyond_line = 0.5,
     .is_closed_form = true,
     .is_in_auto_model = true},
    {.term = AxisTerm::kCubic,
     .kind = ParameterKind::kCubic,
     .triad = Triad::kAccelerometer,
     .name = "cubic",
     .words = "cubic term",
     .label = "cubic term",
     .power = 2,
     .beyond_line = 0.4,
     .is_closed_form = false,
     .is_in_auto_model = false},
}};

struct RateTermInfo {
  RateTerm term;
  ParameterKind kind;
  std::string_view path;     ///< In the name of a parameter: "rate.linear".
  std::string_view words;    ///< "dT/dt".
  std::string_view letters;  ///< "T'".
  std::string_view unit;     ///< Factor from the bias' unit to the coefficient's.

  /// In files: "linear".
  constexpr std::string_view name() const { return path.substr(path.find('.') + 1); }
};

inline constexpr std::array<RateTermInfo, kRateTermCount> kRateTerms = {{
    {RateTerm::kLinear, ParameterKind::kRateLinear, "rate.linear", "dT/dt", "T'", "s/degC"},
    {RateTerm::kQuadratic,
     ParameterKind::kRateQuadratic,
     "rate.quadratic",
     "(dT/dt)^2",
     "T'^2",
     "s^2/degC^2"},
    {RateTerm::kCross, ParameterKind::kRateCross, "rate.cross", "tau dT/dt", "tau T'", "s/degC^2"},
}};

/// The factor of a rate term's coefficient: a number, or an array with one entry per axis.
template <typename Value>
Value FactorOf(RateTerm term, const Value& tau, const Value& rate) {
  switch (term) {
    case RateTerm::kLinear:
      return rate;
    case RateTerm::kQuadratic:
      return rate * rate;
    case RateTerm::kCross:
      return tau * rate;
  }
  return rate;
}

struct ParameterInfo {
  ParameterKind kind;
  std::string_view name;   ///< In the names of parameters.
  bool is_matrix = false;  ///< 9 entries; else 3, one per axis.
  std::optional<RateTerm> rate = {};
  std::optional<AxisTerm> axis_term = {};
};

/// All kinds of parameters, in the order of ParameterKind.
inline constexpr auto kParameterKinds = [] {
  std::array<ParameterInfo, 3 + kRateTermCount + kAxisTermCount> all = {{
      {.kind = ParameterKind::kBias, .name = "bias"},
      {.kind = ParameterKind::kSensitivity, .name = "sensitivity", .is_matrix = true},
      {.kind = ParameterKind::kGSensitivity, .name = "g_sensitivity", .is_matrix = true},
  }};
  std::size_t at = 3;
  for (const RateTermInfo& rate : kRateTerms) {
    all[at++] = {.kind = rate.kind, .name = rate.path, .rate = rate.term};
  }
  for (const AxisTermInfo& term : kAxisTerms) {
    all[at++] = {.kind = term.kind, .name = term.name, .axis_term = term.term};
  }
  return all;
}();

constexpr const AxisTermInfo& InfoOf(AxisTerm term) {
  return kAxisTerms[static_cast<std::size_t>(term)];
}
constexpr const RateTermInfo& InfoOf(RateTerm term) {
  return kRateTerms[static_cast<std::size_t>(term)];
}
constexpr const ParameterInfo& InfoOf(ParameterKind kind) {
  return kParameterKinds[static_cast<std::size_t>(kind)];
}

static_assert(std::all_of(kAxisTerms.begin(), kAxisTerms.end(), [](const AxisTermInfo& info) {
  return &InfoOf(info.term) == &info;
}));
static_assert(std::all_of(kRateTerms.begin(), kRateTerms.end(), [](const RateTermInfo& info) {
  return &InfoOf(info.term) == &info;
}));
static_assert(std::all_of(kParameterKinds.begin(),
                          kParameterKinds.end(),
                          [](const ParameterInfo& info) { return &InfoOf(info.kind) == &info; }));

/// How many axis terms a kind of sensor may have.
constexpr std::size_t CountAxisTerms(Triad triad) {
  std::size_t count = 0;
  for (const AxisTermInfo& info : kAxisTerms) count += info.triad == triad ? 1 : 0;
  return count;
}

/// "a quadratic term", "an asymmetry".
std::string WithArticle(std::string_view words);

/// One T for each value of an enumeration that counts from zero.
template <typename Index, std::size_t kCount, typename T>
struct PerIndex {
  std::array<T, kCount> items{};

  static PerIndex All(const T& value) {
    PerIndex all;
    all.items.fill(value);
    return all;
  }
  T& operator[](Index index) { return items[static_cast<std::size_t>(index)]; }
  const T& operator[](Index index) const { return items[static_cast<std::size_t>(index)]; }
  auto begin() { return items.begin(); }
  auto end() { return items.end(); }
  auto begin() const { return items.begin(); }
  auto end() const { return items.end(); }
  /// Whether any item is set, or true.
  bool any() const {
    return std::any_of(begin(), end(), [](const T& item) { return static_cast<bool>(item); });
  }
  bool operator==(const PerIndex&) const = default;
};
template <typename T>
using PerAxisTerm = PerIndex<AxisTerm, kAxisTermCount, T>;
template <typename T>
using PerRateTerm = PerIndex<RateTerm, kRateTermCount, T>;

}  // namespace truetriad
