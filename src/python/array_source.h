// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/sample_source.h"

namespace truetriad::python {

/// The readings of one triad, in their order.
struct ArrayStream {
  Triad triad = Triad::kAccelerometer;
  Unit unit;
  std::vector<std::int64_t> time_ns;     ///< Empty: rows without times.
  std::vector<double> x, y, z;           ///< Raw.
  std::vector<double> temperature_degc;  ///< Empty, or as long as x; NaN: not known.
  std::vector<std::int32_t> pose;        ///< Empty, or as long as x.
  std::vector<std::int64_t> row;         ///< Index in the given arrays.

  std::size_t size() const { return x.size(); }
};

/// A recording in memory.
struct ArrayRecording {
  std::string name;  ///< The name that messages and results state in place of a file name.
  std::string serial;
  std::vector<ArrayStream> streams;  ///< At most one per triad.
  bool has_time = true;

  /// Drops rows without a reading. Error (bad input): no stream, streams with and without time, an
  /// infinite reading, decreasing times.
  Status Settle();
};

/// A source that streams the recording once from its beginning.
std::unique_ptr<SampleSource> OpenArrays(std::shared_ptr<const ArrayRecording> recording);

}  // namespace truetriad::python
