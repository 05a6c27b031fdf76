#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fleet export --to=parquet`, read back by hyparquet, against the CSV of the same runs.

Environment: PROGRAMS (folder of the Node programs), TRUETRIAD.
"""
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from datetime import datetime
from pathlib import Path

PROGRAMS = Path(os.environ["PROGRAMS"])
TRUETRIAD = os.environ["TRUETRIAD"]

# Types of the columns, and the rows; what JSON does not hold is text.
READ = """
import fs from 'fs';
import { parquetMetadata, parquetReadObjects } from 'hyparquet';
const bytes = fs.readFileSync(process.env.TABLE);
const file = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const types = parquetMetadata(file).schema.slice(1).map((one) => [one.name, one.converted_type ?? one.type]);
const rows = await parquetReadObjects({ file });
console.log(JSON.stringify({ types, rows }, (key, value) => (typeof value === 'bigint' ? String(value) : value)));
"""


def run(*words, code=0, **options):
    done = subprocess.run([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          encoding="utf-8", **options)
    if done.returncode != code:
        raise AssertionError(f"{words} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def log(rests, seed):
    """A log of an accelerometer in rests of 2 s, at 50 Hz."""
    lines = ["time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]"]
    directions = [(1, 2, 3), (-3, 1, 2), (2, -3, 1), (-1, -2, -3), (3, -1, -2), (-2, 3, -1), (1, -3, -2),
                  (-1, 3, 2), (3, 2, -1), (-3, -2, 1), (2, 1, -3), (-2, -1, 3)][:rests]
    sample = 0
    for x, y, z in directions:
        scale = 9.80665 / 14 ** 0.5
        for i in range(150):
            noise = [0.02 * ((7919 * (sample * 3 + axis) + seed) % 1000 - 500) / 500 for axis in range(3)]
            shake = 3.0 * (i % 5) if i >= 100 else 0.0  # On the way to the next rest.
            values = [scale * v + n + shake for v, n in zip((x, y, z), noise)]
            lines.append(f"{sample / 50:.2f}," + ",".join(f"{v:.5f}" for v in values))
            sample += 1
    return "\n".join(lines) + "\n"


class Parquet(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def fleet(self, *words, code=0, **options):
        return run(TRUETRIAD, "fleet", *words, code=code, cwd=self.folder, **options)

    def make_store(self):
        (self.folder / "list.csv").write_text(
            'log,serial,note\na.csv,"=1+1; ""x""",–\nb.csv,0012,\nshort.csv,s\u2028t,\n', encoding="utf-8")
        for name, rests, seed in (("a", 12, 1), ("b", 12, 2), ("short", 2, 3)):
            (self.folder / f"{name}.csv").write_text(log(rests, seed))
        self.fleet("run", "list.csv", "-o", ".", "--report=false")

    def export(self, to, *words):
        self.fleet("export", "--store=fleet.db", f"--to={to}", "-o", f"runs.{to}", *words)

    def test_holds_the_same_as_the_csv(self):
        self.make_store()
        self.export("csv")
        self.export("parquet")
        done = run("node", "--input-type=module", "-e", READ, cwd=PROGRAMS / "convert-node",
                   env=dict(os.environ, TABLE=str(self.folder / "runs.parquet")))
        found = json.loads(done.stdout)
        with open(self.folder / "runs.csv", newline="", encoding="utf-8") as file:
            expected = list(csv.DictReader(file))
        types = dict(found["types"])
        self.assertEqual(list(types), list(expected[0]))
        self.assertEqual((types["serial"], types["created"], types["log_bytes"]),
                         ("UTF8", "TIMESTAMP_MILLIS", "INT64"))
        self.assertGreater(sum(1 for kind in types.values() if kind == "DOUBLE"), 12)
        self.assertEqual(len(found["rows"]), 3)
        for row, text in zip(found["rows"], expected):
            for name, kind in types.items():
                if kind == "DOUBLE":
                    self.assertEqual(row[name], float(text[name]) if text[name] else None, name)
                elif kind == "TIMESTAMP_MILLIS":
                    self.assertEqual(datetime.fromisoformat(row[name].replace("Z", "+00:00")),
                                     datetime.fromisoformat(text[name].replace("Z", "+00:00")))
                else:
                    self.assertIn(text[name], (row[name], "'" + row[name]), name)
        # As they are, whatever a spreadsheet makes of them.
        self.assertEqual({row["serial"] for row in found["rows"]}, {'=1+1; "x"', "0012", "s\u2028t"})
        self.assertEqual([p.name for p in self.folder.iterdir() if ".tmp-" in p.name], [])

    def test_says_what_is_missing(self):
        self.make_store()
        done = self.fleet("export", "--store=fleet.db", "--to=parquet", "-o", "x", code=1,
                          env=dict(os.environ, PATH="/nonexistent"))
        self.assertIn("--to=parquet: needs Node.js", done.stderr)
        done = self.fleet("export", "--store=fleet.db", "--to=parquet", "-o", "fleet.db", code=1)
        self.assertIn("would be overwritten, and it is an input", done.stderr)
        self.assertFalse((self.folder / "x").exists())

    def test_refuses_what_is_no_table(self):
        table, output = self.folder / "table", self.folder / "out"
        for text in ("", "{}\n", "[]\n", '[{"name": "a", "type": "DATE"}]\n',
                     '[{"name": "a", "type": "DOUBLE"}]\n[1, 2]\n', '[{"name": "a", "type": "DOUBLE"}]\n[1\n'):
            table.write_text(text)
            done = run(PROGRAMS / "truetriad-export-parquet", table, f"--output={output}", code=2)
            self.assertIn("truetriad-export-parquet: ", done.stderr)
            self.assertEqual([p.name for p in self.folder.iterdir()], ["table"])


if __name__ == "__main__":
    if shutil.which("node") is None or not (PROGRAMS / "truetriad-export-parquet").exists():
        print("skipped: the programs of tools/convert-node are not there")
        sys.exit(77)
    unittest.main()
