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
else
  "$here/../../tools/bench/make_log.py" "$format" "$folder/log" 400
  fuzz "$folder/log" "$count"
fi
