// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/documents.h"
#include "config/fields.h"
#include "io/field_schema.h"
#include "truetriad/config/experiment.h"

namespace truetriad {

/// What `earth_rate` states, in degrees.
struct StatedEarthRate {
  std::optional<double> latitude;     ///< Unset: the latitude of `position`.
  std::optional<double> declination;  ///< Unset: of the field at `position`; zero if unknown.
};

/// A stated mounting such as `+y+x-z`; for `any` it has no map.
struct StatedMounting {
  std::optional<Eigen::Matrix3d> map;
};

/// What the documents read so far state. Documents (presets, experiment, overrides) are read in
/// turn; each changes only the keys that it has.
struct ExperimentDraft {
  Experiment experiment;  ///< File names are as written, not yet relative to a folder.
  PerTriad<std::optional<StatedMounting>> mounting;
  Stated gravity_mps2, strength_ut, dip_deg;
  FieldSite field_site = FieldSite::kUnknown;
  std::optional<StatedEarthRate> earth_rate;
  std::optional<Gauge> gauge;
  Places given;  ///< Keys that documents or presets state, or that Settle fills in.
};

/// The fields of a sensor's block. `chosen` has the models and terms that replaced `auto`.
template <typename Visit>
void SensorFields(Visit& visit, Triad triad, ExperimentDraft& draft, CalibrateOptions& chosen);

/// The fields of the `plan:` block.
void PlanFields(auto& visit, PlanConfig* plan);

/// Disables a sensor and removes its limits.
void LeaveOut(Triad triad, CalibrateOptions* options);

/// Reads one document, or the block of a sensor, into the draft.
void ReadDocument(YamlReader root, ExperimentDraft* draft);
void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft);

/// Reads the limits of a preset. Such a limit is judged only if a calibration has the limited
/// value.
void ReadLimitsOfPreset(YamlReader limits, LimitOptions* options);

/// An error at the place that states `key`; if there is none, at the experiment as a whole.
Error ErrorAtKey(const ExperimentDraft& draft,
                 ErrorCode code,
                 const std::string& key,
                 const std::string& message);

/// Sets options that depend on several keys; adds contradictions to `errors`.
void Settle(ExperimentDraft* draft, std::vector<Error>* errors);

/// The experiment as YAML with every default written out and marked; it reads back with the same
/// options. Models and terms that `chosen` has in place of `auto` are written and marked, too.
std::string ResolvedYaml(const ExperimentDraft& draft, const CalibrateOptions& chosen);

}  // namespace truetriad
