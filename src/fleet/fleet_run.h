// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fleet/log_files.h"
#include "fleet/store.h"
#include "fleet/unit_run.h"
#include "fleet/unit_work.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// Options of a fleet run.
struct FleetOptions {
  WorkPlan plan;
  int jobs = 1;
  UnitLimits limits;
  bool resumes = false;  ///< Skips unchanged logs with a run by this experiment and program.
  /// A failing store or machine is retried at growing intervals until it works, for a watch over
  /// days. Otherwise a failure is an error.
  bool is_patient = false;
  std::vector<std::string> worker_command;
  /// Called before each unit with the station stated for that unit alone, if any; returns the
  /// reason why the unit may not start now, unset if it may. May be empty.
  std::function<Result<std::optional<std::string>>(const std::string& station)> hold;
};

/// The number of good units; each counts once however often it was measured.
struct Yield {
  std::size_t units = 0;
  std::size_t first_good = 0;  ///< Good by their first run.
  std::size_t final_good = 0;  ///< Good by the current run or a person's decision.

  double FirstPercent() const { return Percent(first_good); }
  double FinalPercent() const { return Percent(final_good); }

 private:
  double Percent(std::size_t good) const {
    return 100.0 * static_cast<double>(good) / static_cast<double>(units);
  }
};

/// The state of a fleet run.
struct FleetProgress {
  std::optional<std::size_t> units;   ///< Units to calibrate without skipped ones; unset: unknown.
  std::size_t skipped = 0;            ///< Units skipped, since they have a run already.
  std::set<std::string> skipped_red;  ///< Skipped units that are not good.
  std::size_t done = 0, red = 0;
  std::map<Verdict, std::size_t> verdicts;
  std::map<std::string, std::size_t> codes;  ///< Number of red runs (IsRed) by code.
  /// Runs that are not red but have warnings, some of their units (chosen as known_units), and the
  /// number of these runs by warning.
  std::size_t warned = 0;
  std::set<std::string> warned_units;
  std::map<std::string, std::size_t> warnings;
  Yield yield;  ///< Of the units calibrated in this fleet run.
  /// Units whose verdict is set by an earlier run or a person, with the reason: "FAIL by R. Roe
  /// (bent)".
  std::map<std::string, std::string> overruled;
  std::size_t held_back = 0;  ///< Good runs of units that are not good in the end.
  /// Runs of recordings that already had a run in the store, and some of their units: the first by
  /// name, so that the order of the workers does not matter.
  std::size_t known_recordings = 0;
  std::set<std::string> known_units;
  std::set<std::string> unsafe;       ///< Units for which Agreement::IsUnsafe.
  double seconds = 0.0, cpu_s = 0.0;  ///< cpu_s: processor time of the workers.
  bool is_stopped = false;            ///< Stopped before all units were done.
  std::string held;                   ///< Why units wait, from FleetOptions::hold.
  std::size_t left = 0;               ///< Logs that were seen but are incomplete.
  Findings warnings_said;             ///< The warnings of FleetListener::on_warning.

  /// Runs that are not good, or whose unit is not good in the end.
  std::size_t NotGood() const { return red + held_back; }
  /// Whether all runs and all units, skipped ones included, are good, and no log is left.
  bool IsGood() const {
    return red == 0 && yield.final_good == yield.units && skipped_red.empty() && left == 0;
  }
  /// Units per second; 0 before the first.
  double Rate() const { return seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0; }
  /// Time until all units are done at this rate, s; unset if unknown.
  std::optional<double> SecondsLeft() const;
};

/// Callbacks for progress; each may be empty.
struct FleetListener {
  std::function<void(const UnitRun&, const FleetProgress&)> on_run;  ///< The run is in the store.
  std::function<void(const std::string&)> on_note;     ///< One line on the progress of the work.
  std::function<void(const std::string&)> on_warning;  ///< One line on a unit.
};

/// A unit to calibrate, or the error why it cannot be calibrated.
struct Arrival {
  UnitOrder order;
  std::optional<Error> refusal = {};
};

/// A source of units to calibrate.
class OrderSource {
 public:
  virtual ~OrderSource() = default;
  /// Looks for new units; called several times a second. Error (bad input): the source fails.
  virtual Status Look() { return {}; }
  /// Returns the next unit; unset: none at present.
  virtual std::optional<Arrival> Next() = 0;
  /// Whether there will be no further unit.
  virtual bool HasEnded() const = 0;
  /// Tells the source that the run of a returned unit is in the store.
  virtual void Finish(const UnitRun& /*run*/) {}
  /// Tells the source that the run of a returned unit failed for a reason outside the unit, which
  /// is to be returned again; called only if the options are patient.
  virtual void Again(const UnitRun& /*run*/) {}
  /// The number of returned units that are not finished.
  virtual std::size_t Given() const { return 0; }
  /// Whether no unit has come for so long that none is expected.
  virtual bool IsQuiet() const { return false; }
  /// At the end, one line for each problem with a log that was seen but not returned.
  virtual std::vector<std::string> Left() const { return {}; }
  /// The number of logs skipped because they have a run already, and whether `log` is one.
  virtual std::size_t Skipped() const { return 0; }
  virtual bool HasSkipped(const std::string& /*log*/) const { return false; }
};

/// Options of a watch.
struct WatchOptions {
  std::string folder = {};
  std::string without = {};         ///< A folder of results to exclude; or empty.
  std::string serial_pattern = {};  ///< As of ListUnits.
  /// Interval between looks; unset: 1 s, or 5 s on a file system that does not report writers.
  /// Looks take at most 1/20 of the time, however large the folder is.
  std::optional<double> look_s = {};
  /// Ends after this idle time; a recording.yaml that lacks files is then returned as it is.
  std::optional<double> until_idle_s = {};
};

/// Returns the logs of a folder and its subfolders that have no run, and new logs as they arrive; a
/// changed log is returned again. Memory holds the waiting logs and a few numbers for each finished
/// one.
///
/// A log is returned when no process writes to it and two looks found it unchanged; a
/// recording.yaml when the same holds for all files that it names. In a folder of which no table
/// was returned yet the whole folder must be unchanged, since a recording.yaml may follow. Error
/// (bad input): the folder or one below cannot be read. Error (usage): an invalid pattern.
Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell);
/// Why no unit may be calibrated at a station, from the GoldenState of each of its golden units
/// (overdue after `age_s`): one disagrees or is dated in the future, or none is good. Unset:
/// calibration may proceed. Error: of the store.
Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s);

/// Calibrates `units` in `jobs` processes, and adds every run to `store` after its files are on
/// disk. Units whose logs have the same readings are all refused, since it is unknown which of them
/// was measured. No further unit is started once `is_stopped` returns true. Error (bad input): the
/// store or the workers fail; finished runs are in the store.
Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped);

/// As RunFleet for logs that arrive in a folder; first for those already there without a run of
/// this experiment and program. Ends by `is_stopped` or the options' idle time. Errors as
/// OpenLogWatch.
Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
