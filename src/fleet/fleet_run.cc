// SPDX-License-Identifier: Apache-2.0
#include "fleet/fleet_run.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <chrono>
#include <ctime>
#include <deque>
#include <exception>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>

#include "base/messages.h"
#include "fleet/json_lines.h"
#include "fleet/log_files.h"
#include "fleet/unit_folders.h"
#include "line/line_data.h"
#include "report/content.h"

namespace truetriad::fleet {
namespace {

std::string HoursText(double seconds) { return Format("%.4g h", seconds / 3600.0); }

}  // namespace

Result<std::optional<std::string>> GoldenHold(Store& store,
                                              const std::string& station,
                                              double age_s) {
  const std::string remedy =
      "; measure the golden unit and run check-station with --store and --tag=station=" + station;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<StationCheck> checks,
                             store.LastStationChecks(station));
  if (checks.empty()) {
    return std::optional("station " + station + " has no check of its golden unit" + remedy);
  }
  const auto last_check = [&station](const StationCheck& check) {
    return "station " + station + ": the last check of golden unit " + check.serial +
           ", recorded at " + check.recorded + ", ";
  };
  const auto now_s = static_cast<double>(std::time(nullptr));
  bool has_good = false;
  for (const StationCheck& check : checks) {
    const GoldenState state = GoldenStateOf(check, now_s, age_s);
    if (state == GoldenState::kDisagrees) {
      return std::optional(last_check(check) + "did not agree with the reference" + remedy +
                           "; if that golden unit is broken or retired, give the station "
                           "another name");
    }
    if (state == GoldenState::kToCome) {
      return std::optional(last_check(check) + "is " +
                           HoursText(line::SecondsOf(check.recorded) - now_s) +
                           " in the future: a clock is or was wrong" + remedy);
    }
    has_good = has_good || state == GoldenState::kGood;
  }
  if (has_good) return std::optional<std::string>();
  const double last_s = line::SecondsOf(checks.back().recorded);
  return std::optional(last_check(checks.back()) + "is " + HoursText(now_s - last_s) +
                       " old, but may be at most " + HoursText(age_s) + " old" + remedy);
}

std::optional<double> FleetProgress::SecondsLeft() const {
  const double rate = Rate();
  if (!units || !(rate > 0.0)) return std::nullopt;
  return static_cast<double>(*units - std::min(done, *units)) / rate;
}

namespace {

/// The error for a run whose log has the readings of another unit.
Error IsCopy(const UnitRun& run, const UnitRun& other, const std::string& remedy) {
  return Error(ErrorCode::kOtherDevice,
               {run.log},
               "has the same readings as " + other.log + " of unit `" + other.serial +
                   "`, but is stated to be of unit `" + run.serial +
                   "`: one log is a copy of the other, or one serial number is wrong; " + remedy);
}

/// The text quoted as one word for a shell.
std::string ShellWord(const std::string& text) {
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("_./:@+,=-").find(c) != std::string_view::npos;
  });
  if (is_plain && !text.empty()) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + '\'';
}

/// The command for a decision about a unit in the store of the plan.
std::string DisposeCommand(const std::string& serial,
                           const WorkPlan& plan,
                           const std::string& decision) {
  const std::string store = JsonLinesPath(plan.store_name) ? "STORE" : plan.store_name;
  return "`truetriad fleet dispose " + ShellWord(serial) + " --store=" + ShellWord(store) +
         " --who=NAME " + decision + '`';
}

/// Tells the user how `run` can be accepted although `other` has the same readings.
std::string RemedyOf(const UnitRun& run, const UnitRun& other, const WorkPlan& plan) {
  const bool is_lines = JsonLinesPath(plan.store_name).has_value();
  return std::string(
             "measure this unit again, or, if the other log has the wrong serial number, ") +
         (is_lines ? "collect the runs into a store and state this there by " : "state this by ") +
         DisposeCommand(other.serial,
                        plan,
                        "--verdict=FAIL --wrong-serial --run=" + ShellWord(other.id) +
                            " --why=" + ShellWord("is " + run.serial)) +
         " and run this log again";
}

