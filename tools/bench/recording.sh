# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: the 38-pose Xsens recording, once or many times in a row, in a
# folder that goes when the script ends. Takes the script's first argument as the build folder.
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=${1:-build}
log=${TRUETRIAD_SHARED_DATASETS:-../shared/datasets}/a-xsens-imu-tk-38pose/xsens_acc.mat
experiment=configs/experiments/recordings/xsens-imu-tk.yaml
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# need FILE...: ends the script when one is missing.
need() {
  for file in "$@"; do
    [[ -r $file ]] || { echo "$file is missing; see docs/performance.md" >&2; exit 1; }
  done
}
need "$build/truetriad" "$log"

# tile TIMES: the recording TIMES in a row, time going on, as $folder/tiled.txt.
tile() {
  awk -v times="$1" '
    { time[NR] = $1; rest[NR] = substr($0, index($0, $1) + length($1)) }
    END {
      period = time[NR] - time[1] + 0.01
      for (tile = 0; tile < times; ++tile)
        for (i = 1; i <= NR; ++i) printf "   %.7e%s\n", time[i] + tile * period, rest[i]
    }' "$log" > "$folder/tiled.txt"
}

# The manifest of the repository, for the tiled recording.
sed 's|file: .*xsens_acc.mat|file: tiled.txt|' configs/recordings/xsens-imu-tk.yaml \
  > "$folder/recording.yaml"
