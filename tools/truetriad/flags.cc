// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/flags.h"

DEFINE_string(input, "", "the log: a self-describing CSV (also .gz) or a manifest recording.yaml");
DEFINE_string(output, "", "what to write");
DEFINE_string(config,
              "",
              "the experiment file; all its keys are in configs/experiments/joint.yaml");
DEFINE_string(calibration, "", "calibration.yaml as `calibrate` writes it");
DEFINE_string(poses,
              "",
              "where the poses are: detect, every_row, every:N, column:NAME or file:PATH (default: "
              "what the recording states, else detect)");
