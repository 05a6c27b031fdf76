// SPDX-License-Identifier: Apache-2.0
#include "truetriad/base/result.h"

namespace truetriad {

std::string Version() { return TRUETRIAD_VERSION; }

}  // namespace truetriad
