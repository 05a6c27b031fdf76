#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Rows per CPU second of a whole `truetriad simulate` with one thread. A row has time, nine axes and
# temperature, at 1 kHz as CSV; every axis has white noise, bias instability and random walk. Three
# scenarios take turns: the unit rests most of the time; the same with temperature terms in a
# ramping chamber; the unit tumbles all the time. Medians of RUNS (default 7).
#
#   tools/bench/simulate_rate.sh [BUILD_FOLDER]       default: build
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:-build}
runs=${RUNS:-7}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
[[ -x $build/truetriad ]] || { echo "$build/truetriad is missing; run tools/build.sh" >&2; exit 1; }

cat > "$folder/rests.yaml" <<END
scenario: 1
base: $PWD/configs/scenarios/consumer-9dof.yaml
sensors:
  accelerometer: { noise: { bias_random_walk_ug_rts: 0.5 }, sampling: { rate_hz: 1000 } }
  gyroscope: { noise: { bias_random_walk_degps_rts: 1.0e-5 }, sampling: { rate_hz: 1000 } }
  magnetometer:
    noise: { bias_instability_ut: 0.05, correlation_time_s: 100, bias_random_walk_ut_rts: 0.001 }
    sampling: { rate_hz: 1000 }
motion: [{ poses: { attitudes: { spread: 24 }, rest_s: 60, move_s: 2, travel_m: 0.2 } }]
END
cat > "$folder/thermal.yaml" <<END
$(cat "$folder/rests.yaml")
temperature:
  profile: [{ ramp: { to_degc: 60, rate_degc_min: 1.4 } }]
  element_lag_s: 30
  thermometer_lag_s: 60
  thermometer_noise_degc: 0.02
END
sed -i '/^sensors:/,/^motion:/ {
  s/accelerometer: {/accelerometer: { thermal: { bias_mg_degc: 0.5, scale_ppm_degc: 100 },/
  s/gyroscope: {/gyroscope: { thermal: { bias_degps_degc: 0.01, scale_ppm_degc: 200 },/
}' "$folder/thermal.yaml"
sed 's/^motion:.*/motion: [{ tumble: { duration_s: 1486, rms_rate_degps: 90 } }]/' \
  "$folder/rests.yaml" > "$folder/tumbling.yaml"

simulate() {
  "$build/truetriad" simulate --threads=1 --config="$folder/$1.yaml" --output="$folder/$1" \
    > "$folder/stdout"
}
names=(rests thermal tumbling)
for name in "${names[@]}"; do simulate "$name"; done
TIMEFORMAT='%3U %3S %3R'
for ((run = 0; run < runs; ++run)); do
  for name in "${names[@]}"; do { time simulate "$name"; } 2>> "$folder/$name.times"; done
done
printf '%10s%10s%10s%10s%12s   median of %d\n' CPU/s wall/s Mrows MB Mrows/CPUs "$runs"
for name in "${names[@]}"; do
  csv=$folder/$name/recording.csv
  rows=$(($(wc -l < "$csv") - 2)) bytes=$(stat -c %s "$csv")
  for columns in '$1 + $2' '$3'; do
    awk "{ print $columns }" "$folder/$name.times" | sort -g |
      awk '{ value[NR] = $1 } END { print value[int((NR + 1) / 2)] }'
  done | awk -v rows="$rows" -v bytes="$bytes" -v name="$name" '
    NR == 1 { cpu = $1 }
    NR == 2 { printf "%10.2f%10.2f%10.2f%10.1f%12.2f   %s\n", cpu, $1, rows / 1e6, bytes / 1e6, rows / 1e6 / cpu, name }'
done
