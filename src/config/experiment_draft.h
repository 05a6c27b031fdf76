// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/documents.h"
#include "config/fields.h"
#include "truetriad/config/experiment.h"

namespace truetriad {

/// `earth_rate:`, in degrees.
struct StatedEarthRate {
  std::optional<double> latitude;     ///< Unset: that of `position`.
  std::optional<double> declination;  ///< Unset: that of the Earth's field at `position`, or zero.
};

/// `+y+x-z`; unset: `any`.
struct StatedMounting {
  std::optional<Eigen::Matrix3d> map;
};

/// The state while documents are read. Each document (preset, experiment, override) is read after
/// those before it, so that a later one changes only the keys that it has.
struct ExperimentDraft {
  Experiment experiment;  ///< Its file names are as written.
  PerTriad<std::optional<StatedMounting>> mounting;
  Stated gravity_mps2, strength_ut, dip_deg;
  FieldSite field_site = FieldSite::kUnknown;
  std::optional<StatedEarthRate> earth_rate;
  std::optional<Gauge> gauge;
  Places given;  ///< All keys of the documents and presets, and those that were settled.
};

/// The fields of a sensor's block. `chosen` has the models and terms that replaced `auto`.
template <typename Visit>
void SensorFields(Visit& visit, Triad triad, ExperimentDraft& draft, CalibrateOptions& chosen);

/// The fields of the `plan:` block.
void PlanFields(FieldReader& visit, PlanConfig* plan);

/// Disables a sensor and removes its limits.
void LeaveOut(Triad triad, CalibrateOptions* options);

/// Reads one document, or the block of a sensor, into the draft.
void ReadDocument(YamlReader root, ExperimentDraft* draft);
void ReadSensor(YamlReader reader, Triad triad, ExperimentDraft* draft);

/// Reads the limits of a preset, which are judged where a calibration has such a value.
void ReadLimitsOfPreset(YamlReader limits, LimitOptions* options);

/// An error at the line of a key, or in the experiment as a whole where no line has the key.
Error ErrorAtKey(const ExperimentDraft& draft,
                 ErrorCode code,
                 const std::string& key,
                 const std::string& message);

/// Sets options that depend on several keys; adds contradictions to `errors`.
void Settle(ExperimentDraft* draft, std::vector<Error>* errors);

/// The experiment with every default written out and marked; it reads back with the same options.
/// Models and terms that `chosen` has in place of `auto` are written and marked, too.
std::string ResolvedYaml(const ExperimentDraft& draft, const CalibrateOptions& chosen);

}  // namespace truetriad
