// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/fleet_progress.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "base/utf8.h"
#include "tools/truetriad/flags.h"
#include "tools/truetriad/output_folder.h"

DECLARE_string(progress);

namespace truetriad {
namespace {

Json OrNull(const auto& value) { return value ? Json(*value) : Json(nullptr); }

/// The number of runs with each verdict: "3 PASS, 1 NO RESULT".
std::string CountsText(const fleet::FleetProgress& progress) {
  std::string text;
  for (const auto& [verdict, count] : progress.verdicts) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " +
            std::string(VerdictWords(verdict));
  }
  return text.empty() ? "none" : text;
}

/// Codes with their counts, most frequent first.
auto Pareto(const std::map<std::string, std::size_t>& counted) {
  std::vector<std::pair<std::string, std::size_t>> codes(counted.begin(), counted.end());
  std::stable_sort(
      codes.begin(), codes.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  return codes;
}

/// "18 runs of 3 units"; "3 units" if each unit was run once, or the number of units is unknown.
std::string RunsText(const fleet::FleetProgress& progress) {
  const std::size_t units = progress.yield.units;
  if (units == 0 || units == progress.done) return Counted(progress.done, "unit");
  return Counted(progress.done, "run") + " of " + Counted(units, "unit");
}

/// "  B0003: refused by R. Roe (bent)", one line for each of the first units.
std::string OverruledText(const std::map<std::string, std::string>& overruled) {
  constexpr std::size_t kMostShown = 5;  // `fleet query` shows the others.
  std::string text;
  std::size_t count = 0;
  for (const auto& [serial, why] : overruled) {
    if (++count > kMostShown) break;
    text += "  " + PrintableLine(serial + ": " + why) + '\n';
  }
  if (overruled.size() > kMostShown) {
    text += "  and " + std::to_string(overruled.size() - kMostShown) + " more (fleet query)\n";
  }
  return text;
}

/// The first serial numbers of `count` units: "B0001, B0002, B0003, …".
std::string NamesText(const std::set<std::string>& serials, std::size_t count) {
  constexpr std::size_t kMostNamed = 3;  // Keeps the text within a line.
  std::string names;
  std::size_t named = 0;
  for (const std::string& serial : serials) {
    if (++named > kMostNamed) break;
    names += (names.empty() ? "" : ", ") + PrintableLine(serial);
  }
  return names + (count > std::min(serials.size(), kMostNamed) ? ", …" : "");
}

/// "  3 not failed, but with warnings: 2 x fault, 1 x poorly-known (B0001, B0002, B0007)
/// ", or empty.
std::string WarningsText(const fleet::FleetProgress& progress) {
  if (progress.warned == 0) return "";
  std::string text = "  " + std::to_string(progress.warned) + " not failed, but with warnings";
  std::string_view before = ": ";
  for (const auto& [code, count] : Pareto(progress.warnings)) {
    text += before;
    text += std::to_string(count) + " x " + code;
    before = ", ";
  }
  return text + " (" + NamesText(progress.warned_units, progress.warned) + ")\n";
}

/// "  2 of these recordings were calibrated before; each counts only once: B0001, B0002".
std::string KnownText(const fleet::FleetProgress& progress) {
  const std::size_t count = progress.known_recordings;
  if (count == 0) return "";
  return "  " + std::to_string(count) + " of these recordings " + (count == 1 ? "was" : "were") +
         " calibrated before; " +
         (count == 1 ? "it counts only once: " : "each counts only once: ") +
         NamesText(progress.known_units, count) + '\n';
}

/// "FAIL (a.csv): accelerometer.bias.y -0.889 of ± 0.7 m/s²". The log is left out if the message
/// begins with it.
std::string RedText(const fleet::UnitRun& run) {
  const std::string why = run.message.substr(0, run.message.find('\n'));
  std::string text(VerdictWords(run.verdict));
  if (run.verdict == Verdict::kNoResult) text += ", " + run.code;
  if (!why.starts_with(run.log)) text += " (" + run.log + ")";
  return text + ": " + why;
}

/// The operator's action for a unit that is not good.
std::string_view OperatorRemedy(const fleet::UnitRun& run) {
  if (const fleet::RunCode* const code = fleet::RunCodeOf(run.code)) return code->operator_remedy;
  if (const std::optional<FindingCode> code = FindingCodeFromName(run.code)) {
    return FindingKindOf(*code).operator_remedy;
  }
  const bool is_cut_off = run.code == InfoOf(ErrorCode::kDamagedFile).name ||
                          run.code == InfoOf(ErrorCode::kEmptyFile).name;
  return is_cut_off ? "record again" : "call the engineer";
}

/// The verdict of another run or of a person, if it overrules the verdict of `run`.
std::optional<std::string> OverruledBy(const fleet::UnitRun& run,
                                       const fleet::FleetProgress& progress) {
  const auto by = progress.overruled.find(run.serial);
  return by == progress.overruled.end() ? std::nullopt : std::optional(by->second);
}

/// "B0003  NO RESULT  record again; do not touch the unit while it rests (no-rest)". If the run is
/// overruled: "B0003  FAIL by QA (cracked case): set it aside".
std::string OperatorLine(const fleet::UnitRun& run, const fleet::FleetProgress& progress) {
  if (const std::optional<std::string> by = OverruledBy(run, progress)) {
    // Overruled: if this run is good, the unit is not, and vice versa.
    return run.serial + "  " + *by + (fleet::IsRed(run.verdict) ? "" : ": set it aside");
  }
  std::string text = run.serial + "  " + std::string(VerdictWords(run.verdict));
  if (!fleet::IsRed(run.verdict)) return text;
  return text + "  " + std::string(OperatorRemedy(run)) + " (" + run.code + ")";
}

/// The first line of a result, and its grade.
struct FirstLine {
  std::string text;
  Grade grade = Grade::kCaution;
};

/// States the first of these that applies: some runs are not good (number: FleetProgress::NotGood);
/// some units are not good, although all runs of this command are; some skipped units are not good;
/// units wait for the golden unit; some units were not done; nothing was done. If none applies,
/// states how many runs had no limits.
FirstLine FirstLineOf(const fleet::FleetProgress& progress) {
  const auto of = [](std::size_t count, std::size_t all, const std::string& what) {
    return std::to_string(count) + " OF " + std::to_string(all) + what;
  };
  const std::size_t units = progress.yield.units;
  if (progress.red > 0) return {of(progress.NotGood(), progress.done, " NOT GOOD")};
  if (progress.yield.final_good < units) {
    return {of(units - progress.yield.final_good,
               units,
               std::string(units == 1 ? " UNIT" : " UNITS") +
                   " NOT GOOD, although all runs of this command are good")};
  }
  if (const std::size_t red = progress.skipped_red.size(); red > 0) {
    return {of(red, progress.skipped, " SKIPPED UNITS NOT GOOD")};
  }
  if (!progress.held.empty()) return {"NOT ALL DONE: UNITS WAIT FOR A CHECK OF THE GOLDEN UNIT"};
  if (progress.left > 0) return {of(progress.left, progress.left + progress.done, " NOT DONE")};
  if (progress.done == 0) return {"NOTHING TO DO"};
  const auto unjudged = progress.verdicts.find(Verdict::kNoLimits);
  if (unjudged == progress.verdicts.end()) return {"ALL GOOD", Grade::kGood};
  if (unjudged->second == progress.done) return {"ALL USABLE, NO LIMITS SET"};
  return {"NONE FAILED, " + of(unjudged->second, progress.done, " WITHOUT LIMITS")};
}

std::string SummaryText(const fleet::FleetProgress& progress) {
  const double runs = static_cast<double>(progress.done);
  std::string text = FirstLineOf(progress).text + "\n  " + RunsText(progress) +
                     Formatted(" in %.1f s (%.1f a second; %.1f ms of processor time each): ",
                               progress.seconds,
                               progress.Rate(),
                               1e3 * progress.cpu_s / std::max(runs, 1.0)) +
                     CountsText(progress) + '\n';
  if (progress.skipped > 0) {
    text += "  " + std::to_string(progress.skipped) + " skipped: their runs are in the store";
    if (const std::set<std::string>& red = progress.skipped_red; !red.empty()) {
      text += "; not good: " + NamesText(red, red.size());
    }
    text += '\n';
  }
  if (const fleet::Yield& yield = progress.yield; yield.units > 0) {
    text += Formatted("  First-pass yield %.1f %%, final %.1f %% of ",
                      yield.FirstPercent(),
                      yield.FinalPercent()) +
            Counted(yield.units, "unit") + '\n';
  }
  for (const auto& [code, count] : Pareto(progress.codes)) {
    text += "  " + std::to_string(count) + " x " + code + '\n';
  }
  text += WarningsText(progress) + KnownText(progress) + OverruledText(progress.overruled);
  for (const std::string& serial : progress.unsafe) {
    text +=
        "  " + serial +
        ": may not be delivered, but files of earlier runs could not be changed to state this\n";
  }
  return Printable(text + "  Store: " + fleet::ShownStore(StatedStore()) + '\n');
}

Json SummaryJson(const fleet::FleetProgress& progress) {
  Json json = {{"units", OrNull(progress.units)},
               {"done", progress.done},
               {"skipped", progress.skipped},
               {"left", progress.left},
               {"skipped_not_good", progress.skipped_red},
               {"not_good", progress.NotGood()},
               {"verdicts", Json::object()},
               {"codes", Json::object()},
               {"warned", progress.warned},
               {"warnings", Json::object()},
               {"yield",
                {{"units", progress.yield.units},
                 {"first_pass", progress.yield.first_good},
                 {"final", progress.yield.final_good}}},
               {"overruled", progress.overruled},
               {"unreached", progress.unsafe},
               {"known_recordings", progress.known_recordings},
               {"seconds", progress.seconds},
               {"cpu_s", progress.cpu_s},
               {"store", fleet::ShownStore(StatedStore())}};
  for (const auto& [verdict, count] : progress.verdicts) {
    json["verdicts"][std::string(VerdictName(verdict))] = count;
  }
  for (const auto& [code, count] : Pareto(progress.codes)) json["codes"][code] = count;
  for (const auto& [code, count] : Pareto(progress.warnings)) json["warnings"][code] = count;
  return json;
}

/// "42 of 300 runs, 3 not good; 4.2 a second, 61 s left".
std::string ProgressText(const fleet::FleetProgress& progress) {
  std::string text = std::to_string(progress.done);
  if (progress.units) text += " of " + std::to_string(*progress.units);
  text += " runs, " + std::to_string(progress.NotGood()) +
          Formatted(" not good; %.1f a second", progress.Rate());
  if (const std::optional<double> left = progress.SecondsLeft())
    text += Formatted(", %.0f s left", *left);
  return text;
}

/// Prints JSON in ASCII only, since stderr may be a terminal.
void PrintLine(const Json& json) {
  const std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace) + '\n';
  std::fputs(text.c_str(), stderr);
}

}  // namespace