/// Adds a serial number; keeps the first ones by name, so that the order of workers is irrelevant.
void NameSome(const std::string& serial, std::set<std::string>* some) {
  constexpr std::size_t kMostNamed = 3;  // More do not fit on a line.
  some->insert(serial);
  if (some->size() > kMostNamed) some->erase(std::prev(some->end()));
}

/// Calibrates units of a source in worker processes, and adds every run to a store after its files
/// are on disk.
class FleetEngine {
 public:
  FleetEngine(const FleetOptions& options,
              std::string config_sha256,
              OrderSource* source,
              Store* store,
              FleetListener listener)
      : options_(options),
        config_sha256_(std::move(config_sha256)),
        source_(source),
        store_(store),
        listener_(std::move(listener)),
        workers_(options.worker_command, options.plan, options.jobs, options.limits) {}

  /// Runs until the source has ended, or `is_stopped` is true and started units are done.
  /// `progress`: the initial state. Error (bad input): the store or the workers fail and
  /// FleetOptions::is_patient is false; finished runs are in the store.
  Result<FleetProgress> Run(FleetProgress progress, const std::function<bool()>& is_stopped) {
    constexpr double kLookS = 0.2;  // Longest delay before a new log or a stop is noticed.
    progress_ = std::move(progress);
    store_->TellNotes([this](const std::string& note) { Tell(note); });
    const auto no_longer = [](Store* store) { store->TellNotes({}); };
    const std::unique_ptr<Store, decltype(no_longer)> telling(store_, no_longer);
    const Clock::time_point begin = Clock::now();
    TRUETRIAD_RETURN_IF_ERROR(MakeUpForEarlier());
    const auto count_time = [&] {
      progress_.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    };
    for (;;) {
      const bool is_ending = is_stopped() || is_waiting_in_vain_;
      if (!is_ending) {
        TRUETRIAD_RETURN_IF_ERROR(source_->Look());
        TRUETRIAD_RETURN_IF_ERROR(GiveWork());
      }
      const bool is_done = is_ending || (source_->HasEnded() && !next_ && ended_.empty());
      if (!workers_.IsBusy() && is_done) break;
      TRUETRIAD_ASSIGN_OR_RETURN(std::vector<UnitRun> runs, workers_.Wait(kLookS));
      // Free workers get units before results are stored.
      if (!is_stopped()) TRUETRIAD_RETURN_IF_ERROR(GiveWork());
      const Status taken = Take(std::move(runs));
      count_time();
      TRUETRIAD_RETURN_IF_ERROR(Keep());
      TRUETRIAD_RETURN_IF_ERROR(taken);
    }
    if (!ended_.empty()) {  // The store has failed; this is the last attempt.
      store_retry_ = Retry();
      TRUETRIAD_RETURN_IF_ERROR(Keep());
      if (!ended_.empty()) {
        return Error(
            ErrorCode::kCannotWrite,
            std::to_string(ended_.size()) +
                " runs could not be stored, and the next start calibrates their logs again: " +
                store_retry_.why);
      }
    }
    for (const std::string& note : source_->Left()) {
      Tell(note);
      ++progress_.left;
    }
    if (next_ && is_held_) {
      progress_.held = Counted(source_->Given(), "log") + " not calibrated: " + hold_retry_.why;
    }
    count_time();
    progress_.is_stopped = next_.has_value() || !source_->HasEnded();
    return progress_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// The time of the next attempt after a failure.
  struct Retry {
    double wait_s = 0.0;  ///< 0: no failure.
    Clock::time_point at;
    std::string why;

    bool IsDue() const { return wait_s == 0.0 || Clock::now() >= at; }
  };

  Status GiveWork() {
    // While runs wait for the store, no unit is started.
    while (ended_.empty() && workers_.HasFree() && worker_retry_.IsDue() && disk_retry_.IsDue()) {
      if (!next_) next_ = source_->Next();
      if (!next_) return {};
      if (next_->refusal) {
        UnitRun run = RunOf(options_.plan, next_->order);
        Fill(*next_->refusal, &run);
        ended_.push_back(std::move(run));
        next_.reset();
        return {};
      }
      TRUETRIAD_ASSIGN_OR_RETURN(const bool may_begin, MayBegin());
      if (!may_begin) return {};
      const Status given = workers_.Give(next_->order);
      if (!given) return Failed(given.error(), &worker_retry_);
      worker_retry_ = Retry();
      next_.reset();
    }
    return {};
  }

  /// Whether the next unit may start. If not, the reason is reported once.
  Result<bool> MayBegin() {
    if (!options_.hold) return true;
    if (!hold_retry_.IsDue()) return false;
    const Result<std::optional<std::string>> why = options_.hold(next_->order.tags.station);
    if (!why && !options_.is_patient) return why.error();
    const std::string text = why ? why->value_or("") : why.error().message;
    if (text.empty()) {
      if (!hold_retry_.why.empty()) Tell("calibration continues");
      hold_retry_ = Retry();
      is_held_ = false;
      return true;
    }
    is_held_ = why.has_value();
    is_waiting_in_vain_ = is_held_ && source_->IsQuiet() && !workers_.IsBusy() && ended_.empty();
    if (text != hold_retry_.why) Tell("calibration waits: " + text);
    hold_retry_ = {.wait_s = 1.0, .at = Clock::now() + std::chrono::seconds(1), .why = text};
    return false;
  }

  /// Queues finished runs for the store, except runs whose files could not be written.
  Status Take(std::vector<UnitRun> runs) {
    Status status;
    for (UnitRun& run : runs) {
      if (run.code != InfoOf(ErrorCode::kCannotWrite).name) {
        if (!run.folder.empty()) disk_retry_ = Retry();
        ended_.push_back(std::move(run));
        continue;
      }
      // A full disk is no fault of the unit, so the unit is returned to the source.
      const Error error(ErrorCode::kCannotWrite, run.message);
      if (const Status failed = Failed(error, &disk_retry_); !failed) status = failed;
      source_->Again(run);
    }
    return status;
  }

  /// Adds queued runs to the store.
  Status Keep() {
    while (!ended_.empty() && store_retry_.IsDue()) {
      UnitRun& run = ended_.front();
      run.config_sha256 = config_sha256_;
      const Result<std::optional<Standing>> before = Add(&run);
      if (!before) return Failed(before.error(), &store_retry_);
      if (store_retry_.wait_s > 0.0) Tell("the store works again");
      store_retry_ = Retry();
      FinishFolder(run.folder);
      AgreeInFolders(run.serial);
      Count(run, *before);
      ended_.pop_front();
    }
    return {};
  }

  void Count(const UnitRun& run, const std::optional<Standing>& before) {
    source_->Finish(run);
    ++progress_.done;
    ++progress_.verdicts[run.verdict];
    progress_.cpu_s += run.cpu_s;
    if (IsRed(run.verdict)) {
      ++progress_.red;
      ++progress_.codes[run.code];
    } else {
      std::set<std::string> warnings;
      for (const Finding& finding : run.findings) {
        if (finding.severity == Severity::kWarning) {
          warnings.emplace(FindingCodeName(finding.code));
        }
      }
      if (!warnings.empty()) {
        ++progress_.warned;
        NameSome(run.serial, &progress_.warned_units);
      }
      for (const std::string& code : warnings) ++progress_.warnings[code];
    }
    CountYield(run, before);
    if (listener_.on_run) listener_.on_run(run, progress_);
  }

  /// Adds a run to the store; returns the unit's standing before it. If the clock has gone back
  /// since the last run of the unit or log, or a decision was made meanwhile, the run gets a later
  /// name.
  Result<std::optional<Standing>> Add(UnitRun* run) {
    TRUETRIAD_RETURN_IF_ERROR(RefuseCopy(run));
    TRUETRIAD_ASSIGN_OR_RETURN(const std::string latest, store_->LatestRun(*run));
    TRUETRIAD_ASSIGN_OR_RETURN(std::optional<Standing> before, store_->StandingOf(run->serial));
    // If two runs are concurrent, the one that started first may end last and keeps its name. If a
    // person decided meanwhile, without knowing this run, the run gets a later name.
    const bool is_decided = before && !before->disposed_by.empty();
    if (run->id < latest && (is_decided || NewRunId() < latest)) {
      const std::string id = NewRunIdAfter(latest);
      TRUETRIAD_RETURN_IF_ERROR(RenameFolder(id, &run->folder));
      run->id = id;
    }
    TRUETRIAD_RETURN_IF_ERROR(store_->Add(*run));
    return before;
  }

  /// If the run has the readings of another unit, turns it into a refused run without files.
  Status RefuseCopy(UnitRun* run) const {
    if (run->verdict == Verdict::kNoResult) return {};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<UnitRun> other, store_->RunOfSameReadings(*run));
    if (!other) return {};
    if (!run->folder.empty()) RemoveFolder(run->folder);
    run->folder.clear();
    run->parameters.clear();
    run->covariance.clear();
    run->judgements.clear();
    run->effective_dof = 0.0;
    run->mode.clear();
    Fill(IsCopy(*run, *other, RemedyOf(*run, *other, options_.plan)), run);
    return {};
  }

