#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Messages per CPU second of converters, from the start to the recording on disk. make_log.py writes
# the logs: MESSAGES (default 600000) samples of accelerometer and gyroscope, and a tenth as many of
# the magnetometer. Medians of RUNS (default 5).
#
#   tools/bench/convert_rate.sh [BUILD_FOLDER]       default: build
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
runs=${RUNS:-5}
messages=${MESSAGES:-600000}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

TIMEFORMAT='%3U %3S %3R'
printf '%-10s%10s%10s%10s%10s%16s   median of %d\n' format MB CPU/s wall/s Mmessages \
  Mmessages/CPUs "$runs"
for format in dataflash ros2-db3 ros1; do
  converter=$build/truetriad-convert-$format
  [[ -x $converter ]] || { echo "$converter is missing" >&2; continue; }
  tools/bench/make_log.py "$format" "$folder/log" "$messages"
  for ((run = 0; run < runs; ++run)); do
    { time "$converter" "$folder/log" --output="$folder/out" > /dev/null 2> "$folder/stderr"; } \
      2>> "$folder/times"
  done
  for columns in '$1 + $2' '$3'; do
    awk "{ print $columns }" "$folder/times" | sort -g |
      awk '{ value[NR] = $1 } END { print value[int((NR + 1) / 2)] }'
  done | paste -s -d ' ' |
    awk -v format="$format" -v bytes="$(stat -c %s "$folder/log")" -v n="$((messages * 11 / 10))" \
      '{ printf "%-10s%10.1f%10.2f%10.2f%10.2f%16.2f\n", format, bytes / 1e6, $1, $2, n / 1e6, n / 1e6 / $1 }'
  rm -rf "$folder/log" "$folder/out" "$folder/times"
done
