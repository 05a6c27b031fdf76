// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "truetriad/base/result.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct CorrectedLogSummary {
  std::int64_t rows = 0;
  std::int64_t clamped_temperature = 0;  ///< Rows corrected at an end of the calibrated range.
};

/// Streams `source` through `calibration` into a self-describing CSV in true units (m/s^2, rad/s,
/// uT), written beside `path` and renamed when whole. Triads without a calibration are left out
/// and named in an error unless at least one can be corrected.
Result<CorrectedLogSummary> WriteCorrectedLog(SampleSource& source,
                                              const Calibration& calibration,
                                              const std::string& path,
                                              const ProgressCallback& progress = {});

}  // namespace truetriad