  /// Updates the yield with the present standing of the run's unit; `before`: as returned by Add.
  void CountYield(const UnitRun& run, const std::optional<Standing>& before) {
    const Result<std::optional<Standing>> standing = store_->StandingOf(run.serial);
    if (!standing || !*standing) return;  // The store fails.
    const Standing& unit = **standing;
    const bool is_new_recording = unit.attempts > (before ? before->attempts : 0);
    if (!before) WarnOfLetters(run.serial);
    if (!unit.tied_with.empty() && (run.id == unit.run || run.id == unit.tied_with)) {
      Warn(run.serial + ": its current run " + unit.run + ", of " + unit.log + ", and run " +
           unit.tied_with + ", of another log, were both measured at " + unit.recorded +
           "; the run that was calibrated first counts as the earlier one");
    }
    if (unit.most && is_new_recording && unit.attempts > *unit.most + 1) {
      Warn(run.serial + ": this is recording " + std::to_string(unit.attempts) +
           " of the unit; the store keeps it, but only the first " +
           std::to_string(*unit.most + 1) + " recordings can decide the unit's verdict");
    }
    WarnOfRefusal(run, before, unit, is_new_recording);
    if (before && !before->disposed_by.empty() && unit.disposed_by.empty()) {
      Warn(run.serial + ": run " + run.id +
           (is_new_recording ? ", of another recording,"
                             : ", which has no result, misses other limits or has another time,") +
           " lifts the decision of " + before->disposed_by + " (" +
           std::string(VerdictName(before->final_verdict)) + ": " + before->disposed_why + ")");
    }
    if (before) WarnOfLimits(run, *before, unit);
    if (before && !is_new_recording) {
      ++progress_.known_recordings;
      NameSome(run.serial, &progress_.known_units);
    }
    Yield& yield = progress_.yield;
    const bool is_good = !IsRed(unit.final_verdict);
    progress_.overruled.erase(run.serial);
    if (is_good == IsRed(run.verdict)) progress_.overruled[run.serial] = ReasonOf(unit);
    const auto [item, is_new] = units_.try_emplace(std::hash<std::string>()(run.serial));
    UnitSoFar& so_far = item->second;
    if (is_new) {
      ++yield.units;
      if (!IsRed(unit.first_verdict)) ++yield.first_good;
    } else if (so_far.is_good) {
      --yield.final_good;
    } else {
      progress_.held_back -= so_far.good_runs;
    }
    if (!IsRed(run.verdict)) ++so_far.good_runs;
    so_far.is_good = is_good;
    if (is_good) {
      ++yield.final_good;
    } else {
      progress_.held_back += so_far.good_runs;
    }
  }

