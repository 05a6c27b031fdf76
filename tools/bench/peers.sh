#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compares truetriad with other calibrators (peers) on the same recordings: CPU time, wall time and
# peak memory of whole processes in turns, and the residuals of each calibration. Prints the tables
# of docs/comparison.md.
#
#   IMU_TK=DIR MAG_CAL=DIR ELLIPSOID_FIT=DIR tools/bench/peers.sh [BUILD_FOLDER]      default: build
#
#   IMU_TK         imu_tk (bitbucket.org/alberto_pretto/imu_tk or a fork): its calibration is compiled
#                  here, without its windows. Needs libceres-dev, libeigen3-dev, libboost-dev; an
#                  include folder elsewhere goes into CPATH.
#   MAG_CAL        github.com/furbrain/CircuitPython_mag_cal. Needs python3-numpy.
#   ELLIPSOID_FIT  github.com/aleksandrbazhin/ellipsoid_fit_python. Needs python3-numpy.
#
# A peer without a folder is left out. RUNS (default 25) is the number of turns. PYTHON (default
# python3) runs the peers in Python. The recordings are searched in $TRUETRIAD_SHARED_DATASETS
# (default: ../shared/datasets). The drivers of the peers are in tools/bench/peers/; nothing of a
# peer is in this repository.
# shellcheck disable=SC2016  # Headings hold backquotes of Markdown.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=${1:-build}
runs=${RUNS:-25}
python=${PYTHON:-python3}
logs=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}
peers=tools/bench/peers
experiments=configs/experiments/recordings
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

xsens=$logs/a-xsens-imu-tk-38pose
points=$logs/b-mag-347-points/mag_out.txt
still=$logs/a-ck-160pose-and-accmag-tumble/acc_log.csv
for file in "$build/truetriad" "$xsens"/{xsens_acc.mat,xsens_gyro.mat,reference.json} "$points" \
  "$still" "$logs/a-sap-acc-mag-24pose/sap5_ab.json"; do
  [[ -r $file ]] || { echo "$file is missing; see docs/comparison.md" >&2; exit 1; }
done
tools/scripts/shared_tables.py --datasets="$logs" --output="$folder/tables"
survey=$folder/tables/sap5_ab.csv

# given NAME FILE: whether the variable NAME is set. Ends the script if its folder has no FILE.
given() {
  if [[ -z ${!1:-} ]]; then
    echo "$1 is not set: this peer is left out" >&2
    return 1
  elif [[ ! -r ${!1}/$2 ]]; then
    echo "$1=${!1}: there is no $2, so this folder is no checkout of the peer" >&2
    exit 1
  fi
}

# measure FILE "NAME: COMMAND"...: runs the commands in turns; FILE gets rows «NAME, CPU, wall,
# peak».
measure() {
  "$python" "$peers/measure.py" --runs="$runs" "${@:2}" > "$1" || exit 1
}

# row MEASURED NAME PARAMETERS SIGMA RESIDUAL: one table row; MEASURED is a file of `measure`.
row() {
  awk -F'\t' -v name="$2" -v rest="$3 | $4 | $5" '$1 == name {
    printf "| %s | %s | %s | %s | %s |\n", name, $2, $3, $4, rest }' "$1"
}

# heading TITLE RESIDUAL: title and header of a table.
heading() {
  printf '\n%s\n\n| | CPU [ms] | wall [ms] | peak [MB] | parameters | σ | %s |\n' "$1" "$2"
  echo '|---|---|---|---|---|---|---|'
}

calibrate() {
  echo "$build/truetriad calibrate --config=$experiments/$1.yaml --output=$folder/$2 --report=false ${*:3}"
}
left() { "$python" "$peers/residuals.py" "$@"; }

