// SPDX-License-Identifier: Apache-2.0
#include "io/reading_corrector.h"

#include <string>

namespace truetriad {

Result<ReadingCorrector> ReadingCorrector::Create(const TriadCalibration& calibration,
                                                  const StreamInfo& stream) {
  const std::string name(TriadName(stream.triad));
  TRUETRIAD_ASSIGN_OR_RETURN(const Unit calibrated,
                             ParseTriadUnit(stream.triad, calibration.input_unit));
  if (calibrated.is_counts != stream.unit.is_counts) {
    return Error(ErrorCode::kUnitMismatch,
                 {stream.file},
                 "the " + name + " is in " + stream.unit.name + ", but it was calibrated in " +
                     calibrated.name + "; record it in the same unit");
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
  return ReadingCorrector(calibration, stream.unit.truth_per_raw / calibrated.truth_per_raw);
}

}  // namespace truetriad
