// SPDX-License-Identifier: Apache-2.0
#include "io/reading_corrector.h"

#include <string>

#include "model/corrected_error.h"

namespace truetriad {

Result<ReadingCorrector> ReadingCorrector::Create(const TriadCalibration& calibration,
                                                  const StreamInfo& stream) {
  const std::string name(TriadName(stream.triad));
  const Result<double> reading_per_raw =
      ReadingPerRaw(calibration, stream.triad, stream.unit, stream.si_per_count);
  if (!reading_per_raw) {
    return Error(reading_per_raw.error().code, {stream.file}, reading_per_raw.error().message);
  }
  if (calibration.thermal) {
    const ThermalTerms& thermal = *calibration.thermal;
    if (!stream.has_temperature) {
      return Error(ErrorCode::kMissingTemperature,
                   {stream.file},
                   "has no temperature, but the calibration of the " + name +
                       " depends on it; add a temperature column");
    }
    const bool tells_rate =
        thermal.rate_lag_s || thermal.element_lag_s || thermal.smoothing_s > 0.0;
    if (thermal.rate.any() && !tells_rate) {
      return Error(ErrorCode::kMissingTemperature,
                   "the calibration of the " + name +
                       " depends on the temperature rate, but does not state how to compute "
                       "it from a log; calibrate from a sweep (`poses: { sweep: auto }`), or "
                       "state `smoothing_s:` in the sensor's `thermal:`");
    }
  }
  return ReadingCorrector(calibration, 1.0 / *reading_per_raw);
}

}  // namespace truetriad
