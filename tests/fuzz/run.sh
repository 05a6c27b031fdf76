#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tests/fuzz/run.sh [SECONDS] [TARGET]...: builds the fuzzers with clang in build-fuzz/ and runs each of
# them (or those that are named) for SECONDS, ten minutes where nothing is said. What is new goes into
# build-fuzz/corpus/TARGET, what brings a target down into build-fuzz/findings/TARGET. Exit code: 1 when
# there is such an input. Ends without doing anything, and says so, where there is no clang.
set -euo pipefail
cd "$(dirname "$0")/../.."

seconds=600
if [[ "${1:-}" =~ ^[0-9]+$ ]]; then seconds=$1; shift; fi
compiler=${CLANGXX:-clang++}
if ! command -v "$compiler" >/dev/null; then
  echo "no $compiler: nothing is fuzzed; install Debian's clang, or name it in CLANGXX"
  exit 0
fi
cmake -S . -B build-fuzz -G Ninja --log-level=WARNING -DTRUETRIAD_FUZZ=ON -DTRUETRIAD_BUILD_TESTS=OFF \
  -DCMAKE_CXX_COMPILER="$compiler"
if (($# > 0)); then targets=("$@"); else
  targets=()
  for source in $(ninja -C build-fuzz -t targets all | sed -n 's/^fuzz_\([a-z0-9_]*\): phony.*/\1/p' | sort); do
    targets+=("$source")
  done
fi
ninja -C build-fuzz "${targets[@]/#/fuzz_}"

# What is freed is kept for a while, to tell its use; not so much that it is taken for the target's memory.
export ASAN_OPTIONS="quarantine_size_mb=64:${ASAN_OPTIONS:-}"
found=0
for target in "${targets[@]}"; do
  corpus=build-fuzz/corpus/$target findings=build-fuzz/findings/$target log=build-fuzz/$target.log
  mkdir -p "$corpus" "$findings"
  options=(-timeout=10 -rss_limit_mb=512 -max_len=20000 -close_fd_mask=3 -print_final_stats=1
           -artifact_prefix="$findings/")
  dictionary=tests/fuzz/dictionaries/$target.dict
  [[ -f $dictionary ]] && options+=(-dict="$dictionary")
  failed=0 executions=0
  # In pieces: what the sanitizer remembers of the calls it saw would fill the limit in half a million executions.
  for ((left = seconds; left > 0 && !failed; left -= piece)); do
    piece=$((left < 120 ? left : 120))
    build-fuzz/fuzz/"$target" -max_total_time="$piece" "${options[@]}" "$corpus" tests/fuzz/corpus/"$target" \
      >"$log" 2>&1 || failed=$?
    of_piece=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    executions=$((executions + ${of_piece:-0}))
  done
  printf '%-22s %10s executions' "$target" "$executions"
  if ((failed)); then
    found=1
    printf ': FAILED, %s\n' "$(ls -t "$findings" | head -1)"
    grep -m3 -E 'does not hold|ERROR|runtime error|Assertion' "$log" || true
  else
    echo
  fi
done
exit "$found"
