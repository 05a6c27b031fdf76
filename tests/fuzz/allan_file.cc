// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_file.h"

#include "fuzz/fuzz_target.h"

using namespace truetriad;  // NOLINT: of this source alone.

TRUETRIAD_FUZZ_TARGET(allan_file) {
  const Result<AllanResult> result =
      ReadAllanFile(fuzz::WriteInput("allan.yaml", fuzz::TextOf(input)));
  if (!result) {
    fuzz::MustSay(result.error());
    return 0;
  }
  const std::string written = AllanToYaml(*result);
  const Result<AllanResult> again = ReadAllanFile(fuzz::WriteInput("again.yaml", written));
  fuzz::Must(again.has_value(),
             "what was written can be read",
             again ? written : again.error().message + "\n" + written);
  fuzz::Must(AllanToYaml(*again) == written, "allan.yaml reads back to the same bits", written);
  return 0;
}
