// SPDX-License-Identifier: Apache-2.0
#include "truetriad/base/version.h"

#include <cstdio>

#include "tools/truetriad/command.h"
#include "truetriad/session/session.h"

namespace truetriad {
namespace {

Result<VerbResult> RunVersion(const std::vector<std::string>&) {
  return VerbResult{.text = "truetriad " + Version() + '\n', .result = {{"version", Version()}}};
}

}  // namespace

Command VersionCommand() {
  return {.name = "version",
          .summary = "Which version is this?",
          .examples = "build/truetriad version",
          .run = RunVersion};
}

}  // namespace truetriad
