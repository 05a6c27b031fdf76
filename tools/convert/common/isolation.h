// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "truetriad/base/result.h"

namespace truetriad::convert {

/// Does `work` in a process of its own, with a bound on its memory, for libraries that a damaged
/// file can bring down. Its error becomes that of this process; a crash becomes bad input.
Status Isolated(const std::vector<std::string>& paths, const std::function<Status()>& work);

}  // namespace truetriad::convert
