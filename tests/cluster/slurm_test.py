#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A fleet in shards under a Slurm of its own has the numbers of a single run, also where a task is
killed and requeued. Argument: units."""
import hashlib
import os
import shutil
import signal
import sys
import tempfile
import unittest
from pathlib import Path

import private_slurm
from fleets import SOURCE, TRUETRIAD, numbers, rows, run, simulate

UNITS = int(sys.argv.pop(1))
SHARDS = 4
VICTIM = 1  # The shard whose task is killed.

# As the program, but the first time the victim's task hangs at one of its units.
HANGING = """#!/bin/sh
case " $* " in *" --shard={shard} "*)
  [ "${{SLURM_RESTART_COUNT:-0}}" -gt 0 ] || export TRUETRIAD_FLEET_FAULT=hang:{log};;
esac
exec {program} "$@"
"""


def shard_of(place):
    """As docs/fleet.md says it: by a hash of where the log is in the folder that was named."""
    return int(hashlib.sha256(place.encode()).hexdigest()[:15], 16) % SHARDS


class Slurm(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="tt-", dir="/tmp"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        simulate(self.folder / "line", UNITS)
        self.line = self.folder / "line"
        self.out = self.folder / "out"

    def submit(self, slurm, *words, **variables):
        environment = {**slurm.environment, "SHARDS": str(SHARDS), "OUTPUT": str(self.out),
                       "TRUETRIAD": TRUETRIAD, **variables}
        done = run("sbatch", "--parsable", f"--output={self.folder}/%x-%a.log", *words, env=environment,
                   cwd=self.folder)
        return done.stdout.strip()

    def logs(self):
        return "\n".join(f"{path.name}:\n{path.read_text()}" for path in sorted(self.folder.glob("*.log")))

    def wait_for(self, slurm, job, wanted):
        ended = ("COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "GONE")
        slurm.wait(f"job {job} to be {wanted}", lambda: slurm.state(job) in (wanted, *ended))
        self.assertEqual(slurm.state(job), wanted, self.logs())

    def test_gives_the_numbers_of_a_single_run_although_a_task_is_killed(self):
        run(TRUETRIAD, "fleet", "run", self.line, "-o", self.folder / "single", "--report=false")
        (self.folder / "slurm").mkdir()
        with private_slurm.PrivateSlurm(self.folder / "slurm") as slurm:
            store = self.out / f"shards/{VICTIM}-of-{SHARDS}.jsonl"
            done, program = self.hanging_program()
            # Numbers from 1 on: shard 0 is the array's task FIRST.
            array = self.submit(slurm, f"--array=1-{SHARDS}", SOURCE / "tools/slurm/shard.sbatch", self.line,
                                "--report=false", FIRST="1", TRUETRIAD=program)
            collecting = self.submit(slurm, f"--dependency=afterok:{array}", SOURCE / "tools/slurm/collect.sbatch")
            slurm.wait("the task to hang", lambda: store.exists() and store.read_bytes().count(b"\n") > done)
            self.kill_and_requeue(slurm, f"{array}_{1 + VICTIM}", store)
            self.wait_for(slurm, collecting, "COMPLETED")
        collected = self.out / "fleet.db"
        self.assertEqual(numbers(collected), numbers(self.folder / "single/fleet.db"))
        self.assertEqual(rows(collected, "SELECT count(*) AS n FROM run"), [{"n": UNITS}])
        self.assertEqual(rows(collected, "SELECT value FROM fact WHERE name = 'shards'"),
                         [{"value": str(SHARDS)}])

    def hanging_program(self):
        """How many units the victim's task does before it hangs, and the program that does so."""
        logs = sorted(str(log) for log in self.line.glob("*/recording.yaml"))
        logs = [log for log in logs if shard_of(str(Path(log).relative_to(self.line))) == VICTIM]
        done = len(logs) // 2
        program = self.folder / "hanging"
        program.write_text(HANGING.format(shard=f"{VICTIM}/{SHARDS}", log=logs[done], program=TRUETRIAD))
        program.chmod(0o755)
        return done, str(program)

    def kill_and_requeue(self, slurm, task, store):
        """As when a node is lost, and the last line is cut."""
        self.assertEqual(slurm.state(task), "RUNNING", self.logs())
        slurm.call("scontrol", "requeue", task)
        slurm.wait("the task to be requeued", lambda: slurm.state(task) == "PENDING")
        with open(store, "ab") as file:
            file.write(b'{"run":"2026')
        # Else it waits for two minutes.
        slurm.call("scontrol", "update", f"JobId={task}", "StartTime=now")

    def test_a_task_that_is_no_shard_fails_and_nothing_is_collected(self):
        (self.folder / "slurm").mkdir()
        with private_slurm.PrivateSlurm(self.folder / "slurm") as slurm:
            task = self.submit(slurm, f"--array={SHARDS}", SOURCE / "tools/slurm/shard.sbatch", self.line)
            self.wait_for(slurm, f"{task}_{SHARDS}", "FAILED")
            self.assertIn(f"--shard={SHARDS}/{SHARDS}: expected I/N", self.logs())
        self.assertFalse(self.out.exists())


def stop(*_):
    sys.exit(1)


if __name__ == "__main__":
    if private_slurm.missing():
        print(f"skipped: {private_slurm.missing()}")
        sys.exit(77)
    signal.signal(signal.SIGTERM, stop)  # All that was started ends, too.
    os.environ["PATH"] = private_slurm.PATH
    unittest.main()
