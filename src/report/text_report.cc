// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "report/content.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {

Grade GradeOf(const Calibration& calibration) { return VerdictOf(calibration).grade; }

std::string CalibrationText(const Calibration& calibration) {
  const Verdict verdict = VerdictOf(calibration);
  std::string text = verdict.headline + '\n' + Wrapped(verdict.explanation, 0) + '\n' +
                     TextOf(IdentityTable(calibration));
  for (const Section& section : SectionsOf(calibration)) {
    text += SectionText(section.title, section.blocks);
  }
  return text;
}

}  // namespace truetriad
