// SPDX-License-Identifier: Apache-2.0
#include "formats/noise.h"

#include <cmath>
#include <string>

namespace truetriad {

namespace {

/// True units a raw one. Error: counts of unknown size.
Result<double> TruthPerRaw(const AllanTriad& found) {
  if (!found.unit.is_counts) return found.unit.truth_per_raw;
  if (found.si_per_count) return *found.si_per_count;
  return Error(ErrorCode::kCountsOfUnknownSize,
               "the Allan deviation of the " + std::string(TriadName(found.triad)) +
                   " is in counts of unknown size; state `si_per_count:` in the recording's "
                   "manifest and run `allan` again");
}

}  // namespace

double RmsOfAxes(const Eigen::Vector3d& density) { return density.norm() / std::sqrt(3.0); }

Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad) {
  using Found = std::optional<NoiseDensities>;
  const AllanTriad* const found = options.allan ? options.allan->Find(triad) : nullptr;
  if (found == nullptr) return Found();
  TRUETRIAD_ASSIGN_OR_RETURN(const double truth_per_raw, TruthPerRaw(*found));
  NoiseDensities noise;
  noise.rate_hz = found->rate_hz;
  noise.random_walk.emplace();
  for (int axis = 0; axis < 3; ++axis) {
    const AllanAxis& item = found->axes[static_cast<std::size_t>(axis)];
    if (!item.white_density) return Found();
    noise.white[axis] = truth_per_raw * item.white_density->value;
    if (!item.random_walk) noise.random_walk.reset();
    if (noise.random_walk) (*noise.random_walk)[axis] = truth_per_raw * item.random_walk->value;
  }
  return Found(noise);
}

}  // namespace truetriad
