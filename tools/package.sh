#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Usage: tools/package.sh [--check]
# Builds the Debian packages truetriad, python3-truetriad and libtruetriad-dev in out/packages. With
# --check (as root): installs the first two into a fresh minimal Debian 12 (debootstrap, some minutes
# and 500 MB), runs the first example of the README there, converts a table and calibrates in Python.
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ $# -gt 1 || ( $# -eq 1 && $1 != --check ) ]]; then
  echo "usage: tools/package.sh [--check]" >&2
  exit 1
fi
need() {
  command -v "$1" >/dev/null || { echo "tools/package.sh: $1 is missing; apt-get install $2" >&2; exit 1; }
}
need dpkg-shlibdeps dpkg-dev

# A separate build folder: the packages must not depend on options that were set in build/.
TRUETRIAD_BUILD_FOLDER=build-package tools/build.sh all -DTRUETRIAD_BUILD_TESTS=OFF
rm -rf out/packages
(cd build-package && cpack -G DEB -B ../out/packages)
rm -rf out/packages/_CPack_Packages
ls -l out/packages/*.deb
[[ "${1:-}" == --check ]] || exit 0

need debootstrap debootstrap
root=$(mktemp -d)
trap 'rm -rf --one-file-system "$root"' EXIT
mirror=$(apt-cache policy base-files | awk '$2 ~ /^(http|https|file):/ { print $2; exit }')
debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" 2>&1 ||
  { tail -5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
cp out/packages/truetriad_*.deb out/packages/python3-truetriad_*.deb tests/convert_node/table.parquet "$root/tmp/"
# The new system may need this machine's DNS and proxy settings to reach the package mirror.
cp -rL /etc/resolv.conf "$root/etc/" 2>/dev/null || true
cp /etc/apt/apt.conf.d/*proxy* "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
# The new system has its own processes and /proc, and sees nothing else of the host.
unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" /bin/sh -euc '
  export DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin
  apt-get update -q
  apt-get install -q -y --no-install-recommends /tmp/truetriad_*.deb
  cd /tmp
  truetriad version
  # The first example of the installed README, as it stands there.
  line=$(grep -m1 "^    truetriad calibrate" /usr/share/doc/truetriad/README.md)
  echo "$line"
  eval "$line"
  test -s out/first/report.html -a -s /usr/share/truetriad/magnetic/wmm2025.wmm
  apt-get install -q -y --no-install-recommends /tmp/python3-truetriad_*.deb
  python3 -c "import truetriad; print(truetriad.calibrate(\"/usr/share/truetriad/datasets/demo/recording.csv\"))"
  convert=/usr/libexec/truetriad/truetriad-convert-parquet
  if test -e $convert; then
    apt-get install -q -y --no-install-recommends nodejs
    $convert table.parquet --output=table
    truetriad inspect --input=table/recording.yaml || test $? -eq 3
  fi
' >"$root.out" 2>&1 || { tail -20 "$root.out" >&2; rm -f "$root.out"; exit 1; }
grep -E "^( *truetriad |[A-Z ]+: |[A-Z ]+, )|newly installed|recording.yaml" "$root.out"
rm -f "$root.out"
echo "The package installs and runs in a fresh Debian 12."
