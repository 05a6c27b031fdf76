// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "truetriad/data/pose_collection.h"

namespace truetriad::fuzz {

/// Where poses are looked for: the mode by `mode` (of 8), what belongs to it by the bits of
/// `detail`.
inline PoseSelection SelectionOf(std::uint8_t mode, std::uint8_t detail) {
  PoseSelection selection;
  selection.kind = static_cast<PoseSelectionKind>(mode % 7);
  selection.every = 1 + detail % 32;
  if (selection.kind == PoseSelectionKind::kRanges ||
      (selection.kind == PoseSelectionKind::kSweep && detail % 2 == 1)) {
    const int length = 1 + detail % 16;
    for (int i = 0; i < 6; ++i) {
      const std::int64_t first = std::int64_t{2} * i * length;
      selection.ranges.push_back(
          {.first = first, .last = first + length - 1, .id = i < 3 ? "a" : "b", .face_up = ""});
    }
  }
  if (selection.kind == PoseSelectionKind::kSweep) {
    if (detail & 2U) selection.sweep.window_s = 0.25 * (1 + detail % 8);
    if (!(detail & 2U) && (detail & 4U)) selection.sweep.window_samples = 1 + detail % 8;
    selection.sweep.ambient = (detail & 8U) != 0;
  }
  selection.moves = (detail & 16U) != 0;
  if (mode & 8U) {
    StatedTurn turn;
    turn.at.rows = {.first = detail % 64, .last = detail % 64 + 10};
    turn.angle_rad = 6.0;
    turn.sigma_rad = turn.axis_sigma_rad = 0.01;
    selection.turns.push_back(turn);
  }
  if (mode & 16U) {
    StatedRate rate;
    rate.at.times = {.start_ns = 0, .end_ns = std::int64_t{detail} * 20'000'000};
    rate.rate_radps = {0.0, 0.0, 1.0};
    rate.covariance_radps2.setIdentity();
    selection.rates.push_back(rate);
  }
  if (mode & 32U)
    selection.excluded.push_back({{std::int64_t{detail} * 1'000'000, 2'000'000'000}, "here"});
  if (mode & 64U) selection.time_offset_s[Triad::kMagnetometer] = 0.001 * detail;
  selection.time_stamps = static_cast<TimeStamps>((detail >> 5U) % 3);
  return selection;
}

}  // namespace truetriad::fuzz
