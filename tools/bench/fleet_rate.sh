#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What a unit costs in `truetriad fleet run`, from CSV to the store: CPU time (user and system, of
# all processes) with one worker and with two, beside the bare parse of the unit's bytes; and peak
# memory with a tenth of the units and with all. UNITS (default 2000) nine-axis units have 24 poses
# at 100 Hz, 1.4 MB each. SIMULATED (default 100) of them differ; the others are links to these.
# Medians of RUNS (default 3) interleaved runs. FLAGS: further flags of `fleet run`.
#
#   tools/bench/fleet_rate.sh [BUILD_FOLDER]          default: build
#
# BUILD_FOLDER holds truetriad and parse_floor, see docs/performance.md. Needs GNU time (Debian:
# time) and 150 MB in $TMPDIR.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
units=${UNITS:-2000}
simulated=${SIMULATED:-100}
runs=${RUNS:-3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for program in "$build/truetriad" "$build/tools/bench/parse_floor" /usr/bin/time; do
  [[ -x $program ]] || { echo "$program is missing; see docs/performance.md" >&2; exit 1; }
done

((simulated <= units)) || simulated=$units
rates=
for sensor in accelerometer gyroscope magnetometer; do
  rates+=",sensors.$sensor.sampling.rate_hz=100"
done
"$build/truetriad" simulate -c configs/scenarios/fleet.yaml --set="count=$simulated$rates" \
  --set='motion=[{poses: {attitudes: {spread: 24}, rest_s: 6, rest_spread: 0.15, move_s: 1.2, travel_m: 0.2}}]' \
  --output="$folder/simulated" > "$folder/stdout"
logs=("$folder"/simulated/*/recording.csv)
mkdir "$folder/line"
for ((i = 0; i < units; ++i)); do
  ln "${logs[i % simulated]}" "$folder/line/$(printf 'u%06d.csv' "$i")"
done
ls "$folder"/line/*.csv | sed -n "1ilog
1,$((units / 10))p" > "$folder/tenth.csv"

# timed NAME COMMAND...: runs the command and adds "CPU_S PEAK_MB" to NAME.times.
timed() {
  local name=$1
  shift
  /usr/bin/time -f '%U %S %M' -o "$folder/time" "$@" > "$folder/stdout" 2> "$folder/stderr"
  awk '{ print $1 + $2, $3 / 1024 }' "$folder/time" >> "$folder/$name.times"
}
fleet() {
  rm -rf "$folder/day"
  # shellcheck disable=SC2086
  timed "$1" "$build/truetriad" fleet run "$2" --jobs="$3" --output="$folder/day" --quiet ${FLAGS:-}
}

for ((run = 0; run < runs; ++run)); do
  timed parse "$build/tools/bench/parse_floor" parse "${logs[@]}"
  fleet one "$folder/line" 1
  fleet two "$folder/line" 2
  fleet tenth "$folder/tenth.csv" 1
done

median() {
  awk "{ print \$$1 }" "$folder/$2.times" | sort -g |
    awk '{ value[NR] = $1 } END { print value[int((NR + 1) / 2)] }'
}
parse=$(median 1 parse | awk -v n="$simulated" '{ print 1e3 * $1 / n }')
printf '%d units of %s bytes, median of %d runs\n' "$units" "$(stat -c %s "${logs[0]}")" "$runs"
printf '%-22s %10s %10s %10s\n' '' 'CPU [ms]' 'of parse' 'peak [MB]'
printf '%-22s %10.2f %10.2f\n' 'bare parse' "$parse" 1
row() {
  median 1 "$1" | awk -v n="$3" -v parse="$parse" -v what="$2" -v peak="$(median 2 "$1")" \
    '{ printf "%-22s %10.2f %10.2f %10.1f\n", what, 1e3 * $1 / n, 1e3 * $1 / n / parse, peak }'
}
row one 'one worker' "$units"
row two 'two workers' "$units"
row tenth 'a tenth of the units' "$((units / 10))"
