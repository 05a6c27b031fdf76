// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include <Eigen/Core>
#include <Eigen/LU>

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

/// Slope f'(u). At the kink of the asymmetry, u = 0, it is the mean of the slopes on both sides.
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
  bool is_matrix = false;  ///< Whether it has 9 entries instead of 3, one per axis.
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

/// The model of one triad: from the true quantity to the reading of the chip, and back.
///
///   u     = sensitivity * truth                  input of each sensing axis
///   raw_i = u_i + sum of a_i f(u_i) + bias_i     response of the axis; terms a f of terms.h
///   truth = correction * u(raw - bias)           calibrated reading; correction = sensitivity^-1
///
/// Most chips have no axis terms: all are zero. Axis terms are functions of u, not of the truth,
/// since they belong to the sensing axis: neither u nor the terms change if the body frame is
/// rotated or the gains refer to another field strength.
///
/// Frame: truth is in the body frame; row i of sensitivity is sensing axis i there. Stored
/// column-major (Eigen).
/// Units: truth in m/s^2, rad/s or uT; raw, u and bias in the log's unit; sensitivity in raw per
/// true unit; the quadratic term per raw, the cubic per raw^2. The asymmetry a is a share of the
/// gain: where u > 0 the gain is 1 + a times the sensitivity's, where u < 0 it is 1 - a times.
/// Range: |asymmetry| < 1.
/// Gauge: static poses do not determine a common rotation of all rows; gauge.h has the conventions.
template <typename Scalar>
struct TriadModel {
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  Matrix3 sensitivity = Matrix3::Identity();
  Vector3 bias = Vector3::Zero();
  PerAxisTerm<Vector3> axis_terms = PerAxisTerm<Vector3>::All(Vector3::Zero());

  Vector3 RawFromTruth(const Vector3& truth) const {
    const Vector3 felt = sensitivity * truth;
    Vector3 raw = felt + bias;
    for (const AxisTermInfo& info : kAxisTerms) {
      const Vector3& a = axis_terms[info.term];
      for (int i = 0; i < 3; ++i) {
        if (IsThere(a[i])) raw[i] += a[i] * ValueOf(info.term, felt[i]);
      }
    }
    return raw;
  }

  /// Undefined (infinities) when the sensitivity is singular.
  Vector3 TruthFromRaw(const Vector3& raw) const { return Correction() * Felt(raw - bias); }

  Matrix3 Correction() const { return sensitivity.inverse(); }

  /// The input u that gives `reading`, which is raw - bias: of the roots of u + sum of a f(u) =
  /// reading, the one that tends to zero with the reading. NaN if no u gives the reading.
  Vector3 Felt(const Vector3& reading) const {
    using std::sqrt;
    const Vector3& quadratic = axis_terms[AxisTerm::kQuadratic];
    const Vector3& asymmetry = axis_terms[AxisTerm::kAsymmetry];
    Vector3 felt = reading;
    for (int i = 0; i < 3; ++i) {
      if (IsThere(quadratic[i]) || IsThere(asymmetry[i])) {
        const Scalar gain = Scalar(1) + (reading[i] < Scalar(0) ? -asymmetry[i] : asymmetry[i]);
        felt[i] *= Scalar(2) / (gain + sqrt(gain * gain + Scalar(4) * quadratic[i] * reading[i]));
      }
      for (const AxisTermInfo& info : kAxisTerms) {
        if (info.is_closed_form || !IsThere(axis_terms[info.term][i])) continue;
        felt[i] = RootFrom(felt[i], i, reading[i]);
        break;
      }
    }
    return felt;
  }

  /// d raw / d u at u, axis by axis.
  Vector3 Slope(const Vector3& felt) const {
    Vector3 slope;
    for (int i = 0; i < 3; ++i) slope[i] = SlopeAt(i, felt[i]);
    return slope;
  }

 private:
  // Zero terms are skipped, which also keeps infinities unchanged. If the scalar has derivatives
  // (ceres::Jet), they are not skipped: a zero term has derivatives, too.
  static bool IsThere(const Scalar& a) {
    return !std::is_floating_point_v<Scalar> || a != Scalar(0);
  }

  Scalar SlopeAt(int i, const Scalar& felt) const {
    Scalar slope(1);
    for (const AxisTermInfo& info : kAxisTerms) {
      slope += axis_terms[info.term][i] * SlopeOf(info.term, felt);
    }
    return slope;
  }

  // Felt of one axis by Newton's method, kept between zero and the point where the slope is zero.
  Scalar RootFrom(const Scalar& start, int i, const Scalar& reading) const {
    using std::abs;
    constexpr int kMostSteps = 100;       // Bisection alone reaches 2^-53 in 53 steps.
    constexpr double kPrecision = 1e-14;  // Relative; 45 times the rounding.
    // From here on, all values are multiplied by the sign of the reading, so that it is positive.
    const Scalar sign(reading < Scalar(0) ? -1.0 : 1.0);
    Scalar low(0), high(std::numeric_limits<double>::infinity());
    Scalar size = sign * start;
    if (!(size > low)) size = sign * reading;  // `start` is NaN if the other terms have no root.
    for (int step = 0; step < kMostSteps; ++step) {
      const Scalar felt = sign * size;
      Scalar miss = felt - reading;
      for (const AxisTermInfo& info : kAxisTerms) {
        miss += axis_terms[info.term][i] * ValueOf(info.term, felt);
      }
      miss *= sign;
      const Scalar slope = SlopeAt(i, felt);
      const bool is_rising = slope > Scalar(0);
      Scalar next = size - miss / slope;
      if (is_rising && abs(next - size) <= Scalar(kPrecision) * size) return sign * next;
      (is_rising && miss < Scalar(0) ? low : high) = size;
      if (!is_rising || !(next > low && next < high)) next = Scalar(0.5) * (low + high);
      size = next;
    }
    return Scalar(std::numeric_limits<double>::quiet_NaN());
  }
};

/// Norm of a corrected reading minus the reference strength, true unit.
inline double NormError(const TriadModel<double>& model,
                        const Eigen::Vector3d& reading,
                        double strength) {
  return model.TruthFromRaw(reading).norm() - strength;
}

}  // namespace truetriad
