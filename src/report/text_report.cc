// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "report/content.h"
#include "report/page.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {

Grade GradeOf(const Calibration& calibration) { return HeadlineOf(calibration).grade; }

std::string CalibrationText(const Calibration& calibration) {
  const Headline headline = HeadlineOf(calibration);
  std::string text = headline.text + '\n' + Wrapped(headline.explanation, 0) + '\n' +
                     TextOf(IdentityTable(calibration));
  for (const Section& section : SectionsOf(calibration)) {
    text += SectionText(section.title, section.blocks);
  }
  return text;
}

}  // namespace truetriad
