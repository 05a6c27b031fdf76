// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/model/finding.h"

namespace truetriad {

// `status.findings`, and beside it their texts as `status.messages`, which is all that readers of
// version 1 files knew once.
void WriteFindings(YamlText& out, const Findings& findings);

// Both of `status`. A file without findings has messages alone: each is a finding of the code
// `message`; where nothing can be used, any of them may be why.
void ReadFindings(YamlReader* status, Outcome outcome, Findings* findings);

}  // namespace truetriad
