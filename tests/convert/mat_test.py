#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""MATLAB 5 files, written here from the format's description, in what MATLAB itself writes: variables and
files with a time each, structs, small storage types, either byte order, compressed or not.

Environment: PROGRAMS, the folder of the converters.
"""
import csv
import os
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

PROGRAM = Path(os.environ["PROGRAMS"]) / "truetriad-convert-mat"
# miINT8 …: what a matrix is stored as, beside mxDOUBLE 6, mxSINGLE 7, mxINT16 10, mxSTRUCT 2.
STORED = {"b": 1, "B": 2, "h": 3, "H": 4, "i": 5, "I": 6, "f": 7, "d": 9}
DOUBLE, SINGLE, INT16 = 6, 7, 10


class Writer:
    def __init__(self, order="<", is_compressed=False):
        self.order, self.is_compressed = order, is_compressed

    def element(self, kind, data):
        if 0 < len(data) <= 4:  # Kind and size share one word.
            return struct.pack(self.order + "I", len(data) << 16 | kind) + data + bytes(4 - len(data))
        return struct.pack(self.order + "II", kind, len(data)) + data + bytes(-len(data) % 8)

    def head(self, name, kind, shape):
        return (self.element(6, struct.pack(self.order + "II", kind, 0)) +
                self.element(5, struct.pack(f"{self.order}{len(shape)}i", *shape)) + self.element(1, name.encode()))

    def matrix(self, name, rows, kind=DOUBLE, stored="d"):
        """`rows`: lists of one length; by columns in the file."""
        shape = (len(rows), len(rows[0]))
        flat = [rows[i][j] for j in range(shape[1]) for i in range(shape[0])]
        data = struct.pack(f"{self.order}{len(flat)}{stored}", *flat)
        return self.element(14, self.head(name, kind, shape) + self.element(STORED[stored], data))

    def record(self, name, fields, shape=(1, 1)):
        """`fields`: {name: function of no name to an element}"""
        names = b"".join(field.encode().ljust(32, b"\0") for field in fields)
        return self.element(14, self.head(name, 2, shape) + self.element(5, struct.pack(self.order + "i", 32)) +
                            self.element(1, names) + b"".join(fields.values()))

    def write(self, path, variables):
        head = b"MATLAB 5.0 MAT-file, written for a test".ljust(124) + struct.pack(self.order + "HH", 0x0100, 0x4D49)
        for variable in variables:
            if self.is_compressed:
                packed = zlib.compress(variable)
                variable = struct.pack(self.order + "II", 15, len(packed)) + packed
            head += variable
        path.write_bytes(head)


def column(values):
    return [[value] for value in values]


class Mat(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def convert(self, *words, code=0):
        shutil.rmtree(self.out, ignore_errors=True)
        done = subprocess.run([PROGRAM, f"--output={self.out}", *map(str, words)], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def rows(self, triad, temperature=False):
        prefix = {"accelerometer": "accel", "gyroscope": "gyro", "magnetometer": "mag"}[triad]
        found = []
        for path in self.out.glob("*.csv"):
            with open(path, encoding="ascii") as file:
                for row in csv.DictReader(file):
                    if not row.get(f"{prefix}_x"):
                        continue
                    values = (int(row["time_ns"]), *(float(row[f"{prefix}_{axis}"]) for axis in "xyz"))
                    found.append(values + ((float(row["temperature"]),) if temperature else ()))
        return found

    def each(self):
        for order in "<>":
            for is_compressed in (False, True):
                yield Writer(order, is_compressed)

    def test_variables_with_a_time_each(self):
        acc = [(0.01 * i, [i, -2 * i, 4000 + i]) for i in range(300)]
        gyr = [(0.005 + 0.0025 * i, [0.25 * i, -0.5 * i, 0.125]) for i in range(900)]
        for writer in self.each():
            with self.subTest(order=writer.order, is_compressed=writer.is_compressed):
                path = self.folder / "log.mat"
                writer.write(path, [
                    writer.matrix("t_acc", column([time for time, _ in acc])),
                    # Whole numbers are stored in fewer bytes than their class has.
                    writer.matrix("acc", [values for _, values in acc], stored="h"),
                    writer.record("imu", {
                        "t": writer.matrix("", [[time for time, _ in gyr]]),
                        "gyr": writer.matrix("", list(zip(*[values for _, values in gyr])), SINGLE, "f"),
                        "T": writer.matrix("", column([20 + i // 100 for i in range(900)]), stored="B")})])
                self.convert(path, "--units=s,counts,rad/s,degC",
                             "--columns=accelerometer=acc@t_acc,gyroscope=imu.gyr@imu.t")
                self.assertEqual(self.rows("accelerometer"), [(round(1e9 * time), *values) for time, values in acc])
                self.assertEqual(self.rows("gyroscope"), [(round(1e9 * time), *values) for time, values in gyr])
                self.convert(path, "--units=s,rad/s,degC", "--columns=time=imu.t,gyroscope=imu.gyr,temperature=imu.T")
                self.assertEqual(self.rows("gyroscope", temperature=True),
                                 [(round(1e9 * time), *values, 20 + i // 100) for i, (time, values) in enumerate(gyr)])

    def test_files_with_a_time_each(self):
        for writer in self.each():
            with self.subTest(order=writer.order, is_compressed=writer.is_compressed):
                paths = []
                for name, count, scale in (("acc", 200, 1), ("gyr", 500, 0.5), ("mag", 50, 0.25)):
                    paths.append(self.folder / f"{name}.mat")
                    writer.write(paths[-1], [
                        writer.matrix("time", column([1000 * i for i in range(count)]), stored="i"),
                        writer.matrix("data", [[scale * i, 1, -2] for i in range(count)])])
                self.convert(*paths, "--units=us,m/s^2,rad/s,uT", "--columns=time=time,accelerometer=acc/data,"
                             "gyroscope=gyr/data,magnetometer=mag/data")
                for triad, count, scale in (("accelerometer", 200, 1), ("gyroscope", 500, 0.5), ("magnetometer", 50, 0.25)):
                    self.assertEqual(self.rows(triad), [(1_000_000 * i, scale * i, 1, -2) for i in range(count)])
                # The comma of the command line.
                self.convert(",".join(map(str, paths[:2])), "--units=us,m/s^2",
                             "--columns=accelerometer=acc/data@acc/time")
                self.assertEqual(len(self.rows("accelerometer")), 200)

    def test_times_that_do_not_fit(self):
        writer, path = Writer(), self.folder / "log.mat"
        writer.write(path, [writer.matrix("t", column(range(9))), writer.matrix("acc", [[1, 2, 3]] * 10)])
        said = self.convert(path, "--units=s,g", "--columns=accelerometer=acc@t", code=2)
        self.assertIn("9", said)
        self.assertIn("10", said)
        self.assertIn("no numeric variable `u`", self.convert(path, "--units=s,g", "--columns=accelerometer=acc@u", code=1))
        self.assertFalse(self.out.exists())

    def test_numbers_that_are_none(self):
        """A type that no numbers have, fewer or more than there are, one part of a complex matrix: the library
        would convert what it has not read."""
        rows = [[i, -i, 7] for i in range(99)]
        flat = struct.pack("<297d", *[row[j] for j in range(3) for row in rows])
        writer = Writer()
        head = writer.head("mag", DOUBLE, (99, 3))
        complex_head = head.replace(struct.pack("<II", DOUBLE, 0), struct.pack("<II", DOUBLE | 0x800, 0), 1)
        broken = {"type 77": head + writer.element(77, flat), "text": head + writer.element(16, flat),
                  "more": head + writer.element(9, flat + flat[:8]), "fewer": head + writer.element(9, flat[:-8]),
                  "no imaginary part": complex_head + writer.element(9, flat)}
        sound = [writer.matrix("t", column(range(99))), writer.matrix("acc", rows)]
        path = self.folder / "log.mat"
        for name, mag in broken.items():
            with self.subTest(name):
                writer.write(path, [*sound, writer.element(14, mag)])
                said = self.convert(path, "--units=s,g", "--columns=accelerometer=acc@t")
                self.assertIn("damaged", said)
                self.assertEqual(len(self.rows("accelerometer")), 99)
                # What was asked for and is not there is no success.
                said = self.convert(path, "--units=s,g,uT", "--columns=accelerometer=acc@t,magnetometer=mag@t", code=2)
                self.assertIn("variable mag is missing or incomplete", said)
                self.assertFalse(self.out.exists())

    def test_what_else_there_is(self):
        writer, path = Writer(), self.folder / "log.mat"
        numbers = writer.element(9, struct.pack("<297d", *range(297)))
        flags = writer.element(6, struct.pack("<II", DOUBLE | 0x800, 0))
        head = writer.head("mag", DOUBLE, (99, 3))
        other = {"complex": flags + head[len(flags):] + 2 * numbers,
                 "an array of 3 dimensions": writer.head("mag", DOUBLE, (33, 3, 3)) + numbers,
                 "text": writer.head("mag", 4, (1, 3)) + writer.element(16, b"abc")}
        for what, mag in other.items():
            writer.write(path, [writer.matrix("t", column(range(99))), writer.element(14, mag)])
            said = self.convert(path, "--units=s,uT", "--columns=magnetometer=mag@t", code=1)
            self.assertIn(f"variable `mag` is {what}", said)

    def test_lists_that_say_to_be_longer_than_the_file(self):
        for writer in self.each():
            for depth in (0, 1):
                with self.subTest(order=writer.order, is_compressed=writer.is_compressed, depth=depth):
                    endless = writer.record("logs", {"x": writer.matrix("", [[1]])}, shape=(1, 8_000_000))
                    if depth:
                        endless = writer.record("outer", {"logs": endless})
                    sound = [writer.matrix("t", column(range(99))), writer.matrix("acc", [[1, 2, 3]] * 99)]
                    path = self.folder / "log.mat"
                    writer.write(path, [*sound, endless])
                    said = self.convert(path, "--units=s,g", "--columns=accelerometer=acc@t")
                    self.assertIn("damaged", said)
                    self.assertEqual(len(self.rows("accelerometer")), 99)
                    listed = subprocess.run([PROGRAM, "--list", path], capture_output=True, text=True)
                    self.assertIn("acc", listed.stdout)
                    self.assertIn("damaged", listed.stderr)
                    # As many as it says, of nothing: the library makes room for none.
                    writer.write(path, [*sound, writer.record("logs", {}, shape=(1, 8_000_000))])
                    self.convert(path, "--units=s,g", "--columns=accelerometer=acc@t")

    def test_more_cells_than_anything_has(self):
        for is_compressed in (False, True):
            writer, path = Writer(is_compressed=is_compressed), self.folder / "log.mat"
            empty = struct.pack("<II", 14, 0)
            cells = writer.element(14, writer.head("logs", 1, (1, 1_000_000)) + 1_000_000 * empty)
            writer.write(path, [writer.matrix("t", column(range(99))), writer.matrix("acc", [[1, 2, 3]] * 99), cells])
            said = self.convert(path, "--units=s,g", "--columns=accelerometer=acc@t")
            self.assertIn("has more than 250000 cells", said)
            self.assertEqual(len(self.rows("accelerometer")), 99)

    @classmethod
    def tearDownClass(cls):
        # Of all converters that ran: 8 million structs would take 1.4 GB.
        if resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss > 300_000:
            raise AssertionError("a converter took more than 300 MB")


if __name__ == "__main__":
    if not PROGRAM.exists():
        print("skipped: truetriad-convert-mat was not built: libmatio-dev is missing")
        sys.exit(77)
    unittest.main()
