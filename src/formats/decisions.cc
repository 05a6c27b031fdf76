// SPDX-License-Identifier: Apache-2.0
#include "formats/decisions.h"

#include <filesystem>
#include <optional>
#include <system_error>

#include "base/utf8.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

constexpr std::string_view kFormat = "truetriad/decisions/1";
constexpr char kFile[] = "decisions.yaml";

Result<std::vector<Decision>> ReadDecisions(const std::filesystem::path& path) {
  std::vector<Decision> decisions;
  std::error_code failure;
  // What cannot be looked at may hold a refusal: reading it says why.
  if (!std::filesystem::exists(path, failure) && !failure) return decisions;
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, LookAtSmallFile(path.string()));
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader root, YamlReader::FromText(text, path.string()));
  std::string format;
  if (root.Require("format", &format) && format != kFormat) {
    root.Child("format").Fail("`" + format + "` is not supported; expected " +
                              std::string(kFormat));
  }
  for (YamlReader& item : root.RequireChild("decisions").Items()) {
    Decision& decision = decisions.emplace_back();
    std::string verdict;
    if (item.Require("verdict", &verdict)) {
      const std::optional<Verdict> known = VerdictFromName(verdict);
      if (known == Verdict::kPass || known == Verdict::kFail)
        decision.verdict = *known;
      else
        item.Child("verdict").Fail("`" + verdict + "` is not a decision; expected PASS or FAIL");
    }
    item.Require("who", &decision.who);
    item.Require("why", &decision.why);
    item.Require("created", &decision.created);
    item.RejectUnknown();
  }
  root.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(root.status());
  return decisions;
}

}  // namespace

std::string DecisionText(const Decision& decision) {
  return PrintableLine(std::string(VerdictName(decision.verdict)) + " by " + decision.who + " on " +
                       decision.created + ": " + decision.why);
}

Result<std::vector<Decision>> ReadDecisionsBeside(const std::string& calibration_file) {
  // A link from elsewhere leads to the unit's own folder.
  std::error_code failure;
  const std::filesystem::path real = std::filesystem::canonical(calibration_file, failure);
  return ReadDecisions((failure ? std::filesystem::path(calibration_file) : real).parent_path() /
                       kFile);
}

Status AddDecision(const std::string& folder, const Decision& decision) {
  const std::filesystem::path path = std::filesystem::path(folder) / kFile;
  TRUETRIAD_ASSIGN_OR_RETURN(std::vector<Decision> decisions, ReadDecisions(path));
  decisions.push_back(decision);
  YamlText out;
  out << "format: " << kFormat << "\ndecisions:\n";
  for (const Decision& one : decisions) {
    out << "  - { verdict: " << VerdictName(one.verdict) << ", who: " << Quoted{one.who}
        << ", why: " << Quoted{one.why} << ", created: " << Quoted{one.created} << " }\n";
  }
  return WriteFileAtomically(path.string(), out.str());
}

}  // namespace truetriad
