#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tools/bench/states finds no change between a program and itself, judges as tests/trust does, and its
statistics are right for tables whose answer is known. Environment: SOURCE, BUILD, TRUETRIAD."""
import copy
import importlib.machinery
import importlib.util
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SOURCE, PROGRAM = pathlib.Path(os.environ["SOURCE"]), os.environ["TRUETRIAD"]
SCRIPT = SOURCE / "tools" / "bench" / "states"
TRUST = pathlib.Path(os.environ["BUILD"]) / "tests" / "trust" / "truetriad_trust"


def load():
    sys.path.insert(0, str(SCRIPT.parent))
    loader = importlib.machinery.SourceFileLoader("states", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("states", loader))
    loader.exec_module(module)
    return module


def run(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, check=False)


def check_statistics(states):
    assert math.isclose(states.mcnemar(1, 8), 2 * (1 + 9) / 2**9)  # 10 of 512 ways are as uneven, twice.
    assert states.mcnemar(4, 4) == states.mcnemar(0, 0) == 1.0
    assert math.isclose(states.mcnemar(0, 10), states.mcnemar(10, 0)) and math.isclose(states.mcnemar(0, 10), 2 / 1024)


def check_against_itself(folder):
    """A record of a run, then the same program again: all pairs, no change."""
    record = f"{folder}/record.jsonl.xz"
    slices = ["--only=trust,regimes,fleet", "--trust=30000:8", "--units=1", "--quick", f"--writer={os.environ['BUILD']}"]
    first = run(f"--after={PROGRAM}", f"--save={record}", *slices)
    assert first.returncode == 0, first.stderr
    again = run(f"--before={record}", f"--after={PROGRAM}", f"--json={folder}/all.json", *slices)
    assert again.returncode == 0, again.stdout + again.stderr
    result = json.loads(pathlib.Path(folder, "all.json").read_text())
    assert result["paired"] > 30 and not result["other_bytes"] and not result["changed"], result
    assert result["fleet"]["largest_shift"][0] == 0.0 and result["fleet"]["sigma_ratio"] == [1.0, 1.0, 1.0]
    assert result["refused"]["clean"][1]["refused"] == 0
    return record


def check_changes_are_found(states, record):
    before = states.read_record(record)
    after = copy.deepcopy(before)
    name = next(name for name, row in before.items() if row["clean"] and row["outcome"] == "right")
    after[name] |= {"outcome": "refused", "codes": ["refusal:no-rest"]}
    other = next(other for other, row in before.items() if other != name and row.get("digest"))
    after[other]["digest"] = "other"
    result = states.compare(before, after)
    assert [one["id"] for one in result["changed"]] == [name] and result["other_bytes"] == [other]
    assert result["table"]["right"]["refused"] == 1 and result["refused"]["clean"][1]["codes"] == {"no-rest": 1}


def check_judged_alike(record, folder, states):
    """What tests/trust makes of the same seeds within its own process."""
    subprocess.run([TRUST, "--first=30000", "--runs=8", f"--lines={folder}/lines"], check=True, capture_output=True)
    rows = states.read_record(record)
    for line in pathlib.Path(folder, "lines").read_text().splitlines():
        seed, verdict, _, worst_sigmas, *_ = line.split("\t")
        row = rows[f"trust/{seed}"]
        assert row["outcome"] == verdict.lower(), (line, row)
        if row.get("worst"):
            assert abs(abs(row["p"][row["worst"]][2]) - float(worst_sigmas)) < 0.1, (line, row)


def main():
    if not TRUST.exists():
        print(f"{TRUST} is not built")
        return 77
    states = load()
    check_statistics(states)
    with tempfile.TemporaryDirectory() as folder:
        record = check_against_itself(folder)
        check_changes_are_found(states, record)
        check_judged_alike(record, folder, states)
    return 0


sys.exit(main())
