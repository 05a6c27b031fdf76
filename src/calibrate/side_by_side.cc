// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/named_values.h"
#include "calibrate/evaluated_poses.h"
#include "math/distributions.h"
#include "truetriad/base/triad.h"
#include "truetriad/calibrate/evaluate.h"

namespace truetriad {
namespace {

using Errors = std::vector<double>;

// σ of gravity at an unknown place, m/s^2: it is 9.78 at the equator and 9.83 at the poles.
constexpr double kAnywhereGravitySigmaMps2 = 0.02;

bool IsImported(const Calibration& calibration) {
  return Find(calibration.findings, FindingCode::kImported) != nullptr;
}

Errors AboutMean(Errors values) {
  double mean = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (double& value : values) value -= mean;
  return values;
}

Errors LengthErrors(const EvaluationSummary& evaluation, Triad triad) {
  Errors errors;
  for (const PoseResidual& residual : evaluation.pose_residuals) {
    if (residual.triad == triad) errors.push_back(residual.norm_error);
  }
  return errors;
}

// Whether the mean squares of paired errors a and b differ by more than chance. If they do not, u =
// a + b and v = a - b are uncorrelated, and (n - 1) r^2 / (1 - r^2) ~ F(1, n - 1). Pitman 1939,
// Morgan 1939.
bool DifferByMoreThanChance(const Errors& a, const Errors& b) {
  double uu = 0.0, vv = 0.0, uv = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double u = a[i] + b[i], v = a[i] - b[i];
    uu += u * u;
    vv += v * v;
    uv += u * v;
  }
  const double left = uu * vv - uv * uv, dof = static_cast<double>(a.size()) - 1.0;
  if (dof < 1.0 || !(vv > 0.0)) return false;
  return !(left > 0.0) || FisherUpper(dof * uv * uv / left, 1.0, dof) < kByChance;
}

// `unsure`: σ of the reference that both are compared with, in the unit of the errors.
void Add(std::string_view name,
         std::string_view unit,
         double per_error,
         double unsure,
         const Errors& a,
         const Errors& b,
         std::vector<ErrorOfTwo>* errors) {
  if (a.empty() || a.size() != b.size()) return;
  // Chosen: a difference below 10 % is no reason to prefer a calibration, however significant.
  constexpr double kWorthIt = 1.1;
  ErrorOfTwo error{name,
                   unit,
                   per_error * RootMeanSquareOf(a),
                   per_error * RootMeanSquareOf(b),
                   static_cast<int>(a.size())};
  const bool is_larger = error.times() > kWorthIt &&
                         std::abs(error.a - error.b) > 2.0 * per_error * unsure &&
                         DifferByMoreThanChance(a, b);
  if (is_larger) error.better = error.a < error.b ? Better::kA : Better::kB;
  errors->push_back(error);
}

std::vector<ErrorOfTwo> ErrorsOf(const EvaluationSummary& a,
                                 const EvaluationSummary& b,
                                 double gravity_sigma_mps2) {
  // 1000 mm/m. The field at the place is unknown, so that a difference in the length of the field
  // decides nothing.
  constexpr double kMillimetres = 1e3, kUndecided = std::numeric_limits<double>::infinity();
  std::vector<ErrorOfTwo> errors;
  const auto add_lengths = [&](Triad triad,
                               std::string_view name,
                               std::string_view of_spread,
                               std::string_view unit,
                               double per_error,
                               double unsure) {
    const Errors of_a = LengthErrors(a, triad), of_b = LengthErrors(b, triad);
    if (!a.about_mean[triad] && !b.about_mean[triad]) {
      Add(name, unit, per_error, unsure, of_a, of_b, &errors);
    }
    Add(of_spread, unit, per_error, 0.0, AboutMean(of_a), AboutMean(of_b), &errors);
  };
  add_lengths(Triad::kAccelerometer,
              "accelerometer",
              "accelerometer-spread",
              "mm/s^2",
              kMillimetres,
              gravity_sigma_mps2);
  add_lengths(Triad::kMagnetometer, "magnetometer", "magnetometer-spread", "uT", 1.0, kUndecided);
  Add("angle", "deg", kDegPerRad, 0.0, AboutMean(a.angles_rad), AboutMean(b.angles_rad), &errors);
  Add("gyroscope",
      "deg/s",
      kDegPerRad,
      0.0,
      LengthErrors(a, Triad::kGyroscope),
      LengthErrors(b, Triad::kGyroscope),
      &errors);
  if (a.turns && b.turns && a.turns->against == b.turns->against) {
    Add("turn", "deg", kDegPerRad, 0.0, a.turns->errors_rad, b.turns->errors_rad, &errors);
  }
  return errors;
}

}  // namespace

std::string_view BetterName(Better better) {
  constexpr NamedValues<Better, 4> kNames = {{
      {Better::kNeither, "neither"},
      {Better::kA, "a"},
      {Better::kB, "b"},
      {Better::kMixed, "mixed"},
  }};
  return kNames.Name(better);
}

Better BetterOf(const SideBySide& both) {
  const auto any = [&both](Better better) {
    return std::any_of(both.errors.begin(), both.errors.end(), [better](const ErrorOfTwo& error) {
      return error.better == better;
    });
  };
  if (any(Better::kA)) return any(Better::kB) ? Better::kMixed : Better::kA;
  return any(Better::kB) ? Better::kB : Better::kNeither;
}

Result<SideBySide> EvaluateSideBySide(const Calibration& a,
                                      const Calibration& b,
                                      const PoseSet& poses,
                                      const std::array<bool, 2>& is_own,
                                      const CountSizes& si_per_count) {
  SideBySide both;
  const Calibration& stating = IsImported(a) && !IsImported(b) ? b : a;
  both.gravity_mps2 = stating.reference.gravity_mps2;
  both.field_ut = stating.reference.field_ut;
  if (!both.field_ut) both.field_ut = (&stating == &a ? b : a).reference.field_ut;
  const double gravity_sigma_mps2 = IsImported(stating)
                                        ? kAnywhereGravitySigmaMps2
                                        : stating.reference.gravity_sigma_mps2.value_or(0.0);
  PosesLeftOut left_out = LeftOut(a, poses, is_own[0]);
  const PosesLeftOut of_b = LeftOut(b, poses, is_own[1]);
  for (const Triad triad : kTriads) left_out[triad].insert(of_b[triad].begin(), of_b[triad].end());
  const auto evaluate = [&](Calibration calibration, bool own, const std::string& name) {
    calibration.reference.gravity_mps2 = both.gravity_mps2;
    calibration.reference.field_ut = both.field_ut;
    Result<EvaluationSummary> found =
        EvaluateWithout(left_out, calibration, poses, own, si_per_count);
    if (!found) found = Error(found.error().code, name + found.error().message);
    return found;
  };
  TRUETRIAD_ASSIGN_OR_RETURN(both.a, evaluate(a, is_own[0], "a: "));
  TRUETRIAD_ASSIGN_OR_RETURN(both.b, evaluate(b, is_own[1], "b: "));
  both.errors = ErrorsOf(both.a, both.b, gravity_sigma_mps2);
  return both;
}

}  // namespace truetriad
