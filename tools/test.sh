#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds everything and runs all tests but the nightly ones. Arguments go to ctest.
# With --nightly: the long tests instead: a thousand damaged files for each converter, four thousand
# spoilt recordings, some thousand clean units, ten minutes of each fuzzer where there is clang
# (tests/fuzz/run.sh), and the whole of the statistical tests. Further
# arguments go to tools/bench/accuracy.py, which then runs alone.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install.sh --tests

# Warnings are errors where it counts, and elsewhere nobody compiles twice after tools/demo.sh.
strict=OFF
[[ "${CI:-}" == true ]] && strict=ON
# Two hours are for what hangs, not for what is slow on a busy machine.
tests=(ctest --test-dir build --output-on-failure --parallel "$(nproc)" --timeout 7200)
options=(-DTRUETRIAD_BUILD_TESTS=ON -DTRUETRIAD_WARNINGS_AS_ERRORS=$strict)
if [[ "${1:-}" == --nightly ]]; then
  if (($# > 1)); then
    tools/build.sh truetriad_statistical_test "${options[@]}"
    exec tools/bench/accuracy.py "${@:2}"
  fi
  tools/build.sh all "${options[@]}"
  damaged=0
  "${tests[@]}" --label-regex nightly \
    --tests-regex 'SurvivesAThousand|convert_node|nightly_trust|nightly_fleet|nightly_run_lengths|nightly_docs|nightly_convert_killed' || damaged=$?
  nice tests/fuzz/run.sh || damaged=$?
  tools/bench/accuracy.py
  exit "$damaged"
fi
tools/build.sh all "${options[@]}"
"${tests[@]}" --label-exclude nightly "$@"
