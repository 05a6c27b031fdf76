// SPDX-License-Identifier: Apache-2.0
#include "fleet/run_check.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "line/line_data.h"

namespace truetriad::fleet {
namespace {

/// `text` has digits where `form` has 0, hexadecimal ones where it has x, and else the same.
bool HasForm(std::string_view text, std::string_view form) {
  if (text.size() != form.size()) return false;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool is_digit = text[i] >= '0' && text[i] <= '9';
    const bool is_hex = is_digit || (text[i] >= 'a' && text[i] <= 'f');
    if (form[i] == '0' ? !is_digit : form[i] == 'x' ? !is_hex : text[i] != form[i]) return false;
  }
  return true;
}

Error Wrong(const std::string& what) { return Error(ErrorCode::kWrongFormat, what); }

/// For messages: what may be anything.
std::string InWords(std::string_view text) {
  constexpr std::size_t kMost = 60;
  return Json(std::string(text.substr(0, kMost)))
             .dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace) +
         (text.size() > kMost ? "…" : "");
}

Status CheckName(std::string_view name) {
  // Later names would have to follow it, until no year is left.
  constexpr std::string_view kTooLate = "2201";
  if (IsRunId(name) && name < kTooLate) return {};
  return Wrong("its name " + InWords(name) +
               " is none that truetriad has made until 2200, as in "
               "20261124T235959.123456Z-4f2a9c01");
}

Status CheckTime(const std::string& time, const std::string& name = "created") {
  if (HasForm(time, "0000-00-00T00:00:00Z") && std::isfinite(line::SecondsOf(time))) return {};
  return Wrong(name + " is " + InWords(time) + ", expected a time as in 2026-11-24T23:59:59Z");
}

/// When the unit was measured, and what says so: both or neither.
Status CheckRecorded(const UnitRun& run) {
  if (run.recorded.empty() && run.recorded_by.empty()) return {};
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(run.recorded, "recorded"));
  if (std::find(kRecordedBy.begin(), kRecordedBy.end(), run.recorded_by) != kRecordedBy.end()) {
    return {};
  }
  return Wrong("recorded_by is " + InWords(run.recorded_by) + ", expected list, recording or file");
}

/// The least value of a number that is stored.
Status CheckNumber(const std::string& name, double value, bool may_be_negative) {
  if (std::isfinite(value) && (may_be_negative || value >= 0.0)) return {};
  return Wrong(name + " is " + std::to_string(value) +
               (may_be_negative ? ", no number" : ", expected 0 or more"));
}

Status CheckParameters(const UnitRun& run) {
  std::set<std::string_view> names;
  for (const Parameter& parameter : run.parameters) {
    if (parameter.name.empty() || !names.insert(parameter.name).second) {
      return Wrong("parameter " + InWords(parameter.name) + " is there twice, or has no name");
    }
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(parameter.name, parameter.value, true));
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("sigma of " + parameter.name, parameter.sigma, false));
  }
  const std::size_t size = run.parameters.size();
  if (!run.covariance.empty() && run.covariance.size() != size * (size + 1) / 2) {
    return Wrong("the covariance has " + std::to_string(run.covariance.size()) +
                 " numbers, and that of " + std::to_string(size) + " parameters has " +
                 std::to_string(size * (size + 1) / 2));
  }
  for (const double value : run.covariance) {
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("the covariance", value, true));
  }
  return {};
}

/// A run is good, or outside its limits, by what was judged.
Status CheckVerdict(const UnitRun& run) {
  const auto missed = std::find_if(run.judgements.begin(),
                                   run.judgements.end(),
                                   [](const LimitCheck& check) { return !check.pass; });
  const bool is_missed = missed != run.judgements.end();
  if (is_missed && !IsRed(run.verdict)) {
    return Wrong("its verdict is `" + std::string(VerdictName(run.verdict)) + "`, and its limit " +
                 InWords(missed->name) + " is missed");
  }
  if (is_missed || run.verdict != Verdict::kFail) return {};
  return Wrong("its verdict is `FAIL`, and it misses none of its limits");
}

}  // namespace

bool IsRunId(std::string_view name) {
  if (!HasForm(name, "00000000T000000.000000Z-xxxxxxxx")) return false;
  std::string moment(name.substr(0, 15));
  for (const std::size_t place : {4, 7}) moment.insert(place, "-");
  for (const std::size_t place : {13, 16}) moment.insert(place, ":");
  return std::isfinite(line::SecondsOf(moment));
}

Status CheckRun(const UnitRun& run) {
  constexpr std::size_t kLongestSerial = 1000;  // Bytes: 200 characters, or the name of a file.
  TRUETRIAD_RETURN_IF_ERROR(CheckName(run.id));
  if (run.serial.empty() || run.serial.size() > kLongestSerial ||
      run.serial.find('\0') != std::string::npos) {
    return Wrong("the serial number " + InWords(run.serial) + " has " +
                 std::to_string(run.serial.size()) + " bytes, expected 1 to " +
                 std::to_string(kLongestSerial) + " without NUL");
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(run.created));
  TRUETRIAD_RETURN_IF_ERROR(CheckRecorded(run));
  for (const std::string* const text : {&run.log, &run.folder}) {
    if (text->find('\0') != std::string::npos) return Wrong("a path has a NUL: " + InWords(*text));
  }
  for (const auto& [name, value] : {std::pair("wall_s", run.wall_s),
                                    {"cpu_s", run.cpu_s},
                                    {"effective_dof", run.effective_dof},
                                    {"log_bytes", static_cast<double>(run.log_bytes)}}) {
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(name, value, false));
  }
  for (const LimitCheck& check : run.judgements) {
    if (check.name.empty()) return Wrong("a judgement has no name");
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber(check.name, check.worst, true));
    TRUETRIAD_RETURN_IF_ERROR(CheckNumber("sigma of " + check.name, check.sigma, false));
  }
  TRUETRIAD_RETURN_IF_ERROR(CheckVerdict(run));
  return CheckParameters(run);
}

Status CheckStored(const Disposition& disposition) {
  TRUETRIAD_RETURN_IF_ERROR(CheckName(disposition.id));
  TRUETRIAD_RETURN_IF_ERROR(CheckName(disposition.run));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(disposition.created));
  const Status status = CheckDisposition(disposition);
  return status ? status : Status(Wrong(status.error().message));
}

Status CheckStored(const StationCheck& check) {
  TRUETRIAD_RETURN_IF_ERROR(CheckName(check.id));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(check.created));
  TRUETRIAD_RETURN_IF_ERROR(CheckTime(check.recorded, "recorded"));
  return check.station.empty() ? Status(Wrong("a check names no station")) : Status();
}

}  // namespace truetriad::fleet