  /// Warns that a unit missed limits before and is good now by other limits or another experiment.
  void WarnOfLimits(const UnitRun& run, const Standing& before, const Standing& unit) {
    const bool was_red = before.disposed_by.empty() && IsRed(before.final_verdict);
    if (!was_red || !unit.disposed_by.empty() || IsRed(unit.final_verdict)) return;
    Result<std::string> failed = before.run;
    if (before.final_verdict != Verdict::kFail) failed = store_->FailedSinceGood(run);
    if (!failed || failed->empty() || *failed == unit.run) return;
    const Result<std::vector<UnitRun>> both = store_->ReadRuns({*failed, unit.run});
    if (!both || both->size() != 2) return;
    const bool is_in_order = both->front().id == *failed;
    const UnitRun &old = is_in_order ? both->front() : both->back(),
                  &now = is_in_order ? both->back() : both->front();
    const bool is_same_recording = RecordingOf(old.readings) == RecordingOf(now.readings);
    const auto same_in_now = [&now](const LimitCheck& check) {
      return std::ranges::find(now.judgements, check.FullName(), &LimitCheck::FullName);
    };
    std::vector<LimitCheck> lost;
    for (const LimitCheck& check : old.judgements) {
      const auto same = same_in_now(check);
      const bool is_lost = same == now.judgements.end() || is_same_recording ||
                           same->limit.lower < check.limit.lower ||
                           same->limit.upper > check.limit.upper;
      if (!check.pass && is_lost) lost.push_back(check);
    }
    if (lost.empty()) return;
    const auto named = std::ranges::find(
        lost, old.code, [](const LimitCheck& check) { return kLimit + check.FullName(); });
    const LimitCheck& worst = named == lost.end() ? lost.front() : *named;
    const auto same = same_in_now(worst);
    Warn(run.serial + ": was FAIL because of " + MissedText(worst) +
         (lost.size() > 1 ? " and " + Counted(lost.size() - 1, "other limit") : "") + ", and is " +
         std::string(VerdictWords(unit.final_verdict)) + " now, since its current run " + unit.run +
         (same == now.judgements.end() ? " is not judged by this limit"
                                       : " has " + MissedText(*same)) +
         "; check that this was intended");
  }

