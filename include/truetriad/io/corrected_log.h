// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct CorrectedLogSummary {
  std::int64_t rows = 0;
  std::int64_t clamped_temperature = 0;  ///< Rows with a temperature outside the calibrated range.
  /// Rows in which a triad is empty because its correction needs a temperature or force that the
  /// log had not yet stated.
  std::int64_t not_corrected = 0;
  std::vector<Triad> left_out;  ///< Triads of the log that the calibration does not have.
  /// Mean length of the written readings, m/s^2, uT, rad/s; zero if none was written.
  PerTriad<double> mean_length{};
};

/// Corrects the readings of `source` by `calibration` and writes them to a self-describing CSV in
/// true units (m/s^2, rad/s, uT). The file is written beside `path` and renamed when complete.
/// There is a row for each time at which some triad has a sample; fields of triads without a sample
/// stay empty. Triads without a calibration are left out (see the summary). Thermal terms are
/// evaluated at the row's temperature, clamped to the calibrated range. If they depend on the rate
/// of the temperature or on a lag, the temperature is filtered row by row (model/thermal.h). Error:
/// no triad can be corrected, the calibration is not usable, a unit does not fit, a temperature
/// column or accelerometer that the calibration needs is missing, a row is bad, or `stop`, which is
/// called repeatedly, returned true. After an error no file is left.
Result<CorrectedLogSummary> WriteCorrectedLog(SampleSource& source,
                                              const Calibration& calibration,
                                              const std::string& path,
                                              const ProgressCallback& progress = {},
                                              const std::function<bool()>& stop = {});

}  // namespace truetriad
