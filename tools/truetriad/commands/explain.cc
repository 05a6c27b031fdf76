// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "base/spelling.h"
#include "fleet/unit_run.h"
#include "report/table.h"
#include "tools/truetriad/command.h"
#include "tools/truetriad/flags.h"
#include "truetriad/base/result.h"
#include "truetriad/model/finding.h"

namespace truetriad {
namespace {

constexpr std::string_view kFindingsHead = R"(# Reasons

Printed by `truetriad explain`; `truetriad explain CODE` prints one code.

Findings are in `status.findings` of calibration.yaml and at the head of each report; [errors](#errors) leave no result. Codes are
never renamed. A *warning* may make the result worse than it looks; a *refusal* makes it unusable, and the first one sets
`status.outcome`. `treatment` is `corrected` or `widened` (σ allow for it).

| code | severity | what it means | what to do |
|---|---|---|---|
)";

constexpr std::string_view kErrorsHead = R"(
## Errors

Printed on stderr, and with `--json` as `error`, with the message and, if known, `file`, `line` and `column`.

| code | exit | what it means | what to do |
|---|---|---|---|
)";

constexpr std::string_view kRunsHead = R"(
## Units of a fleet

| code | operator | what it means | what to do |
|---|---|---|---|
)";

bool MayRefuse(const FindingKind& kind) { return kind.outcome != Outcome::kConverged; }

/// "warning", or "warning or refusal" for a kind that is a refusal in some runs.
std::string SeverityOf(const FindingKind& kind) {
  const bool depends = kind.severity != Severity::kRefusal && MayRefuse(kind);
  return depends ? "warning or refusal" : std::string(SeverityName(kind.severity));
}

std::string PageRow(std::string_view code,
                    const std::string& grade,
                    std::string_view meaning,
                    std::string_view remedy) {
  std::string row = "| `";
  row.append(code).append("` | ").append(grade).append(" | ").append(meaning).append(" | ");
  return row.append(remedy).append(" |\n");
}

/// The text of docs/reasons.md.
std::string Page() {
  std::string page(kFindingsHead);
  for (const FindingKind& kind : FindingKinds()) {
    page += PageRow(kind.name, SeverityOf(kind), kind.meaning, kind.remedy);
  }
  page += kErrorsHead;
  for (const ErrorInfo& info : AllErrorCodes()) {
    page +=
        PageRow(info.name, std::to_string(static_cast<int>(info.kind)), info.meaning, info.remedy);
  }
  page += kRunsHead;
  for (const fleet::RunCode& code : fleet::kRunCodes) {
    page += PageRow(code.name, std::string(code.operator_remedy), code.meaning, code.remedy);
  }
  return page;
}

std::string Paragraph(std::string_view name,
                      const std::string& grade,
                      std::string_view meaning,
                      std::string_view remedy) {
  std::string text = std::string(name) + ": " + grade + '\n' + Wrapped(std::string(meaning) + '.');
  if (!remedy.empty()) text += Wrapped("What to do: " + std::string(remedy) + '.');
  return text;
}

/// Explains `codes`, or all if there are none. A code can be that of a finding and of an error.
VerbResult Explained(const std::vector<std::string>& codes) {
  const auto is_asked = [&codes](std::string_view name) {
    return codes.empty() || std::find(codes.begin(), codes.end(), name) != codes.end();
  };
  VerbResult result{
      .result = {{"findings", Json::array()}, {"errors", Json::array()}, {"runs", Json::array()}}};
  for (const FindingKind& kind : FindingKinds()) {
    if (!is_asked(kind.name)) continue;
    result.text += Paragraph(kind.name, SeverityOf(kind), kind.meaning, kind.remedy);
    if (MayRefuse(kind)) {
      result.text += Wrapped("An operator: " + std::string(kind.operator_remedy) + '.');
    }
    result.result["findings"].push_back({{"code", kind.name},
                                         {"severity", SeverityName(kind.severity)},
                                         {"may_refuse", MayRefuse(kind)},
                                         {"meaning", kind.meaning},
                                         {"remedy", kind.remedy},
                                         {"operator_remedy", kind.operator_remedy}});
  }
  for (const ErrorInfo& info : AllErrorCodes()) {
    if (!is_asked(info.name)) continue;
    const int exit_code = static_cast<int>(info.kind);
    result.text += Paragraph(
        info.name, "error, exit code " + std::to_string(exit_code), info.meaning, info.remedy);
    result.result["errors"].push_back({{"code", info.name},
                                       {"exit", exit_code},
                                       {"meaning", info.meaning},
                                       {"remedy", info.remedy}});
  }
  for (const fleet::RunCode& code : fleet::kRunCodes) {
    if (!codes.empty() && std::ranges::none_of(codes, [&](const std::string& asked) {
          return fleet::RunCodeOf(asked) == &code;
        })) {
      continue;
    }
    result.text += Paragraph(code.name, "a unit of a fleet", code.meaning, code.remedy) +
                   Wrapped("An operator: " + std::string(code.operator_remedy) + '.');
    result.result["runs"].push_back({{"code", code.name},
                                     {"meaning", code.meaning},
                                     {"remedy", code.remedy},
                                     {"operator_remedy", code.operator_remedy}});
  }
  if (codes.empty()) result.text = Page();
  return result;
}

std::vector<std::string> AllCodes() {
  std::vector<std::string> codes = NamesOf(FindingKinds());
  std::ranges::move(NamesOf(AllErrorCodes()), std::back_inserter(codes));
  std::ranges::move(NamesOf(fleet::kRunCodes), std::back_inserter(codes));
  return codes;
}

Result<VerbResult> RunExplain(const std::vector<std::string>& codes) {
  const std::vector<std::string> known = AllCodes();
  for (const std::string& code : codes) {
    if (fleet::RunCodeOf(code) != nullptr || std::ranges::find(known, code) != known.end())
      continue;
    return Error(ErrorCode::kUnknownName,
                 "`" + code + "` is not a code" + DidYouMean(code, {known.begin(), known.end()}) +
                     "; `truetriad explain` lists them");
  }
  return Explained(codes);
}

}  // namespace

Command ExplainCommand() {
  return {
      .name = "explain",
      .summary = "What does a finding or an error mean, and what do I do about it?",
      .examples = R"(build/truetriad explain clock-offset unknown-key)",
      .details =
          R"(CODE stands behind each finding in reports, and is `code` in calibration.yaml and JSON. Without CODE
all codes are listed, as in docs/reasons.md.
)",
      .values = {{"code", AllCodes()}},
      .more_words = "code",
      .run = RunExplain};
}

}  // namespace truetriad
