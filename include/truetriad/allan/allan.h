// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/data/pose_collection.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/model/tags.h"

namespace truetriad {

/// A number with a 95 % confidence interval.
struct Interval {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};
inline Interval Scaled(const Interval& interval, double factor) {
  return {factor * interval.value, factor * interval.low, factor * interval.high};
}

/// One point of an Allan deviation.
struct AllanPoint {
  double tau_s = 0.0;
  Interval deviation;  ///< Raw unit.
  double degrees_of_freedom = 0.0;
  std::int64_t terms = 0;  ///< Number of second differences averaged.
};

/// The minimum of an Allan deviation and the flicker noise that follows from it: B = minimum /
/// 0.664, 0.664 = sqrt(2 ln 2 / pi). IEEE Std 952-1997, C.1.3.
struct BiasInstability {
  Interval coefficient;  ///< B, raw unit.
  Interval minimum;      ///< Minimum of the deviation curve, raw unit.
  double tau_s = 0.0;    ///< tau of the minimum.
  bool at_end = false;   ///< B is an upper bound: the deviation falls to the end, or shows white
                         ///< noise only.
};

/// The Allan deviation of one axis of one triad. Coefficients as in IEEE Std 952-1997, annex C,
/// with the reading, raw unit, as the rate:
///
///   sigma^2(tau) = 3 Q^2 / tau^2 + N^2 / tau + (2 ln 2 / pi) B^2 + K^2 tau / 3
struct AllanAxis {
  std::vector<AllanPoint> points;  ///< Ascending in tau.
  std::optional<Interval>
      white_density;  ///< N, raw unit / sqrt(Hz): the line of slope -1/2 at tau = 1 s.
  /// Range of tau over which N was fitted: the stated range or, without one, the range in which
  /// white noise prevails.
  std::optional<std::array<double, 2>> white_range_s;
  std::optional<BiasInstability> instability;
  std::optional<Interval>
      random_walk;  ///< K, raw unit / s / sqrt(Hz): the line of slope +1/2 at tau = 3 s.
  std::optional<Interval> quantisation;  ///< Q, raw unit * s: the line of slope -1 at sqrt(3) s.
};

struct AllanTriad {
  Triad triad = Triad::kAccelerometer;
  Unit unit;
  std::optional<double> si_per_count;  ///< True units per count, when the recording states it.
  double rate_hz = 0.0;
  std::int64_t samples = 0;
  double duration_s = 0.0;
  std::int64_t filled_samples = 0;  ///< Missing samples of short gaps, interpolated.
  std::int64_t breaks = 0;          ///< Longer gaps; no difference is formed across them.
  /// The evidence that the unit was not at rest; empty if it was at rest. A disturbed triad has
  /// curves, but no coefficients, which would describe the motion.
  std::string disturbance;
  std::array<AllanAxis, 3> axes;
  std::vector<std::string> warnings;

  bool at_rest() const { return disturbance.empty(); }
};

struct AllanResult {
  std::string source;
  std::string serial;
  Tags tags;  ///< The tags of the recording; an Allan file keeps only `firmware` and `device_ids`.
  std::vector<InputFile> inputs;
  std::vector<AllanTriad> triads;

  /// Whether every triad was at rest.
  bool at_rest() const {
    return std::all_of(
        triads.begin(), triads.end(), [](const AllanTriad& triad) { return triad.at_rest(); });
  }
  const AllanTriad* Find(Triad triad) const {
    for (const AllanTriad& item : triads) {
      if (item.triad == triad) return &item;
    }
    return nullptr;
  }
};

struct AllanOptions {
  /// The rate of a recording without times, Hz; 0 if the recording has times. Range: >= 0.
  double rate_hz = 0.0;
  /// Range of tau over which N is fitted, seconds; unset: as AllanAxis::white_range_s.
  std::optional<std::array<double, 2>> white_range_s;
};

/// The overlapping Allan deviation of every axis and the noises that the data show. Streams
/// `source` once; memory does not grow with the length of the log.
///
/// Up to ten missing samples in a row are filled by straight lines; no difference is formed across
/// longer gaps. A triad that was not at rest has no coefficients (AllanTriad::disturbance). Other
/// effects that may bias the result cause a warning: a clipped or dead axis, a temperature that
/// drifts, a curve that the four noises do not describe. Errors: no time and no rate, or a wrong
/// option (usage); malformed readings, a stuck sensor (bad input); fewer than 100 samples in the
/// longest stretch (not enough).
Result<AllanResult> AnalyseAllan(SampleSource& source,
                                 const AllanOptions& options = {},
                                 const ProgressCallback& progress = {});

}  // namespace truetriad
