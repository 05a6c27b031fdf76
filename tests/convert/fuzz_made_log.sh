#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz_made_log.sh FORMAT BUILD_FOLDER COUNT: makes small logs of the format, of each kind that it has,
# and runs its converter on COUNT damaged variants of each.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
format=$1 build=$2 count=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

converter="'$build/truetriad-convert-$format'"
# What a damaged file does to HDF5 is said by the program that started the converter.
if [[ $format == mat ]]; then
  converter="'$build/truetriad' convert --from=mat"
fi
fuzz() {
  "$here/fuzz.py" "$converter" "$@" --inspect="$build/truetriad"
}
# The bag is whole, and what --layout says of its messages is not.
damaged_layouts() {
  "$here/fuzz.py" "$converter" "$folder/Reading.msg" "$1" --layout-of="$folder/one" \
    --inspect="$build/truetriad" "${columns[@]:0:2}"
}
if [[ $format == mat ]]; then
  for version in 5 5z 7.3; do
    "$build/tests/convert/truetriad_make_mat" "$version" "$folder/$version.mat" 200
    fuzz "$folder/$version.mat" $(((count + 2) / 3)) \
      --columns=time=t,accelerometer=imu.acc,gyroscope=imu.gyr,magnetometer=data:2-4 \
      --units=s,m/s^2,rad/s,counts
  done
  # Beside one that is whole, each with a time of its own.
  for version in 5 5z 7.3; do
    fuzz "$folder/$version.mat" $(((count + 2) / 3)) "$folder/5z.mat" --units=s,m/s^2,rad/s \
      --columns=time=t,accelerometer=log/imu.acc,gyroscope=5z/imu.gyr
  done
elif [[ $format == json ]]; then
  python3 - "$folder/log.json" <<'EOF'
import json, sys
rows = [{"t": 0.01 * i, "imu": {"acc": [i, -i, 9.5], "gyr": [0.1, i, 0.25]}} for i in range(200)]
json.dump({"unit": "A1", "rows": rows, "mag": [[i, 2, 3] for i in range(200)]}, open(sys.argv[1], "w"))
EOF
  fuzz "$folder/log.json" "$count" --units=s,m/s^2,rad/s,counts \
    --columns=time=rows.t,accelerometer=rows.imu.acc,gyroscope=rows.imu.gyr@100Hz,magnetometer=mag@rows.t
  # An array a line, and poses without time in a list of x, y and z in turn; both with NaN.
  python3 - "$folder" <<'EOF'
import json, math, sys
with open(sys.argv[1] + "/lines.json", "w") as out:
    for i in range(200):
        out.write(json.dumps([0.01 * i, i, math.nan if i % 7 == 0 else -i, 9.5]) + "\n")
flat = [float(i % 9) for i in range(600)] + [math.nan] * 30
json.dump({"shots": {"grav": flat, "mag": flat[::-1]}}, open(sys.argv[1] + "/poses.json", "w"))
EOF
  fuzz "$folder/lines.json" "$count" --units=s,m/s^2 --columns=time=data:1,accelerometer=data:2-4
  fuzz "$folder/poses.json" "$count" --units=m/s^2,uT \
    --columns=time=none,accelerometer=shots.grav:xyz,magnetometer=shots.mag:xyz
elif [[ $format == vectornav ]]; then
  "$here/../../tools/bench/make_log.py" "$format" "$folder/log" 400
  fuzz "$folder/log" "$count" --columns=time=100Hz
else
  "$here/../../tools/bench/make_log.py" "$format" "$folder/log" 400
  fuzz "$folder/log" "$count"
  if [[ $format == dataflash ]]; then
    "$here/../../tools/bench/make_log.py" dataflash-2014 "$folder/log-2014" 400
    fuzz "$folder/log-2014" "$count"
  elif [[ $format == ros* ]]; then
    # Messages of another type, told by --columns, in one bag and in two, of which one is whole.
    "$here/bags.py" "$format" "$folder/one" 0 200
    "$here/bags.py" "$format" "$folder/other" 200 200
    columns=(--units=us,counts,rad/s,degC --columns="accelerometer=/driver:low.acc@t_us,$(
      )gyroscope=/driver:gx+gy+gz@t_us,temperature=/driver:low.temp")
    if [[ $format == ros2-db3 ]]; then
      "$here/bags.py" layout "$folder/Reading.msg"
      columns+=(--layout="$folder/Reading.msg")
      # The definition, damaged.
      damaged_layouts "$count"
    fi
    fuzz "$folder/one" "$count" "${columns[@]}"
    fuzz "$folder/one" "$count" "$folder/other" "${columns[@]}"
  fi
fi
