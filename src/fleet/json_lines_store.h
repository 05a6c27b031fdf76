// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "fleet/database.h"
#include "fleet/store.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// A store in one text file (json_lines.h): each run is a line, appended whole and flushed to the
/// disk. For one writer at a time, so that it does on a network folder where shards write a file
/// each. What a writer that was killed left of a line the next one takes away. Runs can be added
/// and read, but no questions asked, nor dispositions or station checks added. `Add` does not look
/// whether the run is there: it is a new one. Errors as OpenStore; error (bad input): another
/// process is writing to it.
Result<std::unique_ptr<Store>> OpenJsonLines(const std::string& path, Access access);

/// The file that a URL names: jsonl:PATH, or NAME.jsonl. Unset: another kind of store.
std::optional<std::string> JsonLinesPath(const std::string& url);

}  // namespace truetriad::fleet
