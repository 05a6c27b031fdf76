// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/data/sample_source.h"
#include "truetriad/data/static_pose.h"

namespace truetriad {

/// Where the poses of a recording come from.
enum class PoseSelectionKind {
  kDetect,    ///< Static detection finds them.
  kEveryRow,  ///< Each row is a pose (a pose table).
  kEveryN,    ///< Each block of `every` rows is a pose.
  kColumn,    ///< A column holds the number of each row's pose; 0 while the unit moves.
  kRanges,    ///< Row ranges are given.
  kMotion,    ///< The unit never rests. There are no poses; PoseSet::tracks keeps all readings.
  kSweep,     ///< A temperature sweep in a few held attitudes: windows of time are poses.
};

/// One given rest: rows `first` to `last` of the file, counted from 0, both included.
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
  std::int64_t window_samples = 0;  ///< The leading sensor's. Range: >= 1; 0: not set.
  bool ambient = false;             ///< Whether the ambient temperature is smoothed as well.

  bool operator==(const SweepWindows&) const = default;
};

/// Readings with times in this range are left out before any other step.
struct ExcludedRange {
  TimeRange times;        ///< In the times of the log's stamps, both ends included.
  std::string stated_in;  ///< "experiment.yaml:12: exclude[0]", for messages.
};

/// How the times of readings are derived from their stamps; `time:` of an experiment selects this.
enum class TimeStamps {
  kAuto,       ///< Even times if the stamps scatter about even times, unless the readings fit the
               ///< stamps better.
  kAsStamped,  ///< The stamps themselves.
  kRegular,    ///< Even times between gaps, whatever the stamps look like.
};

struct PoseSelection {
  PoseSelectionKind kind = PoseSelectionKind::kDetect;
  std::int64_t every = 0;  ///< Rows per pose, for kEveryN. Range: >= 1.
  /// For kRanges: the poses in file order. For kSweep: the intervals in which an attitude is held.
  /// Intervals with one id have one attitude; without intervals, one attitude is held all the time.
  std::vector<PoseRange> ranges;
  SweepWindows sweep;  ///< For kSweep.
  /// Whether the gyroscope's readings between the poses are kept. This is not possible in a
  /// recording without times.
  bool moves = false;
  /// Whether poses are detected without the gyroscope and hold no means of its readings. Has no
  /// effect if the gyroscope is the only sensor.
  bool ignores_gyroscope = false;
  /// Known turns and rates. A pose that overlaps a stated rate is no rest. A move in which a rate
  /// was held is not used, so that no reading is used twice.
  std::vector<StatedTurn> turns;
  std::vector<StatedRate> rates;
  std::vector<ExcludedRange> excluded;
  TimeStamps time_stamps = TimeStamps::kAuto;
  /// By how much the stated times of each triad's readings are too late. The offset is subtracted
  /// before poses are sought. If it is not zero, the recording must have times.
  PerTriad<double> time_offset_s{};

  bool Ignores(Triad triad) const { return ignores_gyroscope && triad == Triad::kGyroscope; }
};

/// How rests are found. The defaults need no tuning for any unit or rate.
struct StaticDetectorOptions {
  /// Shortest duration of a rest, s, after its settling time is cut off. Range: > 0.
  double min_duration_s = 1.0;
  /// A shorter disturbance does not split a rest if the attitude is the same before and after.
  double max_knock_s = 1.5;
  /// Whether the gyroscope's turns between the rests are used; CollectPoses sets this.
  bool has_turns = false;
};

/// Called after each batch of blocks with the share of the work done, 0…1.
using ProgressCallback = std::function<void(double)>;

/// Reads `source` once and reduces it to poses: mean, covariance of the mean (including the effect
/// of correlated noise), temperature and duration. Memory does not grow with the length of the log,
/// except for kMotion, which keeps every reading (32 bytes each). Error (bad input): malformed
/// readings, such as a sensor that is stuck or clipped everywhere, or time that goes backwards.
/// Error (not enough): no rest.
Result<PoseSet> CollectPoses(SampleSource& source,
                             const PoseSelection& selection,
                             const StaticDetectorOptions& options = {},
                             const ProgressCallback& progress = {});

/// For pose tables, which CollectPoses does not read: moves the poses at which a rate was held from
/// set->poses to set->rates. Error (bad input): a rate is not stated for a pose of the table.
Status TakeRates(const std::vector<StatedRate>& rates, PoseSet* set);

/// Joins recordings of one unit, which was switched off in between, into one set. Poses are
/// numbered consecutively, the times of a session come after those of the session before, and no
/// move leads from one session to the next. Error (bad input): serials, sensors or units of
/// measurement differ, or only some of the recordings have times.
Result<PoseSet> JoinSessions(std::vector<PoseSet> sessions);

}  // namespace truetriad
