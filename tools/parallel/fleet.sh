#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `truetriad fleet run` in shards that GNU parallel starts, and then `fleet collect`. From the root of
# a built repository:
#
#     build/truetriad simulate -c configs/scenarios/fleet.yaml -o out/line
#     TRUETRIAD=build/truetriad SHARDS=8 OUTPUT=out/parallel tools/parallel/fleet.sh out/line
#
# The words are those of `fleet run`, but for --shard, --store, --output, --jobs and --resume, which
# are stated here.
#
# SHARDS     of how many shards the fleet is
# OUTPUT     a folder that all machines see; each shard has a file of its own in OUTPUT/shards
# STORE      where to collect (default: OUTPUT/fleet.db)
# TRUETRIAD  the program (default: truetriad, as it is installed)
# PARALLEL   flags of GNU parallel, as '--jobs 4' or '--sshlogin 4/one,4/two --workdir .'
#
# Where a shard fails the others go on, and nothing is collected; the same line again does what is
# missing.
set -euo pipefail
: "${SHARDS:?how many shards there are}" "${OUTPUT:?a folder that all machines see}"
truetriad=${TRUETRIAD:-truetriad}
seq 0 $((SHARDS - 1)) |
  parallel --quote -I '{shard}' "$truetriad" fleet run "$@" --shard="{shard}/$SHARDS" \
    --store="$OUTPUT/shards/{shard}-of-$SHARDS.jsonl" --output="$OUTPUT" --jobs=1 --resume
exec "$truetriad" fleet collect "$OUTPUT"/shards/*-of-"$SHARDS".jsonl \
  --store="${STORE:-$OUTPUT/fleet.db}"
