#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Time of a whole `truetriad allan` on two logs: the 2.8 hours of the ADIS16405 (1 M samples of six
# axes, from gzip), and 1.44 M samples of one triad as plain CSV. `truetriad inspect` on the second
# log shows what reading alone takes. Medians of RUNS (default 9).
#
#   tools/bench/allan_time.sh [BUILD_FOLDER]          default: build
#
# The first log is searched in $TRUETRIAD_SHARED_DATASETS (default: ../shared/datasets).
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
datasets=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}
runs=${RUNS:-9}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for file in "$build/truetriad" "$datasets/d-adis16405-static-2p8h/adis_16405_imu4_counts.csv.gz"; do
  [[ -r $file ]] || { echo "$file is missing; see docs/performance.md" >&2; exit 1; }
done

sed "s|../../../shared/datasets|$(realpath "$datasets")|" configs/recordings/adis16405-static.yaml \
  > "$folder/adis.yaml"
awk 'BEGIN {
  srand(1); print "time[s],gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s]"
  for (i = 0; i < 1440000; ++i)
    printf "%.2f,%.5f,%.5f,%.5f\n", i / 100, rand() + rand() - 1, rand() + rand(), rand() - rand()
}' > "$folder/plain.csv"

# median NAME COMMAND...: prints the medians of CPU and wall time in ms, and NAME.
median() {
  local name=$1; shift
  "$@" > "$folder/stdout"
  TIMEFORMAT='%3U %3S %3R'
  for ((run = 0; run < runs; ++run)); do
    { time "$@" > "$folder/stdout" 2> "$folder/stderr"; } 2>> "$folder/$name"
  done
  for columns in '$1 + $2' '$3'; do
    awk "{ print 1e3 * ($columns) }" "$folder/$name" | sort -g |
      awk '{ value[NR] = $1 } END { printf "%10.0f", value[int((NR + 1) / 2)] }'
  done
  printf '   %s\n' "$name"
}
printf '%10s%10s   ms, median of %d\n' CPU wall "$runs"
median inspect-1.44M-rows-csv "$build/truetriad" inspect --input="$folder/plain.csv"
median allan-1.44M-rows-csv "$build/truetriad" allan --input="$folder/plain.csv" --output="$folder/a"
median allan-adis-1M-rows-gz "$build/truetriad" allan --input="$folder/adis.yaml" --output="$folder/b"
