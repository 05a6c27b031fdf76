// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <gflags/gflags.h>

// Flags that the verbs of `fleet` share.
DECLARE_string(store);
DECLARE_string(where);
DECLARE_bool(csv);

namespace truetriad {

/// What `fleet run` starts itself as, once a process; not for people.
inline constexpr std::string_view kFleetWorker = "fleet-worker";

}  // namespace truetriad
