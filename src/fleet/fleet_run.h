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

/// How a fleet is calibrated.
struct FleetOptions {
  WorkPlan plan;
  int jobs = 1;
  UnitLimits limits;
  bool resumes = false;  ///< Leaves out what has a run of the same log, experiment and program.
  /// A store or a machine that fails is tried again, ever more rarely, until it works: for a watch
  /// of days. Else that is an error.
  bool is_patient = false;
  std::vector<std::string> worker_command;
  /// Asked before each unit, with the station that is stated for it alone, if one is: why it may
  /// not be begun now; unset: it may. May be empty.
  std::function<Result<std::optional<std::string>>(const std::string& station)> hold;
};

/// How many units are good, each counted once however often it was measured.
struct Yield {
  std::size_t units = 0;
  std::size_t first_good = 0;  ///< By their first run ever.
  std::size_t final_good = 0;  ///< By the run that counts, or what somebody has decided.

  double FirstPercent() const { return Percent(first_good); }
  double FinalPercent() const { return Percent(final_good); }

 private:
  double Percent(std::size_t good) const {
    return 100.0 * static_cast<double>(good) / static_cast<double>(units);
  }
};

/// What has become of it so far.
struct FleetProgress {
  std::optional<std::size_t> units;   ///< To be calibrated, without those left out; unset: unknown.
  std::size_t skipped = 0;            ///< Left out: their run is there.
  std::set<std::string> skipped_red;  ///< Units of those, that were not run now and are not good.
  std::size_t done = 0, red = 0;
  std::map<Verdict, std::size_t> verdicts;
  std::map<std::string, std::size_t> codes;  ///< Of red ones.
  /// Of the others, how many have warnings, some of these units (as known_units), and how many
  /// which.
  std::size_t warned = 0;
  std::set<std::string> warned_units;
  std::map<std::string, std::size_t> warnings;
  Yield yield;  ///< Of these units.
  /// Units of which another run than that of now, or a person, says whether they are good, and why:
  /// "FAIL by R. Roe (bent)".
  std::map<std::string, std::string> overruled;
  std::size_t held_back = 0;  ///< Runs of now that are good, of units that are not in the end.
  /// Runs of recordings that had one in the store before, and some units of theirs: those that come
  /// first by name, whichever worker is done first.
  std::size_t known_recordings = 0;
  std::set<std::string> known_units;
  std::set<std::string> unsafe;       ///< Units of which Agreement::IsUnsafe.
  double seconds = 0.0, cpu_s = 0.0;  ///< The workers' processor time.
  bool is_stopped = false;            ///< Before all were done.
  std::string held;                   ///< Why units that had come wait, by FleetOptions::hold.
  std::size_t left = 0;               ///< Logs that were seen and are not whole.
  Findings warnings_said;             ///< Of FleetListener::on_warning.

  /// Runs of now that are not good, or whose unit is not in the end.
  std::size_t NotGood() const { return red + held_back; }
  /// Whether all runs are good, and all units in the end, those left out, too, and none is left.
  bool IsGood() const {
    return red == 0 && yield.final_good == yield.units && skipped_red.empty() && left == 0;
  }
  /// Units a second; 0 before the first.
  double Rate() const { return seconds > 0.0 ? static_cast<double>(done) / seconds : 0.0; }
  /// Until all are done at this rate, s; unset where that is not known.
  std::optional<double> SecondsLeft() const;
};

/// Who is told of it; each may be empty.
struct FleetListener {
  std::function<void(const UnitRun&, const FleetProgress&)> on_run;  ///< Once it is in the store.
  std::function<void(const std::string&)> on_note;     ///< How the work goes, one line.
  std::function<void(const std::string&)> on_warning;  ///< What became of a unit, likewise.
};

/// A unit to be calibrated, or why it cannot be.
struct Arrival {
  UnitOrder order;
  std::optional<Error> refusal = {};
};

/// Where units come from.
class OrderSource {
 public:
  virtual ~OrderSource() = default;
  /// Looks for what has come; called several times a second. Error (bad input): it can no longer.
  virtual Status Look() { return {}; }
  /// The next unit; unset: none for now.
  virtual std::optional<Arrival> Next() = 0;
  /// There will not be another.
  virtual bool HasEnded() const = 0;
  /// The run of a unit that was given is in the store.
  virtual void Finish(const UnitRun& /*run*/) {}
  /// The run of a unit that was given came to nothing through no fault of its own; where the
  /// options have patience.
  virtual void Again(const UnitRun& /*run*/) {}
  /// How many units were given and are not finished.
  virtual std::size_t Given() const { return 0; }
  /// Nothing has come for so long that no other unit will.
  virtual bool IsQuiet() const { return false; }
  /// At the end, what people should know of units that were seen and not given: a line each.
  virtual std::vector<std::string> Left() const { return {}; }
  /// How many logs were not given since they have a run of before, and whether this is one.
  virtual std::size_t Skipped() const { return 0; }
  virtual bool HasSkipped(const std::string& /*log*/) const { return false; }
};

/// What is watched, and how.
struct WatchOptions {
  std::string folder = {};
  std::string without = {};         ///< A folder whose files are results, no logs; or empty.
  std::string serial_pattern = {};  ///< As ListUnits.
  /// Between looks; unset: 1 s, or 5 s on a file system that does not say who writes to a file.
  /// Looks take at most a twentieth of the time, however large the folder is.
  std::optional<double> look_s = {};
  /// Ends when nothing has happened for so long; what is still incomplete is given as it is.
  std::optional<double> until_idle_s = {};
};

/// Logs of a folder and below as they arrive, and those that are there without a run; a log that
/// arrives again changed is given again. Keeps in memory what waits and a few numbers of each log
/// that is done.
///
/// A log is given when nobody writes to it and two looks have found it the same; a recording.yaml
/// when the same is true of all files that it names. In a folder that has not given a table yet the
/// whole folder must have stayed so, since a recording.yaml may follow.
/// Error (bad input): the folder or one below cannot be read. Error (usage): the serial pattern.
Result<std::unique_ptr<OrderSource>> OpenLogWatch(WatchOptions options,
                                                  DoneLogs done,
                                                  std::function<void(const std::string&)> tell);
/// Why no unit may be calibrated at a station, by the GoldenState of each of its golden units,
/// where a check of `age_s` is overdue: one disagrees or is of a time to come, or none is good.
/// Unset: it may. Error: of the store.
Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s);

/// Calibrates `units`, each in one of `jobs` processes, and adds every run to `store` once its
/// files are on the disk. Units of which one log has the readings of another's are refused, all of
/// them: who of them was measured is not known. Where `is_stopped` says so no further unit is
/// begun. Error (bad input): the store or the workers fail; what is done is in the store.
Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped);

/// As RunFleet, of logs as they arrive in a folder; first those that are there and have no run by
/// this experiment and program. Until `is_stopped`, or the options' idle time. Errors as
/// OpenLogWatch.
Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped);

}  // namespace truetriad::fleet
