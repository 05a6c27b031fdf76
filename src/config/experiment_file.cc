// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "config/documents.h"
#include "config/experiment_draft.h"
#include "io/yaml_reader.h"
#include "io/yaml_values.h"
#include "truetriad/config/experiment.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

using Draft = ExperimentDraft;

/// The experiment in the file `path`; if that file is a calibration, the experiment inside it.
Result<YamlReader> OpenExperiment(const std::string& path) {
  Result<YamlReader> root = YamlReader::FromFile(path);
  if (!root || !root->Child("format")) return root;
  TRUETRIAD_ASSIGN_OR_RETURN(const Calibration calibration, ReadCalibration(path));
  return YamlReader::FromText(calibration.config_yaml, path + " (config)");
}

/// Reads a preset: its format version under the key that `version` names, a description, and what
/// `read` reads.
void ReadPreset(const std::string& file,
                std::string_view version,
                const Draft& draft,
                std::vector<Error>* errors,
                const std::function<void(YamlReader*)>& read) {
  Result<YamlReader> preset = YamlReader::FromFile(Resolve(file, draft.experiment.path));
  if (!preset) {
    errors->push_back(preset.error());
    return;
  }
  int number = kVersion;
  ReadAs(FormatVersion(), preset->RequireChild(version), &number);
  preset->Child("description");
  read(&*preset);
  preset->RejectUnknown();
  errors->insert(errors->end(), preset->errors().begin(), preset->errors().end());
}

/// The limits of a preset without those that the experiment replaces. If the experiment limits a
/// quantity (`bias`), this replaces the preset's limits of all its components (`bias.x`). If it
/// limits one component, the preset's limit of the quantity stays for the other components. `own`:
/// full names of the experiment's keys.
std::map<std::string, Limit> LeftToPreset(const std::map<std::string, Limit>& preset,
                                          const Places& own) {
  // Whether the experiment limits `name` itself, not only components below it.
  const auto states = [&own](const std::string& name) {
    const std::string key = "limits." + name;
    const auto below = own.lower_bound(key + '.');
    const bool is_leaf = below == own.end() || !below->first.starts_with(key + '.');
    return own.contains(key) &&
           (is_leaf || own.contains(key + ".upper") || own.contains(key + ".lower"));
  };
  std::map<std::string, Limit> left;
  for (const auto& [name, limit] : preset) {
    std::vector<std::string> others, stated;
    for (const char* component :
         {"x", "y", "z", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"}) {
      const std::string one = name + '.' + component;
      if (!ParseLimitName(one)) continue;
      (states(one) ? stated : others).push_back(one);
    }
    if (!stated.empty()) {
      for (const std::string& one : others) left[one] = limit;
      continue;
    }
    const std::string of_all = name.substr(0, name.rfind('.'));
    if (!ParseLimitName(of_all) || !states(of_all)) left[name] = limit;
  }
  return left;
}

/// Adds the keys of a preset to draft->given. A key that is there already keeps its place.
void NotePreset(const YamlReader& block, const std::string& prefix, Draft* draft) {
  Places places;
  CollectPlaces(block, prefix, &places);
  draft->given.merge(places);
}

/// Reads at most one preset for each sensor, and one for the limits. If several documents name a
/// preset, the last one counts.
void ReadPresets(std::deque<YamlReader>& documents, Draft* draft, std::vector<Error>* errors) {
  for (const Triad triad : kTriads) {
    const std::string_view name = TriadName(triad);
    std::string file;
    for (YamlReader& document : documents) {
      document.Child("sensors").Child(name).Optional("preset", &file);
    }
    if (file.empty()) continue;
    ReadPreset(file, "sensor_preset", *draft, errors, [&](YamlReader* preset) {
      for (const Triad other : kTriads) preset->Child(TriadName(other));
      if (YamlReader sensor = preset->RequireChild(name)) {
        ReadSensor(sensor, triad, draft);
        NotePreset(sensor, "sensors.", draft);
      }
    });
  }
  std::string file;
  for (YamlReader& document : documents) document.Child("limits").Optional("preset", &file);
  if (file.empty()) return;
  ReadPreset(file, "limits_preset", *draft, errors, [&](YamlReader* preset) {
    if (YamlReader limits = preset->RequireChild("limits")) {
      LimitOptions of_preset;
      ReadLimitsOfPreset(limits, &of_preset);
      of_preset.limits = LeftToPreset(of_preset.limits, draft->given);
      draft->experiment.options.limits = of_preset;
      NotePreset(limits, "", draft);
    }
  });
}

// The options for Validate, before the readings are known. The identity stands for each matrix that
// is set later: those stated as `identity`, and all matrices of a sweep.
CalibrateOptions AsSettled(const Experiment& experiment) {
  CalibrateOptions options = experiment.options;
  for (const Triad triad : kTriads) {
    if (experiment.fixed_identity[triad] || options.sweep) {
      options.triads[triad].fixed_sensitivity = Eigen::Matrix3d::Identity();
    }
  }
  return options;
}

/// Removes "." and "a/.." from a path, if the shorter path leads to the same file.
std::string ShortPath(const std::string& path) {
  const std::string shorter = std::filesystem::path(path).lexically_normal().string();
  std::error_code failure;
  return std::filesystem::equivalent(path, shorter, failure) ? shorter : path;
}

/// Puts the experiment's folder in front of the file names.
void ResolvePaths(Experiment* experiment) {
  for (std::string& input : experiment->inputs) {
    input = ShortPath(Resolve(input, experiment->path));
  }
  if (experiment->options.attitudes.kind != AttitudeKind::kGiven) experiment->attitudes_file = "";
  for (std::string* const file : FilesOf(*experiment)) *file = Resolve(*file, experiment->path);
  if (experiment->plan) {
    experiment->plan->program = Resolve(experiment->plan->program, experiment->path);
  }
}

Result<Experiment> ReadOpened(YamlReader main,
                              const std::string& path,
                              const std::vector<std::string>& overrides) {
  main.RequireChild("experiment");
  TRUETRIAD_ASSIGN_OR_RETURN(Documents documents, Documents::Of(main, overrides));
  std::vector<Error> errors;
  documents.CollectErrors(&errors);
  if (!errors.empty()) return Joined(errors);

  Draft draft;
  draft.experiment.path = path;
  draft.given = documents.AllPlaces();
  ReadPresets(documents.all(), &draft, &errors);
  for (const YamlReader& document : documents.all()) ReadDocument(document, &draft);
  documents.CollectErrors(&errors);
  if (errors.empty()) Settle(&draft, &errors);
  if (!errors.empty()) return Joined(errors);
  if (const Status valid = AsSettled(draft.experiment).Validate(); !valid) {
    const Error& error = valid.error();
    return ErrorAtKey(draft, ErrorCode::kConflictingKeys, error.key, error.message);
  }
  Experiment experiment = draft.experiment;
  ResolvePaths(&experiment);
  experiment.resolved_yaml = ResolvedYaml(draft, draft.experiment.options);
  experiment.draft = std::make_shared<const ExperimentDraft>(std::move(draft));
  return experiment;
}

}  // namespace

