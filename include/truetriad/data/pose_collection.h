// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/known_motion.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Where the poses of a recording come from.
enum class PoseSelectionKind {
  kDetect,    ///< Static detection finds them.
  kEveryRow,  ///< Each row is a pose (a pose table).
  kEveryN,    ///< Each block of `every` rows is a pose.
  kColumn,    ///< A column numbers them, 0 = moving.
  kRanges,    ///< Row ranges are given.
  kMotion,    ///< The unit never rests: no poses, all readings in PoseSet::tracks.
  kSweep,     ///< Few attitudes, held while the temperature changes: windows of time.
};

/// One given rest: rows first…last of the file, 0-based, last included.
struct PoseRange {
  std::int64_t first = 0;
  std::int64_t last = 0;
  std::string id;
  std::string face_up;
};

/// How a temperature sweep is cut into windows. At most one of the two lengths is set. If neither
/// is set, a window ends when the temperature has changed by 1/200 of its range, or 1/400 of the
/// recording has passed.
struct SweepWindows {
  double window_s = 0.0;            ///< Range: > 0; 0: not set.
  std::int64_t window_samples = 0;  ///< Of the leading sensor, per window. Range: >= 1; 0: not set.
  bool ambient = false;             ///< The ambient temperature is smoothed beside the unit's own.

  bool operator==(const SweepWindows&) const = default;
};

/// Readings with times in this range are left out before any other step.
struct ExcludedRange {
  TimeRange times;        ///< As stamped, both ends included.
  std::string stated_in;  ///< "experiment.yaml:12: exclude[0]", for messages.
};

/// How the times of readings follow from their stamps: `time:` of an experiment.
enum class TimeStamps {
  kAuto,       ///< Even if the stamps scatter about even times and readings do not contradict.
  kAsStamped,  ///< The stamps themselves.
  kRegular,    ///< Even between the gaps, whatever the stamps look like.
};

struct PoseSelection {
  PoseSelectionKind kind = PoseSelectionKind::kDetect;
  std::int64_t every = 0;  ///< Rows per pose, for kEveryN. Range: >= 1.
  /// For kRanges: the poses in file order. For kSweep: the intervals in which an attitude is held;
  /// intervals of one id are one attitude; no interval: one attitude all the time.
  std::vector<PoseRange> ranges;
  SweepWindows sweep;  ///< For kSweep.
  /// Keep the gyroscope's readings between the poses. Not possible without time.
  bool moves = false;
  /// The gyroscope gives no means in poses and no part in their detection, unless it is alone.
  bool ignores_gyroscope = false;
  /// Known turns and rates. A pose that overlaps a stated rate is no rest, and a move in which a
  /// rate was held is not used, so that its readings count once.
  std::vector<StatedTurn> turns;
  std::vector<StatedRate> rates;
  std::vector<ExcludedRange> excluded;
  TimeStamps time_stamps = TimeStamps::kAuto;
  /// By how much the times of each triad are later than the moments of its readings; it is
  /// subtracted before poses are sought. Needs times unless it is zero.
  PerTriad<double> time_offset_s{};

  bool Ignores(Triad triad) const { return ignores_gyroscope && triad == Triad::kGyroscope; }
};

/// How rests are found. The defaults need no tuning for any unit or rate.
struct StaticDetectorOptions {
  /// Shortest rest that counts, in seconds, after settling time is cut. Range: > 0.
  double min_duration_s = 1.0;
  /// A shorter disturbance does not split a rest if the attitude is the same before and after.
  double max_knock_s = 1.5;
  /// The gyroscope's turns between the rests are used; CollectPoses sets it.
  bool has_turns = false;
};

/// Called after each batch of blocks with the share of the work done, 0…1.
using ProgressCallback = std::function<void(double)>;

/// Streams `source` once and reduces it to poses: mean, covariance of the mean (correlated noise
/// allowed for), temperature, duration. Memory does not grow with the length of the log, but for
/// kMotion, which keeps every reading (32 bytes).
/// Error: malformed readings (stuck or clipped sensor everywhere, time going backwards) are bad
/// input; no rests is not-enough.
Result<PoseSet> CollectPoses(SampleSource& source,
                             const PoseSelection& selection,
                             const StaticDetectorOptions& options = {},
                             const ProgressCallback& progress = {});

/// Moves the poses at which a rate was held from set->poses to set->rates; for pose tables, which
/// CollectPoses does not read. Error (bad input): a rate stated by rows, or an unknown number.
Status TakeRates(const std::vector<StatedRate>& rates, PoseSet* set);

}  // namespace truetriad
