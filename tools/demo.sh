#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds build/truetriad and calibrates a shipped recording with it.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/build.sh truetriad
build/truetriad calibrate --config=configs/experiments/joint.yaml --output=out/demo
echo "Compare with the truth: build/truetriad compare datasets/demo/truth.yaml out/demo/calibration.yaml"
echo "Open out/demo/report.html in a browser. More verbs: build/truetriad help"
