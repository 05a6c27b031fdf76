#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Peak memory of `truetriad inspect` and `calibrate` on the 38-pose Xsens recording, and on the
# same recording 20 and 100 times in a row.
#
#   tools/bench/memory_flatness.sh [BUILD_FOLDER]     default: build
#
# Needs GNU time, and 350 MB in $TMPDIR. The recording is looked for in $TRUETRIAD_SHARED_DATASETS
# (default: ../shared/datasets).
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
datasets=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}
log=$datasets/a-xsens-imu-tk-38pose/xsens_acc.mat
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

for needed in "$build/truetriad" "$log" /usr/bin/time; do
  [[ -r $needed ]] || { echo "$needed is missing; see docs/performance.md" >&2; exit 1; }
done

# tile TIMES: the recording TIMES in a row, time going on.
tile() {
  awk -v times="$1" '
    { time[NR] = $1; rest[NR] = $2 " " $3 " " $4 }
    END {
      period = time[NR] - time[1] + 0.01
      for (tile = 0; tile < times; ++tile)
        for (i = 1; i <= NR; ++i) printf "%.6f %s\n", time[i] + tile * period, rest[i]
    }' "$log" > "$folder/tiled.txt"
}

# peak COMMAND...: largest resident memory in MB.
peak() {
  /usr/bin/time -f %M -o "$folder/peak" "$@" > "$folder/stdout" &&
    awk '{ printf "%.1f", $1 / 1024 }' "$folder/peak"
}

sed 's|file: .*xsens_acc.mat|file: tiled.txt|' configs/recordings/xsens-imu-tk.yaml \
  > "$folder/recording.yaml"
printf '%6s %10s %14s %16s   peak resident memory\n' tiles 'file [MB]' 'inspect [MB]' 'calibrate [MB]'
for times in 1 20 100; do
  tile "$times"
  size=$(stat -c %s "$folder/tiled.txt" | awk '{ print $1 / 1e6 }')
  inspect=$(peak "$build/truetriad" inspect --input="$folder/recording.yaml")
  calibrate=$(peak "$build/truetriad" calibrate --input="$folder/recording.yaml" --report=false \
    --config=configs/experiments/recordings/xsens-imu-tk.yaml --output="$folder/out")
  printf '%6d %10.1f %14s %16s\n' "$times" "$size" "$inspect" "$calibrate"
done
