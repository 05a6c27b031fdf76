// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <gflags/gflags.h>

// A flag that the verbs of `fleet` share.
DECLARE_string(store);

namespace truetriad {

/// What `fleet run` starts itself as, once a process; not for people.
inline constexpr std::string_view kFleetWorker = "fleet-worker";

}  // namespace truetriad