# --- The pair of files that imu_tk has as its example.
pair() {
  local flags options commands=(
    "truetriad: $(calibrate xsens-imu-tk-pair pair)"
    "truetriad, imu_tk's parameters: $(calibrate xsens-imu-tk-pair plain \
      --set=sensors.gyroscope.g_sensitivity=false)"
    "(start of truetriad): $build/truetriad version")
  local builds=() name
  if given IMU_TK src/calibration.cpp; then
    # imu_tk's own build uses -O3. With g++ 12, -O2 is faster; -Ofast, -flto and -O1 are not.
    for flags in "-O2 -DNDEBUG" "-O3 -DNDEBUG"; do
      name="imu_tk $flags"
      local program="$folder/imu_tk${flags// /}"
      read -ra options <<< "$flags"
      g++ -std=c++17 "${options[@]}" -w "-I$IMU_TK/include" -I/usr/include/eigen3 "$peers/imu_tk_main.cc" \
        "$IMU_TK"/src/{calibration,filters,io_utils}.cpp -o "$program" -lceres -lglog
      builds+=("$name")
      # Initial rest, gravity and start values are those of imu_tk's apps/test_imu_calib.cpp.
      commands+=("$name: $program $xsens/xsens_acc.mat $xsens/xsens_gyro.mat 50 9.81744 32768 \
        1.597954618e-4 $program.acc $program.gyro")
    done
    commands+=("(start of imu_tk): $program")
  fi
  measure "$folder/pair.txt" "${commands[@]}"
  heading 'Accelerometer and gyroscope, 38 rests, 6.6 MB of text (`a-xsens-imu-tk-38pose`)' \
    'rests [mm/s²]; turns, RMS [°]'
  row "$folder/pair.txt" truetriad '9 + 12 + 9' 'of all' \
    "$(left pair "$xsens" "$folder/pair/calibration.json")"
  row "$folder/pair.txt" "truetriad, imu_tk's parameters" '9 + 12' 'of all' \
    "$(left pair "$xsens" "$folder/plain/calibration.json")"
  for name in "${builds[@]}"; do
    flags=${name#imu_tk }
    row "$folder/pair.txt" "$name" '9 + 9, 3 means' 'none' \
      "$(left pair "$xsens" "$folder/imu_tk${flags// /}.acc,$folder/imu_tk${flags// /}.gyro")"
  done
  row "$folder/pair.txt" '(start of truetriad)' '' '' ''
  row "$folder/pair.txt" '(start of imu_tk)' '' '' ''
}

# --- Accelerometer and magnetometer of a cave survey instrument.
joint() {
  local commands=("truetriad: $(calibrate sap5 joint --input="$survey")")
  if given MAG_CAL mag_cal/calibration.py; then
    commands+=("mag_cal: $python $peers/mag_cal_main.py $MAG_CAL $survey $folder/mag_cal.json"
      "(python3 and numpy): $python -c import\ numpy")
  fi
  measure "$folder/joint.txt" "${commands[@]}"
  heading 'Accelerometer and magnetometer, 24 poses (`a-sap-acc-mag-24pose`, sap5_ab)' \
    'gravity [%]; field [%]; angle between them [°]'
  row "$folder/joint.txt" truetriad '9 + 12 + dip' 'of all' \
    "$(left joint "$survey" "$folder/joint/calibration.json")"
  [[ -r $folder/mag_cal.json ]] &&
    row "$folder/joint.txt" mag_cal '9 + 9 + 4' 'none' \
      "$(left joint "$survey" "$folder/mag_cal.json")"
  row "$folder/joint.txt" '(python3 and numpy)' '' '' ''
}

# --- A magnetometer turned by hand.
magnetometer() {
  local commands=("truetriad: $(calibrate mag-347 mag)")
  if given ELLIPSOID_FIT ellipsoid_fit.py; then
    commands+=("ellipsoid_fit: $python $peers/ellipsoid_fit_main.py $ELLIPSOID_FIT $points \
      $folder/ellipsoid.json" "(python3 and numpy): $python -c import\ numpy")
  fi
  measure "$folder/mag.txt" "${commands[@]}"
  heading 'Magnetometer, 347 readings (`b-mag-347-points`)' 'field [%]'
  row "$folder/mag.txt" truetriad 9 'of all' "$(left field "$points" "$folder/mag/calibration.json")"
  [[ -r $folder/ellipsoid.json ]] &&
    row "$folder/mag.txt" ellipsoid_fit 9 none "$(left field "$points" "$folder/ellipsoid.json")"
  row "$folder/mag.txt" '(python3 and numpy)' '' '' ''
}

# --- An accelerometer held still 160 times.
accelerometer() {
  local commands=("truetriad: $(calibrate ck-accelerometer still)")
  if given ELLIPSOID_FIT ellipsoid_fit.py; then
    commands+=("ellipsoid_fit: $python $peers/ellipsoid_fit_main.py $ELLIPSOID_FIT $still \
      $folder/still.json accelerometer 100" "(python3 and numpy): $python -c import\ numpy")
  fi
  measure "$folder/still.txt" "${commands[@]}"
  heading 'Accelerometer, 160 poses (`a-ck-160pose-and-accmag-tumble`)' 'gravity [%]'
  row "$folder/still.txt" truetriad 9 'of all' \
    "$(left poses "$still" "$folder/still/calibration.json")"
  [[ -r $folder/still.json ]] &&
    row "$folder/still.txt" ellipsoid_fit 9 none "$(left poses "$still" "$folder/still.json")"
  row "$folder/still.txt" '(python3 and numpy)' '' '' ''
}

printf '%s, %s, %s, medians of %d turns\n' "$(date +%F)" \
  "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1), $(nproc) cores" \
  "$("$build/truetriad" version | head -1)" "$runs"
pair
joint
accelerometer
magnetometer
