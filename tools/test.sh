#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds everything and runs all tests but the nightly ones. Arguments go to ctest.
set -euo pipefail
cd "$(dirname "$0")/.."

# Warnings are errors where it counts, and elsewhere nobody compiles twice after tools/demo.sh.
strict=OFF
[[ "${CI:-}" == true ]] && strict=ON
tools/build.sh all -DTRUETRIAD_BUILD_TESTS=ON -DTRUETRIAD_WARNINGS_AS_ERRORS=$strict
ctest --test-dir build --output-on-failure --parallel "$(nproc)" --label-exclude nightly "$@"
