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
  bool resumes = false;  ///< Skips logs unchanged since a run by this experiment and program.
  /// If true, a failure of the store or the machine is no error: the work is tried again at growing
  /// intervals until it succeeds, as a watch over days needs.
  bool is_patient = false;
  std::vector<std::string> worker_command;
  /// Called before each unit with the station that is stated for this unit alone (empty: none).
  /// Returns why the unit may not start now; unset: it may. The function may be empty.
  std::function<Result<std::optional<std::string>>(const std::string& station)> hold;
};

/// Numbers of units. Each unit counts once, however often it was measured.
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
  std::optional<std::size_t> units;   ///< Units to calibrate, without skipped ones; unset: unknown.
  std::size_t skipped = 0;            ///< Number of logs skipped, since they have a run.
  std::set<std::string> skipped_red;  ///< Skipped units that are not good.
  std::size_t done = 0, red = 0;
  std::map<Verdict, std::size_t> verdicts;
  std::map<std::string, std::size_t> codes;  ///< Number of red runs (IsRed) by code.
  /// Runs that are good (not IsRed) but have warnings: their number, the first three of their units
  /// by name, and their number by the code of the warning.
  std::size_t warned = 0;
  std::set<std::string> warned_units;
  std::map<std::string, std::size_t> warnings;
  Yield yield;  ///< Of the units calibrated in this fleet run.
  /// Units that are not good although their last run is good, or the reverse. Each has the reason
  /// for its verdict: "FAIL by R. Roe (bent)".
  std::map<std::string, std::string> overruled;
  std::size_t held_back = 0;  ///< Number of good runs of units that are not good.
  /// Number of runs whose recording had a run in the store already, and the first three of their
  /// units by name, which do not depend on the order of the workers.
  std::size_t known_recordings = 0;
  std::set<std::string> known_units;
  std::set<std::string> unsafe;       ///< Units for which Agreement::IsUnsafe is true.
  double seconds = 0.0, cpu_s = 0.0;  ///< cpu_s: processor time of the workers.
  bool is_stopped = false;            ///< Stopped before all units were done.
  std::string held;                   ///< How many logs wait, and why (FleetOptions::hold).
  std::size_t left = 0;               ///< Number of logs left out as incomplete.
  Findings warnings_said;             ///< The warnings of FleetListener::on_warning.

  /// Runs that are not good, or whose unit is not good in the end.
  std::size_t NotGood() const { return red + held_back; }
  /// Whether all runs and all units, skipped ones included, are good, and no log was left out.
  bool IsGood() const {
    return red == 0 && yield.final_good == yield.units && skipped_red.empty() && left == 0;
  }
  /// Runs per second; 0 before the first run.
  double Rate() const { return seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0; }
  /// Time until all units are done at this rate, s; unset if unknown.
  std::optional<double> SecondsLeft() const;
};

/// Callbacks for progress; each may be empty.
struct FleetListener {
  std::function<void(const UnitRun&, const FleetProgress&)> on_run;  ///< A run is now in the store.
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
  /// Tells the source that the run of a returned unit failed for a reason outside the unit, such as
  /// a full disk. In a patient fleet run (FleetOptions), the source returns this unit again.
  virtual void Again(const UnitRun& /*run*/) {}
  /// The number of returned units that are not finished.
  virtual std::size_t Given() const { return 0; }
  /// Whether no unit has come for so long that none is expected.
  virtual bool IsQuiet() const { return false; }
  /// At the end: one line for each log that was seen but not returned, with the reason.
  virtual std::vector<std::string> Left() const { return {}; }
  /// The number of logs skipped because they have a run already, and whether `log` is one.
  virtual std::size_t Skipped() const { return 0; }
  virtual bool HasSkipped(const std::string& /*log*/) const { return false; }
};

/// Options of a watch.
struct WatchOptions {
  std::string folder = {};
  std::string without = {};         ///< A folder that is not searched; or empty.
  std::string serial_pattern = {};  ///< As for ListUnits.
  /// Interval between looks; unset: 1 s, or 5 s on a file system that does not report who writes to
  /// a file. It is at least 20 times the duration of the last look.
  std::optional<double> look_s = {};
  /// Idle time after which the watch ends; before that, a recording.yaml whose files are still
  /// missing is returned as it is.
  std::optional<double> until_idle_s = {};
};

/// Opens a source of the logs in a folder and its subfolders that have no run, and of new logs as
/// they arrive. A changed log is returned again. Memory holds the waiting logs and a few numbers
/// for each finished log.
///
/// A log is returned when two looks found it unchanged and no process writes to it. For a
/// recording.yaml, this must also hold for all files that it names. Until the first table of a
/// folder is returned, all its tables must be unchanged, since a recording.yaml may follow. Error
/// (bad input): the folder or a subfolder cannot be read. Error (usage): the pattern is invalid.
Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell);
/// Why no unit may be calibrated at a station: one of its golden units is kDisagrees or kToCome, or
/// none is kGood (GoldenStateOf; overdue after `age_s`). Unset: calibration may proceed. Error: the
/// store cannot be read.
Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s);

/// Calibrates `units` in worker processes, and adds every run to `store` after its files are on
/// disk. If logs of different units have the same readings, all these units are refused, since it
/// is unknown which of them was measured. No further unit is started once `is_stopped` returns
/// true. Error (bad input): the store or the workers fail; finished runs are in the store.
Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped);

/// As RunFleet for the logs of a folder: first for those without a run of this experiment and
/// program, then for those that arrive. Ends when `is_stopped` returns true, or after the idle time
/// in `watched`. Errors as OpenLogWatch.
Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
