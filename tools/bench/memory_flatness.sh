#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Peak memory of `truetriad inspect` and `calibrate` on the 38-pose Xsens recording, and on this
# recording repeated 20 and 100 times.
#
#   tools/bench/memory_flatness.sh [BUILD_FOLDER]     default: build
#
# Needs GNU time (Debian: time) and 350 MB in $TMPDIR. The recording is searched in
# $TRUETRIAD_SHARED_DATASETS (default: ../shared/datasets).
set -euo pipefail
# shellcheck source=tools/bench/recording.sh
source "$(dirname "$0")/recording.sh"
need /usr/bin/time

# peak COMMAND...: prints the largest resident memory in MB.
peak() {
  /usr/bin/time -f %M -o "$folder/peak" "$@" > "$folder/stdout" &&
    awk '{ printf "%.1f", $1 / 1024 }' "$folder/peak"
}

printf '%6s %10s %14s %16s   peak resident memory\n' tiles 'file [MB]' 'inspect [MB]' 'calibrate [MB]'
for tiles in 1 20 100; do
  tile "$tiles"
  size=$(stat -c %s "${files[@]/#/$folder/}" | awk '{ sum += $1 } END { print sum / 1e6 }')
  inspect=$(peak "$build/truetriad" inspect --input="$folder/recording.yaml")
  calibrate=$(peak "$build/truetriad" calibrate --config="$experiment" \
    --input="$folder/recording.yaml" --output="$folder/out" --report=false)
  printf '%6d %10.1f %14s %16s\n' "$tiles" "$size" "$inspect" "$calibrate"
done
