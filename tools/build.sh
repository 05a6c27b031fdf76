#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Usage: tools/build.sh TARGET [CMAKE_OPTION]...
# Installs what is missing and builds the target in build/, or in the folder that the variable
# TRUETRIAD_BUILD_FOLDER names, optimised. An option that is not given stays as it is, so that demo
# and tests share compiled files.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install.sh
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
  export CCACHE_SLOPPINESS=pch_defines,time_macros  # Without this, precompiled headers miss the cache.
fi
folder=${TRUETRIAD_BUILD_FOLDER:-build}
cmake -S . -B "$folder" -G Ninja --log-level=WARNING -DCMAKE_BUILD_TYPE=Release "${@:2}"
cmake --build "$folder" --parallel "$(nproc)" --target "$1"
