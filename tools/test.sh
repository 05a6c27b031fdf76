#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds everything and runs all tests but the nightly ones. Arguments go to ctest.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/build.sh all -DTRUETRIAD_BUILD_TESTS=ON -DTRUETRIAD_WARNINGS_AS_ERRORS=ON
ctest --test-dir build --output-on-failure --parallel "$(nproc)" --label-exclude nightly "$@"
