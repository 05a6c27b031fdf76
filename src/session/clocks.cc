// SPDX-License-Identifier: Apache-2.0
#include "session/clocks.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/messages.h"
#include "data/clock_lags.h"
#include "verdict/checks/clock_offsets.h"

namespace truetriad {

PerTriad<std::optional<ClockLeft>> ClocksLeft(const PoseSet& poses,
                                              const Calibration& calibration,
                                              const PerTriad<std::optional<ClockLeft>>& taken_off) {
  PerTriad<std::optional<ClockLeft>> left;
  for (const Triad triad : kTriads) {
    if (poses.clock_lag_s[triad]) left[triad] = {*poses.clock_lag_s[triad], kClockLagSigmaS};
  }
  for (const ClockOffset& offset : calibration.quality.rests.clock_offsets) {
    const std::optional<ClockLeft>& off = taken_off[offset.triad];
    const bool is_rough = off && off->sigma_s >= kClockLagSigmaS;
    if (!is_rough && !IsNotable(offset, poses)) continue;
    left[offset.triad] = {offset.later_s, offset.sigma_s};
  }
  return left;
}

void SayClocksCorrected(const PerTriad<std::optional<ClockLeft>>& taken_off,
                        const Findings& earlier,
                        Triad reference,
                        Calibration* calibration) {
  for (const Triad triad : kTriads) {
    if (!taken_off[triad]) continue;
    ClockLeft clock = *taken_off[triad];
    for (const ClockOffset& offset : calibration->quality.rests.clock_offsets) {
      if (offset.triad == triad) clock.sigma_s = offset.sigma_s;
    }
    Finding finding = ClockCorrected(triad, clock.later_s, clock.sigma_s, reference);
    const auto said = std::find_if(earlier.begin(), earlier.end(), [&](const Finding& other) {
      return other.code == FindingCode::kClockOffset && other.sensor == triad;
    });
    if (said != earlier.end()) {
      finding.Shifting(said->Value("effect").value_or(0.0), Treatment::kCorrected);
    }
    calibration->findings.push_back(std::move(finding));
  }
}

}  // namespace truetriad