std::string StatedStore() { return FLAGS_store.empty() ? InOutput("fleet.db") : FLAGS_store; }

Result<std::unique_ptr<fleet::Store>> OpenStatedToRead(bool asks) {
  TRUETRIAD_ASSIGN_OR_RETURN(std::unique_ptr<fleet::Store> store,
                             fleet::OpenStoreToRead(FLAGS_store));
  if (asks || !FLAGS_where.empty()) TRUETRIAD_RETURN_IF_ERROR(store->AllowTypedText());
  return store;
}

FleetTalk::FleetTalk(bool names_all)
    : is_lines_(FLAGS_progress == kProgressLines), names_all_(names_all) {}

fleet::FleetListener FleetTalk::Listener() {
  return {.on_run = [this](const auto& run, const auto& progress) { OnRun(run, progress); },
          .on_note = [this](const std::string& note) { OnNote(note, Note); },
          .on_warning = [this](const std::string& warning) { OnNote(warning, Warn); }};
}

void FleetTalk::OnRun(const fleet::UnitRun& run, const fleet::FleetProgress& progress) {
  if (is_lines_) {
    PrintLine({{"serial", run.serial},
               {"run", run.id},
               {"log", run.log},
               {"verdict", VerdictName(run.verdict)},
               {"code", run.code},
               {"overruled", OrNull(OverruledBy(run, progress))},
               {"done", progress.done},
               {"units", OrNull(progress.units)},
               {"not_good", progress.NotGood()},
               {"rate", progress.Rate()},
               {"seconds_left", OrNull(progress.SecondsLeft())}});
    return;
  }
  if (names_all_) {
    OnNote(OperatorLine(run, progress), Note);
  } else if (fleet::IsRed(run.verdict)) {
    OnNote(run.serial + ": " + RedText(run), Note);
  }
  line_.ShowText(ProgressText(progress));
}

void FleetTalk::OnNote(const std::string& note, void (*print)(const std::string&)) {
  if (is_lines_) {
    PrintLine({{"note", note}});
    return;
  }
  line_.Wipe();
  print(PrintableLine(note));
}

VerbResult FleetResult(const fleet::FleetProgress& progress) {
  const bool has_failed =
      (FLAGS_fail_on == kFailOnUnit && !progress.IsGood()) || !progress.unsafe.empty();
  VerbResult result{.exit_code = has_failed ? kExitOutsideLimits : kExitGood,
                    .text = SummaryText(progress),
                    .result = SummaryJson(progress),
                    .findings = progress.warnings_said,
                    .failure = progress.held,
                    .grade = FirstLineOf(progress).grade};
  if (progress.held.empty()) return result;
  const Error error(ErrorCode::kStationNotChecked, progress.held);
  result.exit_code = static_cast<int>(error.kind());
  result.result["error"] = ToTree(error);
  return result;
}

}  // namespace truetriad
