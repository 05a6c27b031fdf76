// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/documents.h"
#include "config/fields.h"
#include "truetriad/config/experiment.h"

namespace truetriad {

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
  Experiment experiment;  ///< Its files are named as they are written.
  PerTriad<std::optional<StatedMounting>> mounting;
  Stated gravity_mps2, strength_ut, dip_deg;
  FieldSite field_site = FieldSite::kUnknown;
  std::optional<StatedEarthRate> earth_rate;
  std::optional<Gauge> gauge;
  Places given;  ///< All keys that any document or preset has, and those that were settled.
};

/// The fields of a sensor's block. `chosen` has the models and terms that took the place of `auto`.
template <typename Visit>
void SensorFields(Visit& visit, Triad triad, ExperimentDraft& draft, CalibrateOptions& chosen);

/// The fields of the `plan:` block.
void PlanFields(FieldReader& visit, PlanConfig* plan);

/// The sensor is not calibrated, and what is said of its limits falls away.
void LeaveOut(Triad triad, CalibrateOptions* options);

/// Reads one document, or the block of a sensor, on top of what the draft holds.
void ReadDocument(YamlReader root, ExperimentDraft* draft);
void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft);

/// Reads the limits of a preset, which are judged where there is such a value.
void ReadLimitsOfPreset(YamlReader limits, LimitOptions* options);

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
