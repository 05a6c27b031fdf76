#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds everything and runs all tests but the nightly ones. Arguments go to ctest.
# With --nightly: the whole of the statistical tests instead, some minutes; further arguments go to
# tools/bench/accuracy.py.
set -euo pipefail
cd "$(dirname "$0")/.."

# Warnings are errors where it counts, and elsewhere nobody compiles twice after tools/demo.sh.
strict=OFF
[[ "${CI:-}" == true ]] && strict=ON
options=(-DTRUETRIAD_BUILD_TESTS=ON -DTRUETRIAD_WARNINGS_AS_ERRORS=$strict)
if [[ "${1:-}" == --nightly ]]; then
  tools/build.sh truetriad_statistical_test "${options[@]}"
  exec tools/bench/accuracy.py "${@:2}"
fi
tools/build.sh all "${options[@]}"
ctest --test-dir build --output-on-failure --parallel "$(nproc)" --label-exclude nightly "$@"
