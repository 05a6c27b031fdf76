#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds everything and runs all tests but the nightly ones. Arguments go to ctest.
# With --nightly: runs only the long tests: a thousand damaged files for each converter, four
# thousand spoilt recordings, some thousand clean units, ten minutes of each fuzzer if clang is
# installed (tests/fuzz/run.sh), and all statistical tests. If there are further arguments, runs
# only tools/bench/accuracy.py with these arguments.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install.sh --tests

# Warnings are errors only in CI. Elsewhere the option stays as tools/demo.sh sets it, so that
# nothing is compiled twice.
strict=OFF
[[ "${CI:-}" == true ]] && strict=ON
# A test that hangs is ended after two hours; even on a busy machine no test takes so long.
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
