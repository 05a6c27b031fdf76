# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it. Provides the 38-pose Xsens recording, once or repeated, in a
# folder that is removed when the script ends. The script's first argument is the build folder. With
# RECORDING=pair, the recording has the files of accelerometer and gyroscope, otherwise only the
# first.
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

# need FILE...: ends the script if a file is missing.
need() {
  for file in "$@"; do
    [[ -r $file ]] || { echo "$file is missing; see docs/performance.md" >&2; exit 1; }
  done
}
need "$build/truetriad" "${files[@]/#/$logs/}"

# tile TIMES: writes the recording TIMES times in a row, with increasing time stamps, for
# $folder/recording.yaml. The two files of the pair get the same time stamps.
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

# The repository's manifest, changed to name the files that `tile` writes.
sed 's|file: .*/\(xsens_[a-z]*.mat\)|file: \1|' "configs/recordings/$name.yaml" \
  > "$folder/recording.yaml"
