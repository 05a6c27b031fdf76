// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/messages.h"
#include "report/content.h"
#include "report/format.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/calibrate/side_by_side.h"
#include "truetriad/report/report.h"

namespace truetriad {
namespace {

std::string WordsOf(const ErrorOfTwo& error, const SideBySide& both) {
  if (error.name == "accelerometer") return "Accelerometer, off gravity";
  if (error.name == "accelerometer-spread") return "Accelerometer, about its mean";
  if (error.name == "magnetometer") return "Magnetometer, off the field";
  if (error.name == "magnetometer-spread") return "Magnetometer, about its mean";
  if (error.name == "angle") return "Angle, field to gravity";
  if (error.name == "gyroscope") return "Gyroscope, at rest";
  return both.a.turns->against == Triad::kMagnetometer ? "Field after a turn"
                                                       : "Gravity after a turn";
}

std::string Times(const ErrorOfTwo& error) { return Significant(error.times(), 3) + " times"; }

// "37 times as large (Gyroscope, at rest)", the most of the errors in which this one is better.
std::string MostOf(const SideBySide& both, Better better) {
  const ErrorOfTwo* most = nullptr;
  for (const ErrorOfTwo& error : both.errors) {
    if (error.better != better) continue;
    if (most == nullptr || error.times() > most->times()) most = &error;
  }
  return Times(*most) + " as large (" + WordsOf(*most, both) + ")";
}

Headline HeadlineFor(const SideBySide& both) {
  std::string explanation;
  for (const auto& [evaluation, name] : {std::pair(&both.a, "A"), std::pair(&both.b, "B")}) {
    if (evaluation->is_own) {
      explanation += (explanation.empty() ? "" : " ") + std::string(name) +
                     " was made from this recording, which flatters it; evaluate both on another.";
    }
  }
  const std::string poses = Counted(both.a.poses, "pose");
  switch (BetterOf(both)) {
    case Better::kA:
      return {
          both.a.is_own ? Grade::kCaution : Grade::kGood,
          "A IS BETTER on these " + poses + ": B's errors are up to " + MostOf(both, Better::kA),
          explanation};
    case Better::kB:
      return {
          both.b.is_own ? Grade::kCaution : Grade::kBad,
          "B IS BETTER on these " + poses + ": A's errors are up to " + MostOf(both, Better::kB),
          explanation};
    case Better::kMixed:
      return {Grade::kCaution,
              "EACH IS BETTER in something on these " + poses + ": B's errors are up to " +
                  MostOf(both, Better::kA) + ", A's up to " + MostOf(both, Better::kB),
              explanation};
    case Better::kNeither:
      break;
  }
  return {Grade::kNeutral,
          both.errors.empty()
              ? "NOT COMPARED: the recording has no poses of a sensor that both have"
              : "NO DIFFERENCE by more than chance and a tenth on these " + poses,
          explanation};
}

PageContent ContentOf(const SideBySide& both, const std::vector<std::string>& about) {
  PageContent content{"Two calibrations side by side", HeadlineFor(both), {}};
  Section head{"", {about.begin(), about.end()}};
  for (const Triad triad : kTriads) {
    const bool in_a = both.a.norm_rms[triad].has_value();
    if (in_a == both.b.norm_rms[triad].has_value()) continue;
    head.Add("NOT COMPARED: " + std::string(TriadName(triad)) + ", which " + (in_a ? "B" : "A") +
             " does not have.");
  }
  content.sections.push_back(std::move(head));
  if (both.errors.empty()) return content;
  Table table = Headed("RMS error; A; B; unit; of; better", "lrrlrl");
  for (const ErrorOfTwo& error : both.errors) {
    table.Add() << WordsOf(error, both) << Significant(error.a, 3) << Significant(error.b, 3)
                << DisplayUnit(error.unit)
                << Counted(error.count, error.name == "turn" ? "turn" : "pose")
                << (error.better == Better::kNeither
                        ? "–"
                        : (error.better == Better::kA ? "A, " : "B, ") + Times(error));
  }
  std::string held = "Lengths are compared with gravity of " + Significant(both.gravity_mps2, 6) +
                     " " + TruthUnit(Triad::kAccelerometer);
  if (both.field_ut) {
    held += " and a field of " + Significant(*both.field_ut, 4) + " " +
            TruthUnit(Triad::kMagnetometer) +
            ", which is that of another place unless the recording was taken where the "
            "calibration was: it decides nothing, the length about its mean does";
  }
  content.sections.push_back(
      {"Errors on these poses",
       {std::move(table),
        held + ".",
        "Better: smaller by a tenth and by more than chance (1 in 1000), the poses being the same "
        "for both."}});
  return content;
}

}  // namespace

VerbReport ReportOf(const SideBySide& both, const std::vector<std::string>& about) {
  return ReportOf(ContentOf(both, about));
}

}  // namespace truetriad
