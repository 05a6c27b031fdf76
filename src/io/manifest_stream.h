// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "io/csv_reader.h"
#include "io/field_schema.h"
#include "io/recording_layout.h"
#include "truetriad/base/triad.h"

namespace truetriad {

/// A column as a manifest names it, and the YAML value with this name.
struct ColumnReference {
  std::string text;                  ///< A header name or a 0-based index.
  std::optional<YamlReader> stated;  ///< The value; unset if the caller names the column.
};

/// A triad as a manifest or a mapping describes it.
struct ManifestStream {
  StreamLayout layout;  ///< The indices of its columns are not set yet.
  CsvLayout csv;
  std::optional<YamlReader> stated;
  std::optional<ColumnReference> time;
  std::array<ColumnReference, 3> axes;
  std::optional<ColumnReference> temperature, ambient;
};

/// Passes all keys of a stream except `file` to `visit`.
template <typename Visit>
void StreamFields(Visit& visit, Triad triad, ManifestStream& stream);

}  // namespace truetriad
