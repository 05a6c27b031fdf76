#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Usage: tools/install.sh [--tests]
# Installs the packages of tools/packages.txt that are missing. Debian 12; as root or with sudo.
# --tests: also the packages that only tests need. Without these packages such tests are skipped.
set -euo pipefail
cd "$(dirname "$0")"

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "tools/install.sh: no apt-get on this system; install the packages in tools/packages.txt (Debian 12 names) by hand" >&2
  exit 1
fi

wanted='/^# Tests/,$d'
[[ "${1:-}" == --tests ]] && wanted=''

missing=()
while read -r package; do
  status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  # A package of several architectures is listed once for each.
  [[ $status == installed* ]] || missing+=("$package")
done < <(sed -e "$wanted" -e 's/#.*//' -e '/^[[:space:]]*$/d' packages.txt)
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "tools/install.sh: missing packages: ${missing[*]}" >&2
    echo "tools/install.sh: cannot install them without root or sudo; run tools/install.sh once as root" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y --no-install-recommends "${missing[@]}"
