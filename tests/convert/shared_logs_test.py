#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Converters told by --columns what to read, on recordings of the collection, against readers of struct, zlib,
sqlite3, bz2 and json alone.

Environment: PROGRAMS, the folder of the converters; DATASETS. What is not there is left out.
"""
import bz2
import csv
import json
import math
import os
import shutil
import sqlite3
import struct
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

PROGRAMS = Path(os.environ["PROGRAMS"])
DATASETS = Path(os.environ["DATASETS"])
ROS2 = DATASETS / "e-rosbag2-format"
PREFIXES = {"accelerometer": "accel", "gyroscope": "gyro", "magnetometer": "mag"}


def db3_messages(path, topic):
    """[(received ns, CDR bytes)]"""
    database = sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
    return database.execute("SELECT timestamp, data FROM messages JOIN topics ON topic_id = topics.id "
                            "WHERE name = ? ORDER BY messages.id", (topic,)).fetchall()


def mcap_messages(path, topic):
    """As db3_messages, of a file whose chunks are not compressed."""
    data, topics, messages = path.read_bytes(), {}, []

    def records(begin, end):
        while begin + 9 <= end:
            kind, size = struct.unpack_from("<BQ", data, begin)
            body = begin + 9
            if kind == 4:
                number, _, length = struct.unpack_from("<HHI", data, body)
                topics[number] = data[body + 8:body + 8 + length].decode()
            elif kind == 5:
                number, _, received = struct.unpack_from("<HIQ", data, body)
                if topics[number] == topic:
                    messages.append((received, data[body + 22:body + size]))
            elif kind == 6:
                records(body + 40, body + size)
            begin = body + size

    records(8, len(data) - 8)
    return messages


def stamp_and_rest(cdr):
    """Time of a header in ns, and where the doubles behind it begin."""
    seconds, nanoseconds, length = struct.unpack_from("<iII", cdr, 4)
    return seconds * 10**9 + nanoseconds, 4 + (12 + length + 7) // 8 * 8


def lz4_frame(data):
    """What a frame of LZ4 without dictionary holds."""
    assert data[:4] == bytes.fromhex("04224d18")
    at, out = 7 + 8 * (data[4] >> 3 & 1), bytearray()
    while True:
        size, = struct.unpack_from("<I", data, at)
        at += 4
        if size == 0:
            return bytes(out)
        block = data[at:at + (size & 0x7FFFFFFF)]
        at += len(block) + 4 * (data[4] >> 4 & 1)
        if size >> 31:
            out += block
            continue
        i = 0

        def length(first):
            nonlocal i
            more = 255 if first == 15 else 0
            while more == 255:
                more = block[i]
                first += more
                i += 1
            return first

        while i < len(block):
            token = block[i]
            i += 1
            literals = length(token >> 4)
            out += block[i:i + literals]
            i += literals
            if i >= len(block):
                break
            offset, = struct.unpack_from("<H", block, i)
            i += 2
            for _ in range(4 + length(token & 15)):
                out.append(out[-offset])


def bag_messages(path, topic):
    """[(received ns, bytes)] of a ROS 1 bag."""
    def fields(header):
        found, at = {}, 0
        while at < len(header):
            size, = struct.unpack_from("<I", header, at)
            key, value = header[at + 4:at + 4 + size].split(b"=", 1)
            found[key] = value
            at += 4 + size
        return found

    def records(data, at=0):
        while at + 4 <= len(data):
            size, = struct.unpack_from("<I", data, at)
            header = fields(data[at + 4:at + 4 + size])
            at += 4 + size
            size, = struct.unpack_from("<I", data, at)
            yield header, data[at + 4:at + 4 + size]
            at += 4 + size

    unpack = {b"none": bytes, b"bz2": bz2.decompress, b"lz4": lz4_frame}
    wanted, messages = set(), []
    for header, chunk in records(path.read_bytes(), 13):
        if header[b"op"] != b"\5":
            continue
        for inner, body in records(unpack[header[b"compression"]](chunk)):
            if inner[b"op"] == b"\7" and inner[b"topic"].decode() == topic:
                wanted.add(inner[b"conn"])
            elif inner[b"op"] == b"\2" and inner[b"conn"] in wanted:
                seconds, nanoseconds = struct.unpack("<II", inner[b"time"])
                messages.append((seconds * 10**9 + nanoseconds, body))
    return messages


def mat5_matrix(path):
    """Rows of the one matrix of a MATLAB 5 file: a compressed element, doubles by columns."""
    data = path.read_bytes()
    kind, size = struct.unpack_from("<II", data, 128)
    assert kind == 15
    plain, at, parts = zlib.decompress(data[136:136 + size]), 8, []
    while at < len(plain):
        kind, size = struct.unpack_from("<II", plain, at)
        at += 8
        if kind >> 16:  # A small one, in its own head.
            parts.append(plain[at - 4:at - 4 + (kind >> 16)])
            continue
        parts.append(plain[at:at + size])
        at += (size + 7) // 8 * 8
    rows, columns = struct.unpack("<ii", parts[1])
    values = struct.unpack(f"<{rows * columns}d", parts[3])
    return [values[row::rows] for row in range(rows)]


class SharedLogs(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def convert(self, kind, *words, code=0):
        program = PROGRAMS / f"truetriad-convert-{kind}"
        if not program.exists():
            self.skipTest(f"{program.name} was not built")
        for word in words:
            if isinstance(word, Path) and not word.exists():
                self.skipTest(f"{word} is not there")
        shutil.rmtree(self.out, ignore_errors=True)
        done = subprocess.run([program, f"--output={self.out}", *map(str, words)], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def rows(self, triad):
        """[(time in ns or None, (x, y, z))] of rows that have readings."""
        found = []
        for path in self.out.glob("*.csv"):
            with open(path, encoding="ascii") as file:
                for row in csv.DictReader(file):
                    axes = [row.get(f"{PREFIXES[triad]}_{axis}") for axis in "xyz"]
                    if all(axes):
                        found.append((int(row["time_ns"]) if "time_ns" in row else None, tuple(map(float, axes))))
        return found

    def test_vectors_arrays_and_accelerations_of_ros_2(self):
        for kind, path, messages in (("mcap", ROS2 / "test_bag_mcap.mcap", mcap_messages),
                                     ("ros2-db3", ROS2 / "test_bag_sqlite3.db3", db3_messages)):
            with self.subTest(kind=kind):
                self.convert(kind, path, "--units=g,rad/s", "--columns=accelerometer=/test/geometry_msgs/vector3_stamped,"
                             "gyroscope=/test/std_msgs/float64_multi_array:data")
                expected = []
                for _, cdr in messages(path, "/test/geometry_msgs/vector3_stamped"):
                    stamp, at = stamp_and_rest(cdr)
                    expected.append((stamp, struct.unpack_from("<3d", cdr, at)))
                self.assertEqual(len(expected), 2)
                self.assertEqual(self.rows("accelerometer"), expected)
                # An array's numbers are the last of its message.
                expected = [(received, struct.unpack("<3d", cdr[-24:]))
                            for received, cdr in messages(path, "/test/std_msgs/float64_multi_array")]
                self.assertEqual(self.rows("gyroscope"), expected)
                self.convert(kind, path, "--units=m/s^2,rad/s",
                             "--columns=accelerometer=/test/geometry_msgs/accel_stamped:accel.linear,"
                             "gyroscope=/test/geometry_msgs/twist:angular")
                expected = []
                for _, cdr in messages(path, "/test/geometry_msgs/accel_stamped"):
                    stamp, at = stamp_and_rest(cdr)
                    expected.append((stamp, struct.unpack_from("<3d", cdr, at)))
                self.assertEqual(self.rows("accelerometer"), expected)
                expected = [(received, struct.unpack_from("<3d", cdr, 28))
                            for received, cdr in messages(path, "/test/geometry_msgs/twist")]
                self.assertEqual(self.rows("gyroscope"), expected)
                self.assertIn("name the three readings of", self.convert(
                    kind, path, "--units=g", "--columns=accelerometer=/test/geometry_msgs/accel_stamped", code=1))

    def test_what_a_layout_says_of_a_bag_without_definitions(self):
        path = ROS2 / "plotjuggler_rosbag2_test_0.db3"
        if not path.exists():
            self.skipTest(f"{path} is not there")
        database = sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
        topic, = database.execute("SELECT name FROM topics WHERE type = 'sensor_msgs/msg/Imu'").fetchone()
        received, stamps, rates, forces = [], [], [], []
        for time, cdr in db3_messages(path, topic):
            stamp, at = stamp_and_rest(cdr)
            numbers = struct.unpack_from("<37d", cdr, at)
            received.append(time)
            stamps.append(stamp)
            rates.append(numbers[13:16])
            forces.append(numbers[25:28])
        self.assertEqual(len(rates), 1565)
        layout = self.folder / "Imu.msg"
        fields = ("std_msgs/Header header\nfloat64[4] orientation\nfloat64[9] orientation_covariance\n"
                  "float64[3] angular_velocity\nfloat64[9] angular_velocity_covariance\nfloat64[3] force\n"
                  "float64[9] force_covariance\n")
        # A header of the user's own has no stamp.
        for header, times in (("", stamps), ("MSG: std_msgs/Header\nint32 sec\nuint32 nanosec\nstring id\n", received)):
            layout.write_text(fields + header)
            self.convert("ros2-db3", path, "--units=m/s^2,rad/s", f"--layout={layout}",
                         f"--columns=accelerometer={topic}:force,gyroscope={topic}:angular_velocity")
            self.assertEqual(self.rows("gyroscope"), sorted(zip(times, rates)))
            self.assertEqual(self.rows("accelerometer"), sorted(zip(times, forces)))

    def test_fields_of_ros_1(self):
        path = DATASETS / "e-rosbag1" / "no_imu_lz4.bag"
        self.convert("ros1", path, "--units=rad/s", "--columns=gyroscope=/turtle1/cmd_vel:angular")
        self.assertEqual(self.rows("gyroscope"), [(received, struct.unpack_from("<3d", body, 24))
                                                  for received, body in bag_messages(path, "/turtle1/cmd_vel")])
        self.assertEqual(len(self.rows("gyroscope")), 357)
        path = DATASETS / "e-rosbag1" / "phidgets_imu_upside_down.bag"
        self.convert("ros1", path, "--units=m/s^2,T", "--columns=magnetometer=/imu/mag:magnetic_field,"
                     "accelerometer=/imu/data_raw:linear_acceleration")
        for triad, topic, first in (("accelerometer", "/imu/data_raw", 25), ("magnetometer", "/imu/mag", 0)):
            expected = []
            for _, body in bag_messages(path, topic):
                _, seconds, nanoseconds, length = struct.unpack_from("<4I", body)
                values = struct.unpack_from("<3d", body, 16 + length + 8 * first)
                if all(map(math.isfinite, values)):
                    expected.append((seconds * 10**9 + nanoseconds, values))
            self.assertEqual(self.rows(triad), sorted(expected))

    def test_matrix_of_matlab(self):
        name = "MobileAccData30orientationRawSample01"
        path = DATASETS / "a-phone-lis3dh-34pose" / f"{name}.mat"
        self.convert("mat", path, "--units=m/s^2", f"--columns=time=50Hz,accelerometer={name}")
        expected = [(20_000_000 * i, row) for i, row in enumerate(mat5_matrix(path))]
        self.assertEqual(len(expected), 8042)
        self.assertEqual(self.rows("accelerometer"), expected)

    def test_poses_of_json_with_nan_and_without_time(self):
        folder = DATASETS / "a-sap-acc-mag-24pose"
        for path in sorted(folder.glob("sap5_*.json")):
            self.convert("json", path, "--units=g,uT",
                         "--columns=time=none,accelerometer=shots.grav:xyz,magnetometer=shots.mag:xyz")
            shots = json.loads(path.read_text())["shots"]
            for triad, key in (("accelerometer", "grav"), ("magnetometer", "mag")):
                flat = shots[key]
                expected = [(None, tuple(flat[i:i + 3])) for i in range(0, len(flat), 3)
                            if all(map(math.isfinite, flat[i:i + 3]))]
                self.assertEqual(len(expected), 24, path)
                self.assertEqual(self.rows(triad), expected)
        path = folder / "sap6_BB.json"
        self.convert("json", path, "--units=m/s^2,uT", "--columns=time=none,accelerometer=grav,magnetometer=mag")
        device = json.loads(path.read_text())
        self.assertEqual(self.rows("magnetometer"), [(None, tuple(row)) for row in device["mag"]])

    def test_sensors_of_two_json_files_with_a_rate_each(self):
        folder = DATASETS / "b-mag-krepa-json"
        gyr, acc = folder / "gyro_test_data_1.json", folder / "accel_test_data_1.json"
        self.convert("json", gyr, acc, "--units=m/s^2,rad/s", "--columns=gyroscope=gyro_test_data_1/gyro@100Hz,"
                     "accelerometer=accel_test_data_1/acc@50Hz")
        for triad, path, key, period, count in (("gyroscope", gyr, "gyro", 10_000_000, 389),
                                                ("accelerometer", acc, "acc", 20_000_000, 667)):
            expected = [(period * i, tuple(row)) for i, row in enumerate(json.loads(path.read_text())[key])]
            self.assertEqual(len(expected), count)
            self.assertEqual(self.rows(triad), expected)


if __name__ == "__main__":
    unittest.main()
