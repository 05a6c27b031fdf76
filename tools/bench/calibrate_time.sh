#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Time of a whole `truetriad calibrate` on the 38-pose Xsens recording, beside the least time in
# which any program could read that file. Medians of RUNS (default 25) interleaved runs. TILES
# (default 1): the recording is repeated this many times. RECORDING=pair adds the gyroscope's file.
#
#   tools/bench/calibrate_time.sh [BUILD_FOLDER]      default: build
#
# BUILD_FOLDER holds truetriad and parse_floor, see docs/performance.md. The recording is searched
# in $TRUETRIAD_SHARED_DATASETS (default: ../shared/datasets).
set -euo pipefail
# shellcheck source=tools/bench/recording.sh
source "$(dirname "$0")/recording.sh"
need "$build/tools/bench/parse_floor"

runs=${RUNS:-25}
tiles=${TILES:-1}
# Processes per timed run: a single process lasts only a few ticks of the clock.
repeats=$((tiles < 10 ? 10 : 1))
tile "$tiles"

touch_bytes() { "$build/tools/bench/parse_floor" touch "${files[@]/#/$folder/}"; }
parse_numbers() { "$build/tools/bench/parse_floor" parse "${files[@]/#/$folder/}"; }
start_only() { "$build/truetriad" version; }
calibrate() {
  "$build/truetriad" calibrate --config="$experiment" --input="$folder/recording.yaml" \
    --output="$folder/out" --report=false
}
programs=(touch_bytes parse_numbers start_only calibrate)

repeat() {
  for ((i = 0; i < repeats; ++i)); do "$1" > "$folder/stdout"; done
}

for program in "${programs[@]}"; do repeat "$program"; done  # Fills the page cache.
TIMEFORMAT='%3U %3S %3R'
for ((run = 0; run < runs; ++run)); do
  for program in "${programs[@]}"; do
    { time repeat "$program" 2> "$folder/stderr"; } 2>> "$folder/$program"
  done
done

# median COLUMNS FILE: the median of the awk expression COLUMNS over the rows, in ms per process.
median() {
  awk "{ print 1e3 * ($1) / $repeats }" "$2" | sort -g | awk '{ value[NR] = $1 }
    END { print (value[int((NR + 1) / 2)] + value[int(NR / 2) + 1]) / 2 }'
}
printf '%s bytes; ms a process, median of %d runs of %d\n' \
  "$(stat -c %s "${files[@]/#/$folder/}" | awk '{ sum += $1 } END { print sum }')" \
  "$runs" "$repeats"
printf '%-14s %16s %10s\n' program 'CPU (user+sys)' wall
for program in "${programs[@]}"; do
  printf '%-14s %16.1f %10.1f\n' "$program" "$(median '$1 + $2' "$folder/$program")" \
    "$(median '$3' "$folder/$program")"
done
