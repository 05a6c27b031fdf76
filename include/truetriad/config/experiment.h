// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/estimation/calibrate.h"

namespace truetriad {

/// `poses:` of an experiment.
struct PosesConfig {
  /// Detect unless said; kRanges reads `file`.
  PoseSelectionKind kind = PoseSelectionKind::kDetect;
  bool given = false;       ///< The experiment has a `poses:` key (else a manifest's own is used).
  std::int64_t every = 0;
  std::string column;
  std::string file;         ///< Resolved against the experiment file.
};

/// One experiment YAML, resolved. interface.md "Experiment files".
struct Experiment {
  std::string path;
  std::string input;             ///< Resolved against the experiment file; empty when not given.
  std::string serial;
  std::string model;
  CalibrateOptions options;
  PosesConfig poses;
  std::string attitudes_file;    ///< `attitudes: {file: …}`, resolved; empty when not given.
  double attitudes_sigma_deg = 0.01;
  PerTriad<bool> fixed_identity{};     ///< `fixed: {matrix: identity}`.
  std::string forces_file;       ///< `initialise: {forces: …}`, resolved; empty when not given.
  std::string resolved_yaml;     ///< The experiment with every default written out.
};

/// Reads an experiment; `overrides` are `key.sub=value` pairs (the `--set` flag), applied before
/// checking. Unknown and duplicate keys and wrong types are errors with file:line.
Result<Experiment> ReadExperiment(const std::string& path,
                                  const std::vector<std::string>& overrides = {});

}  // namespace truetriad
