#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fuzz_made_log.sh FORMAT BUILD_FOLDER COUNT: makes a small log of the format and runs its converter on
# COUNT damaged variants of it.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
format=$1 build=$2 count=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

fuzz() {
  "$here/fuzz.py" "$build/truetriad-convert-$format" "$@" --inspect="$build/truetriad"
}
if [[ $format == mat ]]; then
  for version in 5 5z 7.3; do
    "$build/tests/convert/truetriad_make_mat" "$version" "$folder/$version.mat" 200
    fuzz "$folder/$version.mat" $(((count + 2) / 3)) \
      --columns=time=t,accelerometer=imu.acc,gyroscope=imu.gyr,magnetometer=data:2-4 \
      --units=s,m/s^2,rad/s,counts
  done
elif [[ $format == json ]]; then
  python3 - "$folder/log.json" <<'EOF'
import json, sys
rows = [{"t": 0.01 * i, "imu": {"acc": [i, -i, 9.5], "gyr": [0.1, i, 0.25]}} for i in range(200)]
json.dump({"unit": "A1", "rows": rows, "mag": [[i, 2, 3] for i in range(200)]}, open(sys.argv[1], "w"))
EOF
  fuzz "$folder/log.json" "$count" --units=s,m/s^2,rad/s,counts \
    --columns=time=rows.t,accelerometer=rows.imu.acc,gyroscope=rows.imu.gyr@100Hz,magnetometer=mag@rows.t
elif [[ $format == vectornav ]]; then
  "$here/../../tools/bench/make_log.py" "$format" "$folder/log" 400
  fuzz "$folder/log" "$count" --columns=time=100Hz
else
  "$here/../../tools/bench/make_log.py" "$format" "$folder/log" 400
  fuzz "$folder/log" "$count"
  if [[ $format == dataflash ]]; then
    "$here/../../tools/bench/make_log.py" dataflash-2014 "$folder/log-2014" 400
    fuzz "$folder/log-2014" "$count"
  fi
fi
