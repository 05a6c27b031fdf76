// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "base/named_values.h"
#include "config/yaml_values.h"
#include "truetriad/config/experiment.h"

namespace truetriad {

inline auto Gauges() {
  return Named(GaugeName,
               std::array{Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric, Gauge::kFixture});
}
inline auto Models() {
  return Named(MatrixModelName,
               std::array{MatrixModel::kBias,
                          MatrixModel::kDiagonal,
                          MatrixModel::kSymmetric,
                          MatrixModel::kFull,
                          MatrixModel::kAuto});
}
/// Of the terms beyond bias and sensitivity.
inline auto WantedTerms() {
  return Named(WantedName, std::array{Wanted::kNo, Wanted::kYes, Wanted::kAuto});
}
inline auto NoiseSources() {
  return Named(NoiseSourceName, std::array{NoiseSource::kConfig, NoiseSource::kDatasheet});
}
inline auto ThermalMatrices() {
  return Named(ThermalMatrixName,
               std::array{ThermalMatrix::kFull, ThermalMatrix::kDiagonal, ThermalMatrix::kScale});
}
inline auto RegressionFactors() {
  return Named(RegressionFactorName,
               std::array{RegressionFactor::kReading,
                          RegressionFactor::kTemperature,
                          RegressionFactor::kRate,
                          RegressionFactor::kAmbient,
                          RegressionFactor::kAmbientRate});
}
inline auto RateTerms() {
  return Named(
      +[](RateTerm term) { return InfoOf(term).name(); },
      std::array{RateTerm::kLinear, RateTerm::kQuadratic, RateTerm::kCross});
}
constexpr NamedValues<AccelerometerSign, 2> kSigns = {{
    {AccelerometerSign::kSpecificForce, "specific_force"},
    {AccelerometerSign::kGravity, "gravity"},
}};
constexpr NamedValues<ExcessNoise, 2> kExcesses = {{
    {ExcessNoise::kNone, "none"},
    {ExcessNoise::kEstimate, "estimate"},
}};
constexpr NamedValues<bool, 2> kFixtureRotations = {{{false, "identity"}, {true, "unknown"}}};
constexpr NamedValues<bool, 2> kHemispheres = {{{true, "north"}, {false, "south"}}};
constexpr NamedValues<FieldSite, 2> kFieldSites = {{
    {FieldSite::kUnknown, "unknown"},
    {FieldSite::kClean, "clean"},
}};
constexpr NamedValues<bool, 2> kSessionBiases = {{{false, "shared"}, {true, "per_session"}}};
constexpr NamedValues<bool, 2> kRateAxes = {{{true, "known"}, {false, "unknown"}}};
constexpr NamedValues<bool, 2> kClocks = {{{true, "correct"}, {false, "as_stated"}}};
constexpr NamedValues<bool, 2> kUnitChecks = {{{true, "checked"}, {false, "trust"}}};
constexpr NamedValues<TimeStamps, 3> kTimeStamps = {{
    {TimeStamps::kAuto, "auto"},
    {TimeStamps::kAsStamped, "as_stamped"},
    {TimeStamps::kRegular, "regular"},
}};
constexpr NamedValues<bool, 2> kLosses = {{{true, "huber"}, {false, "none"}}};
constexpr NamedValues<InitialiseMethod, 5> kMethods = {{
    {InitialiseMethod::kAuto, "auto"},
    {InitialiseMethod::kSixFaceExtremes, "six-face-extremes"},
    {InitialiseMethod::kSixPosition, "six-position"},
    {InitialiseMethod::kEllipsoidAxisAligned, "ellipsoid-axis-aligned"},
    {InitialiseMethod::kEllipsoid, "ellipsoid"},
}};

/// Degrees.
struct StatedEarthRate {
  std::optional<double> latitude;     ///< Unset: that of `position`.
  std::optional<double> declination;  ///< Unset: that of the Earth's field at `position`, or zero.
};

/// `+y+x-z`; unset: `any`.
struct StatedMounting {
  std::optional<Eigen::Matrix3d> map;
};

/// What the documents have said so far. Each document (preset, experiment, override) is read on top
/// of those before it, so that a later one changes just what it names.
struct ExperimentDraft {
  Experiment experiment;
  std::vector<std::string> inputs;                     ///< As written.
  std::string forces_file, attitudes_file, pose_file;  ///< As written.
  std::string turns_file, rates_file, static_file;     ///< As written.
  KnownMotionsConfig known_motions;                    ///< Without the files.
  PerTriad<std::string> allan_files;                   ///< As written.
  PerTriad<double> time_offset_s{};
  PerTriad<std::optional<StatedMounting>> mounting;
  std::vector<ExcludedSeconds> exclude;
  TimeStamps time_stamps = TimeStamps::kAuto;
  Stated gravity_mps2, strength_ut, dip_deg;
  FieldSite field_site = FieldSite::kUnknown;
  std::optional<StatedEarthRate> earth_rate;
  std::optional<Gauge> gauge;
  std::map<std::string, std::string> places;  ///< Documents::Places().
  std::set<std::string> given;                ///< Full names of all keys that any document has.
};

/// Reads one document, or the block of a sensor, on top of what the draft holds.
void ReadDocument(YamlReader root, ExperimentDraft* draft);

/// Reads the limits of a preset, which are judged where there is such a value.
void ReadLimitsOfPreset(YamlReader limits, LimitOptions* options);
void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft);

/// At the line that states a key, or in the experiment as a whole where none does.
Error ErrorAtKey(const ExperimentDraft& draft,
                 ErrorCode code,
                 const std::string& key,
                 const std::string& message);

/// Settles what depends on several keys; adds to `errors` what contradicts itself.
void Settle(ExperimentDraft* draft, std::vector<Error>* errors);

/// The experiment with every default written out and marked; reads back with the same options.
/// Where `chosen` differs in what was `auto`, it has the models and terms of that, marked too.
std::string ResolvedYaml(const ExperimentDraft& draft, const CalibrateOptions& chosen);

}  // namespace truetriad
