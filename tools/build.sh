#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Usage: tools/build.sh [TARGET]...
# Installs what is missing and builds the targets (default: everything) in build/, optimised. Demo
# and tests share that folder and its options, so that nothing is compiled twice.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install.sh
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
  export CCACHE_SLOPPINESS=pch_defines,time_macros  # Without it precompiled headers never hit.
fi
cmake -S . -B build -G Ninja --log-level=WARNING -DCMAKE_BUILD_TYPE=Release \
  -DTRUETRIAD_BUILD_TESTS=ON -DTRUETRIAD_WARNINGS_AS_ERRORS=ON
cmake --build build --parallel "$(nproc)" --target "${@:-all}"
