# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: the 38-pose Xsens recording, once or many times in a row, in a
# folder that goes when the script ends. Takes the script's first argument as the build folder. With
# RECORDING=pair it is the accelerometer's file and the gyroscope's, else the accelerometer's alone.
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=${1:-build}
logs=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}/a-xsens-imu-tk-38pose
case ${RECORDING:-accelerometer} in
  accelerometer) name=xsens-imu-tk files=(xsens_acc.mat) ;;
  pair) name=xsens-imu-tk-pair files=(xsens_acc.mat xsens_gyro.mat) ;;
  *) echo "RECORDING is accelerometer or pair" >&2; exit 1 ;;
esac
experiment=configs/experiments/recordings/$name.yaml
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# need FILE...: ends the script when one is missing.
need() {
  for file in "$@"; do
    [[ -r $file ]] || { echo "$file is missing; see docs/performance.md" >&2; exit 1; }
  done
}
need "$build/truetriad" "${files[@]/#/$logs/}"

# tile TIMES: the recording TIMES in a row, time going on, as $folder/recording.yaml. The two files of
# the pair hold the same times.
tile() {
  for file in "${files[@]}"; do
    awk -v times="$1" '
    { time[NR] = $1; rest[NR] = substr($0, index($0, $1) + length($1)) }
    END {
      period = time[NR] - time[1] + 0.01
      for (tile = 0; tile < times; ++tile)
        for (i = 1; i <= NR; ++i) printf "   %.7e%s\n", time[i] + tile * period, rest[i]
    }' "$logs/$file" > "$folder/$file"
  done
}

# The manifest of the repository, for the tiled recording.
sed 's|file: .*/\(xsens_[a-z]*.mat\)|file: \1|' "configs/recordings/$name.yaml" \
  > "$folder/recording.yaml"