  /// If a person refused the unit and the refusal still holds although this run of a new recording
  /// is good and current, warns and states why.
  void WarnOfRefusal(const UnitRun& run,
                     const std::optional<Standing>& before,
                     const Standing& unit,
                     bool is_new_recording) {
    const bool stays = before && before->final_verdict == Verdict::kFail &&
                       !unit.disposed_by.empty() && before->disposed_by == unit.disposed_by;
    if (!stays || !is_new_recording || run.id != unit.run || IsRed(run.verdict)) return;
    const bool is_file = run.recorded.empty() || run.recorded_by == kByFile;
    Warn(run.serial + ": run " + run.id + ", of another recording, does not lift the decision of " +
         unit.disposed_by + " (" + std::string(VerdictName(unit.final_verdict)) + ": " +
         unit.disposed_why + "), since " +
         (is_file ? "its time of measurement is known only from the date of its file"
                  : "it was measured at " + run.recorded + ", before that decision") +
         "; list a log measured later, with its time in column `recorded`, or decide again by " +
         DisposeCommand(run.serial, options_.plan, "--verdict=PASS --why=WHY"));
  }

  /// Calls AgreeFolders for all UnitsHeldBack: an earlier change of their files may have failed,
  /// since a folder was missing or a process was killed. Error: the store cannot list these units.
  Status MakeUpForEarlier() {
    if (options_.plan.folder.empty()) return {};
    TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<std::string> held_back, store_->UnitsHeldBack());
    for (const std::string& serial : held_back) {
      Result<Agreement> agreed = AgreeFolders(*store_, serial, options_.plan.folder);
      if (!agreed) continue;  // The store fails; the next start repeats this.
      // A missing folder is not reported: it may be on another machine or in an archive.
      std::erase_if(agreed->unreached, [](const Unreached& one) { return !one.is_there; });
      for (const std::string& note : agreed->Notes(serial)) Warn(note);
    }
    return {};
  }

  /// Calls AgreeFolders and reports what it did.
  void AgreeInFolders(const std::string& serial) {
    if (options_.plan.folder.empty()) return;
    const Result<Agreement> agreed = AgreeFolders(*store_, serial, options_.plan.folder);
    if (!agreed) {
      Warn(serial + ": " + agreed.error().message +
           "; the next fleet run or fleet watch corrects the files of its other runs");
      return;
    }
    for (const std::string& note : agreed->Notes(serial)) Warn(note);
    progress_.unsafe.erase(serial);
    if (agreed->IsUnsafe()) progress_.unsafe.insert(serial);
  }

  /// Schedules another attempt after a failure, or returns the error if is_patient is false.
  Status Failed(const Error& error, Retry* retry) const {
    constexpr double kFirstS = 1.0, kMostS = 60.0;  // Delays double up to one minute.
    if (!options_.is_patient) return error;
    if (retry->wait_s == 0.0) Tell(error.message + "; this is tried again until it succeeds");
    retry->why = error.message;
    retry->wait_s = retry->wait_s == 0.0 ? kFirstS : std::min(kMostS, 2.0 * retry->wait_s);
    retry->at = Clock::now() + std::chrono::milliseconds(static_cast<int>(1e3 * retry->wait_s));
    return {};
  }

  /// Warns of a unit whose serial number differs only in upper or lower case from a new one.
  void WarnOfLetters(const std::string& serial) {
    const Result<std::string> other = store_->UnitOfOtherLetters(serial);
    if (!other || other->empty()) return;
    Warn(serial + ": differs from unit `" + *other +
         "` of the store only in capital letters; if both are the same unit, always write its "
         "serial number in the same way");
  }

  void Tell(const std::string& note) const {
    if (listener_.on_note) listener_.on_note(note);
  }
  void Warn(const std::string& warning) {
    progress_.warnings_said.push_back(WarningOf(warning));
    if (listener_.on_warning) listener_.on_warning(warning);
  }

  const FleetOptions& options_;
  std::string config_sha256_;
  OrderSource* source_;
  Store* store_;
  FleetListener listener_;
  WorkerPool workers_;
  std::optional<Arrival> next_;  ///< Taken from the source, not started.
  std::deque<UnitRun> ended_;    ///< Not yet in the store.
  Retry store_retry_, worker_retry_, disk_retry_, hold_retry_;
  bool is_held_ = false;             ///< Units wait because of FleetOptions::hold.
  bool is_waiting_in_vain_ = false;  ///< is_held_, and no other unit is expected.
  FleetProgress progress_;
  /// The state of a unit with runs in this session.
  struct UnitSoFar {
    bool is_good = false;       ///< By its present standing.
    std::size_t good_runs = 0;  ///< Number of good runs in this session.
  };
  std::unordered_map<std::size_t, UnitSoFar> units_;  ///< By the serial number's hash.
};

