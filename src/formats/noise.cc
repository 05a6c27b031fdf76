// SPDX-License-Identifier: Apache-2.0
#include "formats/noise.h"

#include <cmath>
#include <string>

namespace truetriad {

double NoiseDensities::white_rms() const { return white.norm() / std::sqrt(3.0); }
double NoiseDensities::random_walk_rms() const { return random_walk.norm() / std::sqrt(3.0); }

Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad) {
  using Found = std::optional<NoiseDensities>;
  const AllanTriad* const found = options.allan ? options.allan->Find(triad) : nullptr;
  if (found == nullptr) return Found();
  if (found->unit.is_counts && !found->si_per_count) {
    return Error(ErrorCode::kCountsOfUnknownSize,
                 "the Allan deviation of the " + std::string(TriadName(triad)) +
                     " is in counts of unknown size; state `si_per_count:` in the recording's "
                     "manifest and run `allan` again");
  }
  const double truth_per_raw =
      found->unit.is_counts ? *found->si_per_count : found->unit.truth_per_raw;
  NoiseDensities noise;
  noise.rate_hz = found->rate_hz;
  for (int axis = 0; axis < 3; ++axis) {
    const AllanAxis& item = found->axes[static_cast<std::size_t>(axis)];
    if (!item.white_density || !item.random_walk) return Found();
    noise.white[axis] = truth_per_raw * item.white_density->value;
    noise.random_walk[axis] = truth_per_raw * item.random_walk->value;
  }
  return Found(noise);
}

}  // namespace truetriad
