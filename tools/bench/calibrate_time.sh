#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Time of a whole `truetriad calibrate` on the 38-pose Xsens recording, against the least that any
# program could take to read that file. Medians of RUNS (default 25) interleaved runs.
#
#   tools/bench/calibrate_time.sh [BUILD_FOLDER]      default: build
#
# The folder holds truetriad and parse_floor, see docs/performance.md. The recording is looked for
# in $TRUETRIAD_SHARED_DATASETS (default: ../shared/datasets).
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
runs=${RUNS:-25}
repeats=10  # Processes a timed run: one alone lasts only a few ticks of the clock.
datasets=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}
log=$datasets/a-xsens-imu-tk-38pose/xsens_acc.mat
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

for needed in "$build/truetriad" "$build/tools/bench/parse_floor" "$log"; do
  [[ -r $needed ]] || { echo "$needed is missing; see docs/performance.md" >&2; exit 1; }
done
# The manifest of the repository, with the place where the recording really is.
sed "s|file: .*xsens_acc.mat|file: $(realpath "$log")|" configs/recordings/xsens-imu-tk.yaml \
  > "$folder/recording.yaml"

touch_bytes() { "$build/tools/bench/parse_floor" touch "$log"; }
parse_numbers() { "$build/tools/bench/parse_floor" parse "$log"; }
start_only() { "$build/truetriad" version; }
calibrate() {
  "$build/truetriad" calibrate --config=configs/experiments/recordings/xsens-imu-tk.yaml \
    --input="$folder/recording.yaml" --output="$folder/out" --report=false
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

# median COLUMNS FILE: middle of the sums of these awk columns, in ms a process.
median() {
  awk "{ print 1e3 * ($1) / $repeats }" "$2" | sort -g | awk '{ value[NR] = $1 }
    END { print (value[int((NR + 1) / 2)] + value[int(NR / 2) + 1]) / 2 }'
}
printf '%-14s %14s %10s   ms a process, median of %d runs of %d\n' program 'CPU (user+sys)' wall \
  "$runs" "$repeats"
for program in "${programs[@]}"; do
  printf '%-14s %14.2f %10.2f\n' "$program" "$(median '$1 + $2' "$folder/$program")" \
    "$(median '$3' "$folder/$program")"
done