/// Units known from the start, in their order.
class ListedUnits : public OrderSource {
 public:
  explicit ListedUnits(std::vector<Arrival> units) : units_(std::move(units)) {}

  std::optional<Arrival> Next() override {
    if (next_ == units_.size()) return std::nullopt;
    return std::move(units_[next_++]);
  }
  bool HasEnded() const override { return next_ == units_.size(); }

 private:
  std::vector<Arrival> units_;
  std::size_t next_ = 0;
};

/// Groups of units whose logs have the same readings, as indices in `units`. Compares the units at
/// `places`, by the first `most` readings of each sensor; unset: by all readings.
std::vector<std::vector<std::size_t>> OfSameReadings(const std::vector<Arrival>& units,
                                                     const std::vector<std::size_t>& places,
                                                     std::optional<std::int64_t> most,
                                                     int jobs) {
  std::vector<std::string> recordings(places.size());
  std::atomic<std::size_t> next = 0;
  const auto read = [&] {
    for (std::size_t i = next++; i < places.size(); i = next++) {
      try {
        const auto readings = ReadingsOf(units[places[i]].order.log, most);
        if (readings) recordings[i] = RecordingOf(*readings);
      } catch (const std::exception&) {  // A worker will refuse an unreadable log.
      }
    }
  };
  std::vector<std::jthread> readers;
  for (int job = 0; job < jobs; ++job) readers.emplace_back(read);
  readers.clear();  // Waits for all readers.
  std::map<std::string, std::vector<std::size_t>> by_recording;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!recordings[i].empty()) by_recording[recordings[i]].push_back(places[i]);
  }
  std::vector<std::vector<std::size_t>> groups;
  for (const auto& [recording, group] : by_recording) {
    if (group.size() > 1) groups.push_back(group);
  }
  return groups;
}

