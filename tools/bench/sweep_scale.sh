#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Time and peak memory of a temperature sweep's calibration and of `inspect` on the same log. Logs
# of growing length have nine axes and a temperature at 1 kHz.
#
#   tools/bench/sweep_scale.sh [BUILD_FOLDER]     default: build
#   MINUTES="50 220 840" tools/bench/sweep_scale.sh
#
# Needs GNU time (Debian: time) and, in $TMPDIR, 5 MB per minute of the longest log.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
build=${1:-build}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for program in /usr/bin/time "$build/truetriad"; do
  [[ -x $program ]] || { echo "$program is missing; see docs/performance.md" >&2; exit 1; }
done

# Writes a scenario of $1 minutes: from -20 to 60 degC and back at a slow rate, then at a fast one.
scenario() {
  awk -v minutes="$1" -v folder="$PWD" 'BEGIN {
    slow = 80 / (0.6 * minutes); fast = 80 / (0.3 * minutes)
    printf "scenario: 1\nbase: %s/configs/scenarios/consumer-9dof.yaml\n", folder
    printf "device: { serial: S0001 }\nsensors:\n"
    printf "  accelerometer: { thermal: { bias_mg_degc: 0.5 }, sampling: { rate_hz: 1000 } }\n"
    printf "  gyroscope: { thermal: { bias_degps_degc: 0.01 }, sampling: { rate_hz: 1000 } }\n"
    printf "  magnetometer: { sampling: { rate_hz: 1000 } }\n"
    printf "motion:\n  - poses: { attitudes: { spread: 1 }, rest_s: %.0f, move_s: 2 }\n", 60 * minutes
    printf "temperature:\n  start_degc: -20\n  profile:\n"
    for (i = 0; i < 2; ++i) {
      rate = i == 0 ? slow : fast
      printf "    - ramp: { to_degc: 60, rate_degc_min: %.6f }\n", 2 * rate
      printf "    - ramp: { to_degc: -20, rate_degc_min: %.6f }\n", 2 * rate
    }
    printf "  thermometer_lag_s: 5\n  element_lag_s: 5\n"
    printf "  thermometer_noise_degc: 0.02\n  thermometer_resolution_degc: 0.01\n"
  }' > "$folder/scenario.yaml"
}

cat > "$folder/experiment.yaml" <<'EOF'
experiment: 1
device: { serial: S0001 }
sensors:
  accelerometer: { thermal: { bias_order: 3, rate: auto } }
  gyroscope: { thermal: { bias_order: 3, rate: auto } }
  magnetometer: { thermal: { bias_order: 3, rate: auto } }
poses: { sweep: auto }
EOF

# measure COMMAND...: prints CPU seconds, wall seconds and peak resident MB.
measure() {
  /usr/bin/time -f '%U %S %e %M' -o "$folder/time" "$@" > "$folder/stdout" 2> "$folder/stderr" ||
    { cat "$folder/stderr" >&2; exit 1; }
  awk '{ printf "%8.2f %8.2f %8.1f", $1 + $2, $3, $4 / 1024 }' "$folder/time"
}

printf '%10s %8s | %26s | %26s | %s\n' rows MB 'inspect: CPU s, wall, MB' \
  'calibrate: CPU s, wall, MB' 'CPU of calibrate / inspect'
for minutes in ${MINUTES:-50 220}; do
  scenario "$minutes"
  "$build/truetriad" simulate --config="$folder/scenario.yaml" --output="$folder/log" \
    > "$folder/stdout" 2> "$folder/stderr" || { cat "$folder/stderr" >&2; exit 1; }
  size=$(stat -c %s "$folder"/log/*.csv | awk '{ sum += $1 } END { printf "%.0f", sum / 1e6 }')
  inspect=$(measure "$build/truetriad" inspect --input="$folder/log/recording.yaml")
  calibrate=$(measure "$build/truetriad" calibrate --config="$folder/experiment.yaml" \
    --input="$folder/log/recording.yaml" --output="$folder/out" --report=false)
  ratio=$(awk -v a="$calibrate" -v b="$inspect" \
    'BEGIN { split(a, x, " "); split(b, y, " "); printf "%.2f", x[1] / y[1] }')
  printf '%10d %8d | %26s | %26s | %s\n' "$((minutes * 60000))" "$size" "$inspect" "$calibrate" "$ratio"
  rm -rf "$folder/log" "$folder/out"
done
