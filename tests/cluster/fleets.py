# SPDX-License-Identifier: Apache-2.0
"""Simulated fleets and what a store says of them.

Environment: SOURCE (the repository), TRUETRIAD (the program).
"""
import json
import os
import subprocess
from pathlib import Path

SOURCE = Path(os.environ["SOURCE"])
TRUETRIAD = os.environ["TRUETRIAD"]

# Short logs of 70 kB: the shards are tested here, not the calibration.
MOTION = "motion=[{poses: {attitudes: {spread: 12}, rest_s: 1, move_s: 0.5, tilt_sigma_deg: 5}}]"


def run(*words, code=0, **options):
    """What a command printed; an error unless it ended with `code`."""
    done = subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          encoding="utf-8", **options)
    if done.returncode != code:
        raise AssertionError(f"{words} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def simulate(folder, count):
    run(TRUETRIAD, "simulate", "-c", SOURCE / "configs/scenarios/fleet.yaml",
        f"--set=count={count}", f"--set={MOTION}", "-o", folder)


def rows(store, sql):
    done = run(TRUETRIAD, "fleet", "query", f"--store={store}", "--json", f"--sql={sql}")
    return json.loads(done.stdout)["result"]["rows"]


def numbers(store):
    """Every number of every unit, to the last digit: what must not depend on who calibrates it."""
    return (rows(store, "SELECT serial, log, verdict, code, effective_dof, covariance FROM run ORDER BY serial"),
            rows(store, "SELECT serial, name, value, sigma FROM run JOIN parameter USING (run) "
                        "ORDER BY serial, place"))