/// Returns the units. A unit is refused if the log of another unit has the same readings, unless a
/// person stated that the other log has a wrong serial number. Error: the store fails.
Result<std::vector<Arrival>> WithoutCopies(const FleetOptions& options,
                                           Store& store,
                                           std::vector<UnitOrder> orders) {
  // Only this many readings of each sensor are compared first. Reading them takes a millisecond,
  // and so many readings hardly agree by chance.
  constexpr std::int64_t kFirstReadings = 64;
  std::vector<Arrival> units;
  std::vector<std::size_t> all;
  for (UnitOrder& order : orders) {
    all.push_back(units.size());
    units.push_back({std::move(order)});
  }
  if (units.size() < 2) return units;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<UnitRun> given_up, store.RunsGivenUp());
  const auto is_given_up = [&](const UnitRun& unit) {
    return std::ranges::any_of(given_up, [&](const UnitRun& one) {
      return one.serial == unit.serial && one.log == unit.log;
    });
  };
  for (const auto& likely : OfSameReadings(units, all, kFirstReadings, options.jobs)) {
    for (const auto& same : OfSameReadings(units, likely, std::nullopt, options.jobs)) {
      for (const std::size_t place : same) {
        const UnitRun own = RunOf(options.plan, units[place].order);
        for (const std::size_t another : same) {
          const UnitRun other = RunOf(options.plan, units[another].order);
          if (other.serial == own.serial || is_given_up(other)) continue;
          units[place].refusal =
              IsCopy(own,
                     other,
                     "measure both units again, or name only the log with the right serial number");
        }
      }
    }
  }
  return units;
}

/// Records the units that have a skipped log and are not good.
Status NameLeftOut(Store& store, const auto& is_left_out, FleetProgress* progress) {
  if (progress->skipped == 0) return {};
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<UnitRun> not_good, store.LogsOfUnitsNotGood());
  for (const UnitRun& run : not_good) {
    if (is_left_out(run.log)) progress->skipped_red.insert(run.serial);
  }
  return {};
}

}  // namespace

Result<FleetProgress> RunFleet(std::vector<UnitOrder> units,
                               const FleetOptions& options,
                               Store& store,
                               const FleetListener& listener,
                               const std::function<bool()>& is_stopped) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string config_sha256, ConfigSha256(options.plan));
  FleetProgress progress;
  std::set<std::string> skipped;
  if (options.resumes) {
    TRUETRIAD_ASSIGN_OR_RETURN(const DoneLogs done, DoneLogs::In(store, config_sha256));
    std::erase_if(units, [&](const UnitOrder& unit) {
      return done.Has(unit) && skipped.insert(unit.log).second;
    });
  }
  progress.skipped = skipped.size();
  progress.units = units.size();
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<Arrival> arrivals,
                             WithoutCopies(options, store, std::move(units)));
  ListedUnits source(std::move(arrivals));
  TRUETRIAD_ASSIGN_OR_RETURN(progress,
                             FleetEngine(options, config_sha256, &source, &store, listener)
                                 .Run(std::move(progress), is_stopped));
  if (!progress.is_stopped) TRUETRIAD_RETURN_IF_ERROR(store.MarkEnd());
  TRUETRIAD_RETURN_IF_ERROR(NameLeftOut(
      store, [&](const auto& log) { return skipped.contains(log); }, &progress));
  return progress;
}

Result<FleetProgress> WatchFleet(const WatchOptions& watched,
                                 const FleetOptions& options,
                                 Store& store,
                                 const FleetListener& listener,
                                 const std::function<bool()>& is_stopped) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string config_sha256, ConfigSha256(options.plan));
  TRUETRIAD_ASSIGN_OR_RETURN(DoneLogs done, DoneLogs::In(store, config_sha256));
  TRUETRIAD_ASSIGN_OR_RETURN(const std::unique_ptr<OrderSource> source,
                             OpenLogWatch(watched, std::move(done), [&](const std::string& note) {
                               if (listener.on_note) listener.on_note(note);
                             }));
  FleetOptions patient = options;
  patient.is_patient = true;
  TRUETRIAD_ASSIGN_OR_RETURN(
      FleetProgress progress,
      FleetEngine(patient, config_sha256, source.get(), &store, listener).Run({}, is_stopped));
  // A watch that was stopped is complete, unlike a stopped run.
  TRUETRIAD_RETURN_IF_ERROR(store.MarkEnd());
  progress.skipped = source->Skipped();
  TRUETRIAD_RETURN_IF_ERROR(NameLeftOut(
      store, [&](const auto& log) { return source->HasSkipped(log); }, &progress));
  return progress;
}

}  // namespace truetriad::fleet