std::vector<std::string*> FilesOf(Experiment& experiment) {
  KnownMotionsConfig& motions = experiment.poses.known_motions;
  std::vector<std::string*> files = {&experiment.poses.file,
                                     &experiment.attitudes_file,
                                     &experiment.static_file,
                                     &experiment.forces_file,
                                     &motions.turns_file,
                                     &motions.rates_file};
  for (std::string& file : experiment.allan_files) files.push_back(&file);
  return files;
}

Error ErrorAtKey(const ExperimentDraft& draft,
                 ErrorCode code,
                 const std::string& key,
                 const std::string& message) {
  const std::string place = PlaceOf(key, draft.given);
  return ErrorIn(code, place.empty() ? draft.experiment.path : place, message).About(key);
}

Result<Experiment> ReadExperiment(const std::string& path,
                                  const std::vector<std::string>& overrides) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader main, OpenExperiment(path));
  return ReadOpened(std::move(main), path, overrides);
}

Result<Experiment> ReadExperimentText(const std::string& text,
                                      const std::string& path,
                                      const std::vector<std::string>& overrides) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader main, YamlReader::FromText(text, path));
  return ReadOpened(std::move(main), path, overrides);
}

namespace {

// Writes the resolved YAML again, after options, the kind of poses or time offsets were changed.
Experiment ResolvedAgain(Experiment changed) {
  if (changed.draft == nullptr) return changed;
  ExperimentDraft draft = *changed.draft;
  draft.experiment.options = changed.options;
  PosesConfig& poses = draft.experiment.poses;  // Its file names stay as written.
  poses.kind = changed.poses.kind;
  poses.given = changed.poses.given;
  poses.time_offset_s = changed.poses.time_offset_s;
  for (const Triad triad : kTriads) {  // An offset must not be marked as default.
    draft.given.emplace("sensors." + std::string(TriadName(triad)) + ".time_offset_s", "");
  }
  changed.resolved_yaml = ResolvedYaml(draft, changed.options);
  changed.draft = std::make_shared<const ExperimentDraft>(std::move(draft));
  return changed;
}

}  // namespace

Experiment WithTimeOffsets(const Experiment& experiment, const PerTriad<double>& offset_s) {
  Experiment changed = experiment;
  changed.poses.time_offset_s = offset_s;
  return ResolvedAgain(std::move(changed));
}

Experiment WithPoses(const Experiment& experiment, PoseSelectionKind kind) {
  Experiment changed = experiment;
  changed.poses.kind = kind;
  changed.poses.given = true;
  changed.options.motion.reset();
  if (kind == PoseSelectionKind::kMotion) {
    changed.options.motion = MotionOptions{changed.poses.motion_spacing_s};
  }
  return ResolvedAgain(std::move(changed));
}

Experiment OfSensors(const Experiment& experiment, const PerTriad<bool>& recorded) {
  Experiment changed = experiment;
  for (const Triad triad : kTriads) {
    if (!recorded[triad]) LeaveOut(triad, &changed.options);
  }
  const bool is_turned = recorded[Triad::kAccelerometer] || recorded[Triad::kMagnetometer];
  if (changed.options.motion && !(recorded[Triad::kGyroscope] && is_turned)) {
    // A fit to motion needs the gyroscope and gravity or field. Without them, rests are detected.
    changed.options.motion.reset();
    changed.poses.kind = PoseSelectionKind::kDetect;
  }
  return ResolvedAgain(std::move(changed));
}

Error AtItsKey(const Experiment& experiment, const Error& error) {
  if (error.kind() != ErrorKind::kUsage || experiment.draft == nullptr) return error;
  return ErrorAtKey(*experiment.draft, error.code, error.key, error.message);
}

std::string ResolvedWithChoice(const Experiment& experiment, const CalibrateOptions& chosen) {
  return ResolvedYaml(*experiment.draft, chosen);
}

}  // namespace truetriad
