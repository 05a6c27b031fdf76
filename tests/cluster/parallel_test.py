#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A fleet in shards under GNU parallel has the numbers of a single run. Argument: units."""
import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

from fleets import SOURCE, TRUETRIAD, numbers, rows, run, simulate

UNITS = int(sys.argv.pop(1))
SHARDS = 5


class Parallel(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        # Who cites it has been asked often enough; the home folder stays as it is.
        home = self.folder / "parallel"
        home.mkdir()
        (home / "will-cite").touch()
        self.environment = dict(os.environ, PARALLEL_HOME=str(home), SHARDS=str(SHARDS), OUTPUT="out",
                                TRUETRIAD=TRUETRIAD, PARALLEL="--jobs 2")
        simulate(self.folder / "line of units", UNITS)

    def fleet(self, *words, code=0):
        return run(SOURCE / "tools/parallel/fleet.sh", "line of units", *words, code=code,
                   cwd=self.folder, env=self.environment)

    def test_gives_the_numbers_of_a_single_run(self):
        words = ["--report=false", "--tag=lot=L 17; 'a'"]
        run(TRUETRIAD, "fleet", "run", "line of units", "-o", "single", *words, cwd=self.folder)
        self.fleet(*words)
        self.assertEqual(numbers(self.folder / "out/fleet.db"), numbers(self.folder / "single/fleet.db"))
        # Again: nothing is missing, nothing is there twice.
        self.fleet(*words)
        store = self.folder / "out/fleet.db"
        self.assertEqual(rows(store, "SELECT count(*) AS n FROM run"), [{"n": UNITS}])
        self.assertEqual(rows(store, "SELECT DISTINCT value FROM tag"), [{"value": "L 17; 'a'"}])
        self.assertEqual(rows(store, "SELECT count(DISTINCT shard) AS n FROM run"), [{"n": SHARDS}])

    def test_collects_nothing_where_a_shard_fails(self):
        spoilt = self.folder / "out/shards"
        spoilt.mkdir(parents=True)
        (spoilt / f"3-of-{SHARDS}.jsonl").write_text("not ours\n")
        self.fleet("--report=false", code=1)
        self.assertFalse((self.folder / "out/fleet.db").exists())
        self.assertEqual((spoilt / f"3-of-{SHARDS}.jsonl").read_text(), "not ours\n")


if __name__ == "__main__":
    if shutil.which("parallel") is None:
        print("skipped: GNU parallel is not installed")
        sys.exit(77)
    unittest.main()
