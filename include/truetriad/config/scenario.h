// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/sim/scenario.h"

namespace truetriad {

/// Reads a scenario (`scenario: 1`), docs/simulation.md; quantities come in the units of data
/// sheets and leave in those of sim/scenario.h.
///
/// `base:` names a scenario that holds for everything this one does not say; lists (motion,
/// disturbances) replace those of the base as a whole. `overrides` are `key.sub=value` pairs (the
/// `--set` flag), the value in YAML flow style, read on top of both. Paths are relative to the file
/// that names them, in overrides to `path`.
/// Errors (bad input), all of them at once: unknown and duplicate keys, wrong types and values out
/// of range, with file:line or the override; a quantity stated in two units; what the values
/// contradict each other in.
Result<Scenario> ReadScenario(const std::string& path,
                              const std::vector<std::string>& overrides = {});

/// The same of a scenario that would be at `path`.
Result<Scenario> ReadScenarioText(const std::string& text,
                                  const std::string& path,
                                  const std::vector<std::string>& overrides = {});

}  // namespace truetriad
