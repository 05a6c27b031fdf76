// SPDX-License-Identifier: Apache-2.0
#include "fleet/unit_decisions.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "fleet/unit_folders.h"
#include "fleet/unit_work.h"
#include "io/yaml_reader.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

namespace truetriad::fleet {
namespace {

namespace fs = std::filesystem;

bool IsSame(const Decision& one, const Decision& other) {
  return one.verdict == other.verdict && one.who == other.who && one.why == other.why &&
         one.is_automatic == other.is_automatic &&
         (one.is_automatic || one.created == other.created);
}

Decision OfPerson(const Standing& unit) {
  return {unit.final_verdict, unit.disposed_by, unit.disposed_why, unit.disposed_at};
}

/// That of another run, by which this one may not leave either.
Decision OfRunThatCounts(const Standing& unit) {
  return {
      .verdict = Verdict::kFail,
      .who = "run " + unit.run,
      .why = "that run of the unit counts, and is " + std::string(VerdictWords(unit.final_verdict)),
      .created = TimestampUtc(),
      .is_automatic = true};
}

/// What the calibration of a run is to state.
std::vector<Decision> WhatHolds(Calibration calibration, const Standing& unit, bool counts) {
  std::vector<Decision>& decisions = calibration.decisions;
  std::erase_if(decisions, [](const Decision& one) { return one.is_automatic; });
  const bool is_red = IsRed(unit.final_verdict);
  if (!unit.disposed_by.empty()) {
    const Decision decision = OfPerson(unit);
    const bool is_stated = !decisions.empty() && IsSame(decisions.back(), decision);
    if (!is_stated && (is_red || counts)) decisions.push_back(decision);
    return decisions;
  }
  // A concession ends with the next run that counts; a refusal that stands is for good.
  if (!decisions.empty() && decisions.back().verdict == Verdict::kPass) decisions.clear();
  if (is_red && !counts && !IsRed(calibration.verdict())) {
    decisions.push_back(OfRunThatCounts(unit));
  }
  return decisions;
}

/// Makes the files of a run agree; the exports that were withdrawn. They go first, and
/// calibration.yaml comes last: killed in between, the folder says too little of a unit rather than
/// too much, and the next call does the rest.
Result<std::vector<std::string>> Agree(const fs::path& folder, const Standing& unit, bool counts) {
  std::vector<std::string> withdrawn;
  // A link stays a link: the file that it leads to is changed.
  std::error_code failure;
  const fs::path file = fs::weakly_canonical(folder / "calibration.yaml", failure);
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, LookAtSmallFile(file.string()));
  TRUETRIAD_ASSIGN_OR_RETURN(Calibration calibration, CalibrationFromYaml(text, file.string()));
  std::vector<Decision> decisions = WhatHolds(calibration, unit, counts);
  if (std::ranges::equal(decisions, calibration.decisions, IsSame)) return withdrawn;
  const Verdict before = calibration.verdict();
  calibration.decisions = std::move(decisions);
  if (calibration.verdict() == Verdict::kFail || calibration.verdict() != before) {
    TRUETRIAD_ASSIGN_OR_RETURN(withdrawn, WithdrawExports(folder.string()));
  }
  std::optional<std::string> report;
  if (const auto page = LookAtSmallFile((folder / "report.html").string())) {
    const bool shares = fs::exists(folder / kAssetsOfRun, failure);
    report = CalibrationHtml(calibration,
                             {.assets = std::string(shares ? kAssetsOfRun : "")},
                             {.noise = {}, .earlier_page = *page});
  }
  TRUETRIAD_RETURN_IF_ERROR(WriteResult(file.parent_path().string(), calibration, report));
  return withdrawn;
}

}  // namespace

std::vector<std::string> Agreement::Notes(const std::string& serial) const {
  std::vector<std::string> notes;
  if (!withdrawn.empty()) {
    notes.push_back(serial + ": " + std::to_string(withdrawn.size()) +
                    (withdrawn.size() == 1 ? " exported file is" : " exported files are") +
                    " renamed to *.withdrawn" +
                    (why.empty() ? ", since another verdict holds; export again what is to leave"
                                 : ", since " + why));
  }
  for (const Unreached& one : unreached) {
    notes.push_back(serial + ": " + one.error.message + (why.empty() ? "" : "; " + why) +
                    ", and `export` does not know of this there");
  }
  return notes;
}

Result<Agreement> AgreeFolders(Store& store, const std::string& serial, const fs::path& units) {
  Agreement agreement;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::vector<RunFolder> folders, store.FoldersOfUnit(serial));
  if (folders.empty()) return agreement;
  const FolderClaim claim =
      FolderClaim::WaitFor(fs::path(FolderOf(folders.back().folder, units)).parent_path().string());
  TRUETRIAD_ASSIGN_OR_RETURN(const std::optional<Standing> unit, store.StandingOf(serial));
  if (!unit) return agreement;
  const bool is_red = IsRed(unit->final_verdict), is_decided = !unit->disposed_by.empty();
  if (folders.size() == 1 && !is_decided) return agreement;  // The only run speaks for itself.
  if (is_red && is_decided) {
    agreement.why = unit->disposed_by + " refused the unit (" + unit->disposed_why + ")";
  } else if (is_red) {
    agreement.why =
        "run " + unit->run + " counts, and is " + std::string(VerdictWords(unit->final_verdict));
  }
  for (const RunFolder& one : folders) {
    const bool counts = one.run == unit->run;
    const std::string folder = FolderOf(one.folder, units);
    const Result<std::vector<std::string>> withdrawn = Agree(folder, *unit, counts);
    if (withdrawn) {
      agreement.withdrawn.insert(agreement.withdrawn.end(), withdrawn->begin(), withdrawn->end());
      continue;
    }
    // A run without a result has nothing that could leave.
    const bool could_leave = one.verdict != Verdict::kNoResult;
    const bool needs_it = is_red ? could_leave && (is_decided || !counts) : is_decided && counts;
    std::error_code failure;
    if (needs_it) agreement.unreached.push_back({withdrawn.error(), fs::exists(folder, failure)});
  }
  return agreement;
}

std::string FolderOf(const std::string& folder, const fs::path& units) {
  const fs::path named(folder);
  std::error_code failure;
  if (folder.empty() || units.empty()) return folder;
  for (const fs::path& place : {units / named.parent_path().filename() / named.filename(),
                                named,
                                units.parent_path() / named}) {
    if (fs::is_directory(place, failure)) return place.string();
  }
  return folder;
}

fs::path UnitsBeside(const std::string& store_url) {
  const std::optional<std::string> file = FileOfStore(store_url);
  return file ? fs::path(*file).parent_path() / "units" : fs::path();
}

}  // namespace truetriad::fleet
