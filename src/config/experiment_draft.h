// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/documents.h"
#include "config/fields.h"
#include "io/field_schema.h"
#include "truetriad/config/experiment.h"

namespace truetriad {

/// The angles under the key `earth_rate`, in degrees.
struct StatedEarthRate {
  std::optional<double> latitude;     ///< Unset: the latitude of `position`.
  std::optional<double> declination;  ///< Unset: that of the field at `position`, or 0.
};

/// A mounting that a document states, such as `+y+x-z`. For `any`, `map` is unset.
struct StatedMounting {
  std::optional<Eigen::Matrix3d> map;
};

/// The state of an experiment while its documents are read in turn: presets, the experiment's file,
/// overrides. Each document changes only the keys that it contains.
struct ExperimentDraft {
  Experiment experiment;  ///< File names are as written, without the experiment's folder.
  PerTriad<std::optional<StatedMounting>> mounting;
  Stated gravity_mps2, strength_ut, dip_deg;
  FieldSite field_site = FieldSite::kUnknown;
  std::optional<StatedEarthRate> earth_rate;
  std::optional<Gauge> gauge;
  Places given;  ///< Keys that documents or presets state, or that Settle fills in.
};

/// Passes each field of a sensor's block to `visit`, which reads it, writes it or describes it in a
/// schema. `chosen` has the models and terms that replaced `auto`.
template <typename Visit>
void SensorFields(Visit& visit, Triad triad, ExperimentDraft& draft, CalibrateOptions& chosen);

/// Passes each field of the `plan:` block to `visit`, which reads it or describes it in a schema.
void PlanFields(auto& visit, PlanConfig* plan);

/// Disables a sensor and removes its limits.
void LeaveOut(Triad triad, CalibrateOptions* options);

/// Reads one document, or the block of a sensor, into the draft.
void ReadDocument(YamlReader root, ExperimentDraft* draft);
void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft);

/// Reads the limits of a preset. Each limit applies only if the calibration has the value that it
/// limits.
void ReadLimitsOfPreset(YamlReader limits, LimitOptions* options);

/// Makes an error that points to the place of `key`, or to the experiment's file if `key` has no
/// place.
Error ErrorAtKey(const ExperimentDraft& draft,
                 ErrorCode code,
                 const std::string& key,
                 const std::string& message);

/// Sets the options that depend on several keys. Adds an error for each contradiction between keys.
void Settle(ExperimentDraft* draft, std::vector<Error>* errors);

/// Writes the experiment as YAML. Every default is written out and marked, so that reading the text
/// gives the same options. A model or term that `chosen` has in place of `auto` is written and
/// marked, too.
std::string ResolvedYaml(const ExperimentDraft& draft, const CalibrateOptions& chosen);

}  // namespace truetriad
