// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gflags/gflags.h>

// Flags that several verbs share; gflags stops the program at a second definition.
DECLARE_string(input);
DECLARE_string(output);
DECLARE_string(config);
DECLARE_string(calibration);
DECLARE_string(poses);
