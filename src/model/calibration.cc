// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/calibration.h"

#include <algorithm>
#include <cmath>

#include "base/named_values.h"

namespace truetriad {
namespace {

constexpr NamedValues<Outcome, 5> kOutcomes = {{
    {Outcome::kNotCalled, "not_called"},
    {Outcome::kConverged, "converged"},
    {Outcome::kNotObservable, "not_observable"},
    {Outcome::kNotConverged, "not_converged"},
    {Outcome::kNotEnough, "not_enough"},
}};

constexpr NamedValues<Mode, 3> kModes = {{
    {Mode::kPoses, "poses"},
    {Mode::kMotion, "motion"},
    {Mode::kSweep, "sweep"},
}};

constexpr NamedValues<Verdict, 4> kVerdicts = {{
    {Verdict::kPass, "PASS"},
    {Verdict::kNoLimits, "NO_LIMITS"},
    {Verdict::kFail, "FAIL"},
    {Verdict::kNoResult, "NO_RESULT"},
}};
constexpr NamedValues<Verdict, 4> kVerdictWords = {{
    {Verdict::kPass, "PASS"},
    {Verdict::kNoLimits, "NO LIMITS SET"},
    {Verdict::kFail, "FAIL"},
    {Verdict::kNoResult, "NO RESULT"},
}};

constexpr NamedValues<NoiseSource, 5> kNoiseSources = {{
    {NoiseSource::kStatic, "static"},
    {NoiseSource::kAllan, "allan"},
    {NoiseSource::kDatasheet, "datasheet"},
    {NoiseSource::kConfig, "config"},
    {NoiseSource::kResidual, "residual"},
}};

}  // namespace

double NamedCovariance::Sigma(const std::string& parameter) const {
  const auto found = std::find(parameters.begin(), parameters.end(), parameter);
  if (found == parameters.end()) return 0.0;
  const auto at = static_cast<Eigen::Index>(found - parameters.begin());
  return std::sqrt(std::max(0.0, matrix(at, at)));
}

std::string_view OutcomeName(Outcome outcome) { return kOutcomes.Name(outcome); }
std::optional<Outcome> OutcomeFromName(std::string_view name) { return kOutcomes.Find(name); }

std::string_view VerdictName(Verdict verdict) { return kVerdicts.Name(verdict); }
std::string_view VerdictWords(Verdict verdict) { return kVerdictWords.Name(verdict); }
std::optional<Verdict> VerdictFromName(std::string_view name) { return kVerdicts.Find(name); }

std::string_view ModeName(Mode mode) { return kModes.Name(mode); }
std::optional<Mode> ModeFromName(std::string_view name) { return kModes.Find(name); }

std::string_view NoiseSourceName(NoiseSource source) { return kNoiseSources.Name(source); }
std::optional<NoiseSource> NoiseSourceFromName(std::string_view name) {
  return kNoiseSources.Find(name);
}

Eigen::Matrix3d TriadCalibration::MisalignmentRad() const {
  const Eigen::Vector3d scale = Scale();
  return scale.cwiseInverse().asDiagonal() * BySensingAxes() - Eigen::Matrix3d::Identity();
}

}  // namespace truetriad
