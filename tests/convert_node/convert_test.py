#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The converters of ULog, MCAP and Parquet against independent readers of the same files.

Environment: PROGRAMS (folder of the converters), TRUETRIAD, DATASETS.
"""
import csv
import json
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

import readers
import writers

PROGRAMS = Path(os.environ["PROGRAMS"])
DATASETS = Path(os.environ["DATASETS"])
HERE = Path(__file__).resolve().parent
ULOG = DATASETS / "e-ulog-px4"
MCAP = DATASETS / "e-rosbag2-format" / "test_bag_mcap.mcap"
TABLE = HERE / "table.parquet"
ONE_DEVICE = "uint64_t timestamp;uint32_t device_id;float x;float y;float z;"


def run(arguments, **options):
    return subprocess.run([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          encoding="utf-8", errors="replace", **options)


def float32(text):
    return struct.unpack("f", struct.pack("f", float(text)))[0]


class Converters(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def convert(self, kind, source, *flags, code=0):
        if not Path(source).exists() and code == 0:
            self.skipTest(f"{source} is not there")
        done = run([PROGRAMS / f"truetriad-convert-{kind}", source, f"--output={self.out}", *flags])
        self.assertEqual(done.returncode, code, done.stderr)
        # Nothing half done stays.
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.startswith(".out")], [])
        if code:
            self.assertFalse(self.out.exists())
            self.assertIn(f"truetriad-convert-{kind}: ", done.stderr)
            self.assertNotIn("    at ", done.stderr)
        return done

    def rows(self, name):
        """[(time_ns, [x, y, z], temperature text)]"""
        with open(self.out / name, encoding="ascii") as file:
            lines = list(csv.reader(file))
        return [(int(line[0]), line[1:4], line[4] if len(line) == 5 else "") for line in lines[1:]]

    def inspect(self, name="recording.yaml", code=None):
        done = run([os.environ["TRUETRIAD"], "inspect", f"--input={self.out / name}"])
        if code is not None:
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    # ------------------------------------------------------------------------------------ ULog

    def check_ulog(self, name, log, topic, instance, fields, time=None):
        """Every row of a CSV against the reader: times exactly, readings as float32."""
        rows = self.rows(name)
        expected = []
        for row in log[(topic, instance)]:
            stamp = time(row) if time else row["timestamp_sample"]
            if expected and time and stamp * 1000 == expected[-1][0]:
                continue  # A combined topic repeats slower sensors.
            values = row[fields] if isinstance(fields, str) else [row[field] for field in fields]
            expected.append((stamp * 1000, tuple(values)))
        self.assertEqual([row[0] for row in rows], [row[0] for row in expected])
        self.assertEqual([tuple(map(float32, row[1])) for row in rows], [row[1] for row in expected])
        return rows

    def test_an_input_is_not_overwritten(self):
        self.out.mkdir()
        source = self.out / "recording.yaml"
        shutil.copy(TABLE, source)
        done = run([PROGRAMS / "truetriad-convert-parquet", source, f"--output={self.out}"])
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("would be overwritten, and it is an input", done.stderr)
        self.assertEqual(source.read_bytes(), TABLE.read_bytes())
        self.assertEqual([p.name for p in self.out.iterdir()], ["recording.yaml"])
        self.assertEqual([p.name for p in self.folder.iterdir()], ["out"])

    def test_ulog_with_three_instances_gives_a_recording_each(self):
        source = ULOG / "sample_log_small.ulg"
        done = self.convert("ulog", source)
        log = readers.ulog_rows(source)
        for instance, suffix in ((0, ""), (1, "-1"), (2, "-2")):
            for topic, sensor in (("sensor_accel", "accelerometer"), ("sensor_gyro", "gyroscope")):
                rows = self.check_ulog(f"{sensor}{suffix}.csv", log, topic, instance, ("x", "y", "z"))
                self.assertEqual(len(rows), 6)
                warmth = [float32(row[2]) for row in rows]
                self.assertEqual(warmth, [row["temperature"] for row in log[(topic, instance)]])
                self.assertTrue(28 <= min(warmth) and max(warmth) <= 41)
        for instance, suffix in ((0, ""), (1, "-1")):
            rows = self.check_ulog(f"magnetometer{suffix}.csv", log, "sensor_mag", instance, ("x", "y", "z"))
            self.assertEqual({row[2] for row in rows}, {""})
        self.assertFalse((self.out / "magnetometer-2.csv").exists())
        text = (self.out / "recording.yaml").read_text()
        # The firmware is PX4 1.11.2, whose gyroscopes at rest read CAL_GYROn_*OFF: nothing was done to them. The
        # compass that it used is the same in sensor_mag and vehicle_magnetometer, however large CAL_MAG1_*OFF are.
        self.assertEqual(text.count("offset: ["), 1)
        self.assertIn("sensor_mag#0, magnetometer: corrected by its driver", done.stderr)
        for part in ("applied:\n  magnetometer:\n    offset: [-0.00253633014,-0.221725479,0.0290883482]\n    scale: [0.9977",
                     "frame: \"board-frd\"", "unit: G\n", "serial: \"0006", "2424842",
                     "dropouts: \"1, 30 ms\""):
            self.assertIn(part, text)
        self.assertEqual(text.count("temperature: {column"), 2)
        # Six readings in five seconds: readable, but no rest.
        for name in ("recording.yaml", "recording-1.yaml", "recording-2.yaml"):
            done = self.inspect(name, code=3)
            self.assertIn("accelerometer", done.stdout)

    def test_ulog_one_instance_alone(self):
        self.convert("ulog", ULOG / "sample_log_small.ulg", "--instance=1")
        self.assertEqual(sorted(p.name for p in self.out.iterdir()),
                         ["accelerometer-1.csv", "gyroscope-1.csv", "magnetometer-1.csv", "recording.yaml"])
        self.inspect(code=3)

    def test_ulog_of_a_board_turned_about_two_axes_says_how(self):
        data = bytearray((ULOG / "sample.ulg").read_bytes())
        value = data.index(b"int32_t SENS_BOARD_ROT") + len(b"int32_t SENS_BOARD_ROT")
        matrices = []
        for rotation in (0, 9, 41):
            data[value:value + 4] = struct.pack("<i", rotation)
            (self.folder / "turned.ulg").write_bytes(data)
            self.convert("ulog", self.folder / "turned.ulg", "--topic=sensor_combined")
            text = (self.out / "recording.yaml").read_text()
            matrices += [json.loads(line.split(": ")[1]) for line in text.splitlines() if "matrix:" in line][:1]
        # Rolled by half a turn, then turned by 45 degrees; 41 is none that PX4 shares with others.
        self.assertEqual(len(matrices), 2)
        self.assertIn("accelerometer: unknown", text)
        half = 0.5**0.5
        turned = ((half, half, 0), (half, -half, 0), (0, 0, -1))
        for row, found in zip(*matrices):
            for j in range(3):
                self.assertAlmostEqual(found[j], sum(row[k] * turned[k][j] for k in range(3)), 12)

    def test_ulog_of_the_old_layout_is_corrected_and_says_how(self):
        source = ULOG / "sample.ulg"
        self.convert("ulog", source, "--topic=sensor_combined")
        log = readers.ulog_rows(source)
        topic = "sensor_combined"
        # 17070 rows: README and sample_info.txt.
        rows = self.check_ulog("gyroscope.csv", log, topic, 0, "gyro_rad", lambda row: row["timestamp"])
        self.assertEqual(len(rows), 17070)
        for sensor, field in (("accelerometer", "accelerometer_m_s2"), ("magnetometer", "magnetometer_ga")):
            self.check_ulog(f"{sensor}.csv", log, topic, 0, field,
                            lambda row: row["timestamp"] + row[f"{sensor}_timestamp_relative"])
        text = (self.out / "recording.yaml").read_text()
        for part in ("offset: [-0.202487469,0.3495574,-0.613710403]", "scale: [1.00433397",
                     "dropouts: \"4, "):
            self.assertIn(part, text)
        # Reading the recording undoes what the firmware did.
        done = self.inspect()
        self.assertIn(done.returncode, (0, 3), done.stderr)
        self.assertIn("17070", done.stdout)

    def test_ulog_corrected_readings_are_refused_unless_asked_for(self):
        if not ULOG.exists():
            self.skipTest("the recordings are not there")
        done = self.convert("ulog", ULOG / "sample.ulg", code=2)
        self.assertIn("--topic=sensor_combined", done.stderr)
        done = self.convert("ulog", ULOG / "sample.ulg", "--topic=sensor_accel", code=1)
        self.assertIn("it contains sensor_combined", done.stderr)
        done = self.convert("ulog", ULOG / "sample_log_small.ulg", "--instance=7", code=1)
        self.assertIn("0, 1, 2", done.stderr)

    def test_ulog_list_counts_the_rows(self):
        source = ULOG / "sample.ulg"
        if not source.exists():
            self.skipTest("the recordings are not there")
        listed = run([PROGRAMS / "truetriad-convert-ulog", source, "--list"]).stdout.splitlines()[1:]
        counts = {line.split()[0]: int(line.split()[2]) for line in listed}
        stated = {}
        for line in (ULOG / "sample_info.txt").read_text().splitlines():
            words = line.replace(",", " ").split()
            if len(words) == 5 and words[1].startswith("("):
                stated[words[0]] = int(words[3])
        self.assertEqual(len(stated), 15)
        self.assertEqual(counts, stated)

    def parameter(self, name, value):
        kind, layout = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
        key = f"{kind} {name}".encode()
        return writers.message(b"P", bytes([len(key)]) + key + struct.pack(layout, value))

    def release(self, number):
        key = b"uint32_t ver_sw_release"
        return writers.message(b"I", bytes([len(key)]) + key + struct.pack("<I", number))

    def made_ulog(self, definitions, rows, appended=b""):
        """A log of messages [(topic, instance, bytes)]."""
        def message(kind, body):
            return struct.pack("<Hc", len(body), kind) + body

        data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
        for name, fields in definitions.items():
            data += message(b"F", f"{name}:{fields}".encode())
        numbers = {}
        for topic, instance, body in rows:
            if (topic, instance) not in numbers:
                numbers[(topic, instance)] = len(numbers)
                data += message(b"A", struct.pack("<BH", instance, numbers[(topic, instance)]) + topic.encode())
            data += message(b"D", struct.pack("<H", numbers[(topic, instance)]) + body)
        path = self.folder / "made.ulg"
        path.write_bytes(data + appended)
        return path

    def test_ulog_of_old_firmware_gives_the_counts_of_the_chip(self):
        fields = "uint64_t timestamp;float x;float y;float z;float scaling;int16_t x_raw;int16_t y_raw;int16_t z_raw;"
        rows = [("sensor_accel", 0, struct.pack("<Q4f3h", 1000 * i, 1, 2, 3, 0.25, i, -i, 2048)) for i in range(9)]
        self.convert("ulog", self.made_ulog({"sensor_accel": fields}, rows))
        self.assertEqual([row[:2] for row in self.rows("accelerometer.csv")],
                         [(1000000 * i, [str(i), str(-i), "2048"]) for i in range(9)])
        text = (self.out / "recording.yaml").read_text()
        self.assertIn("unit: counts\n    si_per_count: 0.25\n", text)
        # Of a magnetometer it states gauss, and a recording uT.
        rows = [("sensor_mag", *row[1:]) for row in rows]
        done = self.convert("ulog", self.made_ulog({"sensor_mag": fields}, rows))
        self.assertIn("si_per_count: 25\n", (self.out / "recording.yaml").read_text())
        self.assertIn("has no parameters", done.stderr)

    def test_ulog_counts_are_turned_as_the_driver_turned_its_readings(self):
        fields = "uint64_t timestamp;float x;float y;float z;float scaling;int16_t x_raw;int16_t y_raw;int16_t z_raw;"
        chips = [(300 * (i % 7) - 900, 200 * (i % 5) - 400, 100 * (i % 3) + 500) for i in range(60)]
        half = math.sqrt(0.5)
        # Not at all, yaw by 90 and by 45 degrees, and roll by 180 degrees.
        for turn in (lambda x, y, z: (x, y, z), lambda x, y, z: (-y, x, z),
                     lambda x, y, z: (half * (x - y), half * (x + y), z), lambda x, y, z: (x, -y, -z)):
            rows = []
            for i, counts in enumerate(chips):
                x, y, z = (0.01 * v for v in turn(*counts))
                rows.append(("sensor_gyro", 0, struct.pack("<Q4f3h", 1000 * i, 1.2 * x + 3, 0.9 * y - 1, z + 2, 0.01, *counts)))
            done = self.convert("ulog", self.made_ulog({"sensor_gyro": fields}, rows))
            for (_, found, _), counts in zip(self.rows("gyroscope.csv"), chips):
                for value, expected in zip(map(float, found), turn(*counts)):
                    self.assertAlmostEqual(value, expected, 4)
            self.assertEqual("rotated into the axes of x, y and z" in done.stderr, turn(1, 2, 3) != (1, 2, 3))
        # What does not move shows nothing.
        rows = [("sensor_gyro", 0, struct.pack("<Q4f3h", 1000 * i, 1, 2, 3, 0.01, 1, 2, i)) for i in range(9)]
        self.assertIn("x, y and z do not determine its rotation", self.convert("ulog", self.made_ulog({"sensor_gyro": fields}, rows)).stderr)

    def test_ulog_of_2020_may_be_corrected_by_the_drivers(self):
        own = {"CAL_ACC0_ID": 7, "CAL_ACC0_XOFF": 0.25, "CAL_ACC0_XSCALE": 1.5, "CAL_MAG0_ID": 7, "CAL_MAG0_YOFF": 0.5,
               "CAL_MAG0_ZSCALE": 2.0, "CAL_MAG0_ROT": 2}
        acc, mag = "offset: [0.25,0,0]\n    scale: [1.5,1,1]\n", "offset: [-0.5,0,0]\n    matrix: [[0,1,0],[-1,0,0],[0,0,2]]\n"
        turned = "matrix: [[0,1,0],[-1,0,0],[0,0,1]]\n"
        for release, parameters, accelerometer, magnetometer in (
                (0x010A00FF, own, acc, mag), (0x010B03FF, own, None, mag), (0x010C00FF, own, None, turned), (None, own, None, turned),
                (0x010B0080, own, "unknown", "unknown"), (0x010B0080, own | {"CAL_ACC0_ID": 8, "CAL_MAG0_ID": 8}, None, None),
                (0x010A00FF, own | {"CAL_ACC0_XSCALE": 0.0}, "unknown", mag)):
            rows = [(f"sensor_{kind}", 0, struct.pack("<QI3f", 1000 * i, 7, i, -i, 2)) for i in range(9) for kind in ("accel", "mag")]
            said = b"".join(self.parameter(*one) for one in parameters.items()) + (self.release(release) if release else b"")
            self.convert("ulog", self.made_ulog({"sensor_accel": ONE_DEVICE, "sensor_mag": ONE_DEVICE}, rows, said))
            text = (self.out / "recording.yaml").read_text()
            said = text[text.index("\napplied:") + 1:text.index("streams:")]
            for sensor, applied in (("accelerometer", accelerometer), ("magnetometer", magnetometer)):
                part = said.partition(f"{sensor}:")[2].partition("  magnetometer:")[0].strip() + "\n"
                self.assertEqual(part, "\n" if applied is None else applied.strip() + "\n", hex(release or 0))

    def test_ulog_fifo_spreads_its_samples_back_from_its_stamp(self):
        fields = ("uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float dt;float scale;"
                  "int16_t[4] x;int16_t[4] y;int16_t[4] z;uint8_t samples;")
        body = lambda t, n, first: struct.pack("<QQIff12hB", t + 300, t, 7, 125.0, 0.5,
                                               *range(first, first + 4), *([2] * 4), *([-3] * 4), n)
        rows = [("sensor_accel_fifo", 0, body(10000, 4, 0)), ("sensor_accel_fifo", 0, body(10375, 3, 10))]
        self.convert("ulog", self.made_ulog({"sensor_accel_fifo": fields}, rows))
        self.assertEqual([row[:2] for row in self.rows("accelerometer.csv")],
                         [(1000 * t, [f"{x / 2:g}", "1", "-1.5"]) for t, x in
                          ((9625, 0), (9750, 1), (9875, 2), (10000, 3), (10125, 10), (10250, 11), (10375, 12))])

    def test_ulog_fifo_is_turned_where_it_states_a_rotation(self):
        fields = ("uint64_t timestamp_sample;uint32_t device_id;float dt;float scale;int16_t x;int16_t y;int16_t z;"
                  "uint8_t samples;uint8_t rotation;")
        row = lambda rotation: [("sensor_gyro_fifo", 0, struct.pack("<QIff3hBB", 1000, 7, 125.0, 0.5, 2, 4, 6, 1, rotation))]
        for rotation, expected in ((0, ["1", "2", "3"]), (8, ["1", "-2", "-3"])):  # ROLL_180
            self.convert("ulog", self.made_ulog({"sensor_gyro_fifo": fields}, row(rotation)))
            self.assertEqual(self.rows("gyroscope.csv")[0][1][:3], expected)

    def test_ulog_fifo_takes_the_place_of_its_own_sensor_alone(self):
        plain = lambda i, device: ("sensor_accel", i, struct.pack("<QI3f", 1000, device, device, 0, 0))
        fields = "uint64_t timestamp_sample;uint32_t device_id;float dt;float scale;int16_t x;int16_t y;int16_t z;uint8_t samples;"
        fifo = lambda i, device: ("sensor_accel_fifo", i, struct.pack("<QIff3hB", 1000, device, 125.0, 0.5, 2 * device, 2, 2, 1))
        # The FIFO of the second device; of one that has no other topic; of devices that are not stated.
        for rows, expected in (([plain(0, 7), plain(1, 8), fifo(0, 8)], {"": ("7", "0"), "-1": ("8", "1")}),
                               ([plain(0, 7), fifo(0, 9), fifo(1, 7)], {"": ("7", "1"), "-1": ("9", "1")}),
                               ([plain(0, 0), plain(1, 0), fifo(1, 0)], {"": ("0", "0"), "-1": ("0", "1")})):
            self.convert("ulog", self.made_ulog({"sensor_accel": ONE_DEVICE, "sensor_accel_fifo": fields}, rows))
            for suffix, (x, y) in expected.items():
                self.assertEqual([row[1][:2] for row in self.rows(f"accelerometer{suffix}.csv")], [[x, y]])
            self.assertFalse((self.out / "accelerometer-2.csv").exists())

    def test_ulog_takes_the_other_stamp_where_that_of_the_sample_is_zero(self):
        fields = ONE_DEVICE.replace("uint32_t", "uint64_t timestamp_sample;uint32_t", 1)
        rows = [("sensor_mag", 0, struct.pack("<QQI3f", 1000 + i, sample, 7, i, 0, 0)) for i, sample in enumerate((0, 0, 1500))]
        self.convert("ulog", self.made_ulog({"sensor_mag": fields}, rows))
        self.assertEqual([row[0] for row in self.rows("magnetometer.csv")], [1000000, 1001000, 1500000])

    def test_ulog_says_where_the_vehicle_has_a_sensor_at_the_end(self):
        rows = [("sensor_accel", 0, struct.pack("<QI3f", 1000 * i, 7, i, -i, 2)) for i in range(9)]
        stated = (("CAL_ACC0_ID", 777), ("CAL_ACC1_ID", 7), ("TC_A0_ID", 0), ("TC_A2_ID", 0),
                  ("CAL_ACC0_ID", 7), ("CAL_ACC1_ID", 0), ("TC_A2_ID", 7))
        self.convert("ulog", self.made_ulog({"sensor_accel": ONE_DEVICE}, rows, b"".join(self.parameter(*one) for one in stated)))
        text = (self.out / "recording.yaml").read_text()
        self.assertIn(" slots: { accelerometer: 0 }, thermal_slots: { accelerometer: 2 }", text)

    def test_ulog_of_two_devices_in_turn_is_of_two_sensors(self):
        def log(numbers, serials=()):
            rows = [("sensor_accel", 0, struct.pack("<QI3f", 1000 * i, n, i, -i, 2)) for i, n in enumerate(numbers)]
            again = writers.message(b"A", struct.pack("<BH", 0, 0) + b"sensor_accel")
            again += b"".join(writers.message(b"I", b"\x10char[2] sys_uuid" + serial) for serial in serials)
            row = writers.message(b"D", struct.pack("<H", 0) + rows[-1][2])
            return self.made_ulog({"sensor_accel": ONE_DEVICE}, rows, again + row)
        done = self.convert("ulog", log([7] * 9 + [8]), code=2)
        self.assertIn("sensor_accel#0 is of device 7 and then of 8", done.stderr)
        self.assertIn("logs of several vehicles", self.convert("ulog", log([7] * 9, (b"ab", b"ac")), code=2).stderr)
        # Said again, and a row whose number is damaged.
        self.convert("ulog", log([7] * 4 + [8] + [7] * 4, (b"ab", b"ab")))
        self.assertEqual(len(self.rows("accelerometer.csv")), 10)
        self.assertIn("ids: { accelerometer: 7 }", (self.out / "recording.yaml").read_text())

    def test_ulog_keeps_what_is_whole_around_damage(self):
        fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;"
        rows = [("sensor_gyro", 0, struct.pack("<QQ3f", 1000 * i, 1000 * i, i, 1, 2)) for i in range(1, 201)]
        path = self.made_ulog({"sensor_gyro": fields}, rows)
        data = bytearray(path.read_bytes())
        size = 3 + 2 + 28
        begin = len(data) - 200 * size
        data[begin + 50 * size] ^= 0xFF  # The length of one message,
        data[begin + 120 * size + 2] = 0  # the type of another,
        del data[-7:]  # and the end.
        path.write_bytes(data)
        done = self.convert("ulog", path)
        self.assertEqual([row[0] for row in self.rows("gyroscope.csv")],
                         [1000000 * i for i in range(1, 200) if i not in (51, 121)])
        self.assertIn("3 damaged places", done.stderr)
        self.assertIn("damage: \"3 damaged places", (self.out / "recording.yaml").read_text())

    def test_ulog_with_appended_data_has_no_damage(self):
        # After a crash the firmware appends to a log whose last message was not written to its end, and
        # states where. Information has names that no field can have.
        data, offsets = writers.appended_ulog()
        path = self.folder / "appended.ulg"
        path.write_bytes(data)
        log = readers.ulog_rows(path)
        done = self.convert("ulog", path)
        rows = self.check_ulog("gyroscope.csv", log, "sensor_gyro", 0, ("x", "y", "z"))
        self.assertEqual([time for time, _, _ in rows], [4000000 * i for i in (*range(100), *range(150, 300))])
        self.assertNotIn("damage", done.stderr + (self.out / "recording.yaml").read_text())
        # An offset that a damaged header states costs no more than the message that it is in.
        struct.pack_into("<Q", data, writers.OFFSETS_AT, offsets[0] - 500)
        path.write_bytes(data)
        shutil.rmtree(self.out)
        self.assertIn("damaged", self.convert("ulog", path).stderr)
        self.assertGreaterEqual(len(self.rows("gyroscope.csv")), 248)

    def test_ulog_knows_a_begun_message_from_damage(self):
        def damage(crashed):
            path = self.folder / "crashed.ulg"
            path.write_bytes(writers.appended_ulog(crashed)[0])
            shutil.rmtree(self.out, ignore_errors=True)
            done = self.convert("ulog", path)
            self.assertEqual(len(self.rows("gyroscope.csv")), 250)
            return "damage" in done.stderr
        message = writers.message
        sync = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
        for begun in (message(b"S", sync)[:6], message(b"O", b"\1\2")[:4], message(b"A", b"\0\1\0sensor_mag")[:9],
                      message(b"F", b"sensor_mag:float x;float y;")[:12], message(b"I", b"\x09char[3] kabc")[:9],
                      message(b"P", b"\x09float OFF\0\0\0\0")[:14], message(b"L", b"6" + bytes(8) + b"text")[:7]):
            self.assertFalse(damage(begun), begun)
        for broken in (message(b"S", sync + bytes(300))[:6], message(b"S", bytes(8))[:6], message(b"O", bytes(9))[:4],
                       message(b"A", b"\0\1\0????????")[:9], message(b"F", b"sensor\0mag:float x;")[:12],
                       message(b"I", b"\x09!!!!!!!!!abc")[:9], message(b"P", b"\0float OFF\0\0\0\0")[:14],
                       message(b"L", b"\1" + bytes(8) + b"text")[:7], message(b"z", bytes(9))[:7]):
            self.assertTrue(damage(broken), broken)

    def test_ulog_clock_that_jumps_for_one_row_leaves_that_row_out(self):
        fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;"
        times = [1000 * i for i in range(1, 4001)]
        times[10], times[3000] = 1 << 62, 1 << 50
        times[3500] = 5
        rows = [("sensor_gyro", 0, struct.pack("<QQ3f", t, t, 1, 1, 2)) for t in times]
        done = self.convert("ulog", self.made_ulog({"sensor_gyro": fields}, rows))
        kept = [row[0] for row in self.rows("gyroscope.csv")]
        self.assertEqual(kept, [1000000 * i for i in range(1, 4001) if i not in (11, 3001, 3501)])
        self.assertIn("skipped", done.stderr)

    # ------------------------------------------------------------------------------------ MCAP

    def test_mcap_agrees_with_an_independent_reader(self):
        self.convert("mcap", MCAP)
        found = {"/test/sensor_msgs/imu": [], "/test/sensor_msgs/magnetic_field": []}
        for topic, cdr in readers.mcap_messages(MCAP):
            if topic in found:
                found[topic].append(cdr)
        imu, magnetometer = [], []
        for cdr in found["/test/sensor_msgs/imu"]:
            time, at = readers.header_of(cdr)
            # Orientation and covariance, rate and covariance, acceleration and covariance.
            values = readers.doubles(cdr, at, 37)
            imu.append([time, *values[13:16], *values[25:28]])
        for cdr in found["/test/sensor_msgs/magnetic_field"]:
            time, at = readers.header_of(cdr)
            magnetometer.append([time, *(1e6 * tesla for tesla in readers.doubles(cdr, at, 3))])
        for name, expected in (("imu", imu), ("magnetometer", magnetometer)):
            self.assertEqual(len(expected), 2)
            with open(self.out / f"{name}.csv", encoding="ascii") as file:
                rows = [[int(line[0]), *map(float, line[1:])] for line in list(csv.reader(file))[1:]]
            self.assertEqual(rows, expected)
        text = (self.out / "recording.yaml").read_text()
        for part in ("unit: m/s^2", "unit: rad/s", "unit: uT\n", "frame: \"test_frame\""):
            self.assertIn(part, text)
        self.inspect(code=3)

    def test_mcap_topics_are_chosen_by_name(self):
        self.convert("mcap", MCAP, "--topic=/test/sensor_msgs/magnetic_field")
        self.assertEqual(sorted(p.name for p in self.out.iterdir()), ["magnetometer.csv", "recording.yaml"])

    def test_mcap_that_was_not_closed_gives_what_is_whole(self):
        if not MCAP.exists():
            self.skipTest("the recordings are not there")
        cut = self.folder / "cut.mcap"
        cut.write_bytes(MCAP.read_bytes()[:70000])  # Inside its one chunk.
        done = self.convert("mcap", cut)
        self.assertEqual(len(self.rows("imu.csv")), 2)
        self.assertIn("damaged: 1 chunk and", done.stderr)

    def made_mcap(self, compressions, crc=True):
        """(bytes, where each chunk begins) of chunks of ten messages each; stamps 1 s, 2 s, …"""
        def record(kind, body):
            return struct.pack("<BQ", kind, len(body)) + body

        def text(words):
            return struct.pack("<I", len(words)) + words.encode()

        definition = ("std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n" + "=" * 80 +
                      "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80 +
                      "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n")
        known = record(3, struct.pack("<H", 1) + text("sensor_msgs/msg/MagneticField") + text("ros2msg") + text(definition))
        known += record(4, struct.pack("<HH", 0, 1) + text("/mag") + text("cdr") + struct.pack("<I", 0))
        data, places, index, stamp = b"\x89MCAP0\r\n" + record(1, text("ros2") + text("")), [], b"", 0
        for compression in compressions:
            records = known
            for _ in range(10):
                stamp += 1
                # An empty string still has its NUL; the doubles begin on a multiple of eight.
                cdr = b"\0\1\0\0" + struct.pack("<iII4x3d72x", stamp, 0, 1, stamp, 2 * stamp, -1)
                records += record(5, struct.pack("<HIQQ", 0, stamp, stamp, stamp) + cdr)
            stored = records
            if compression == "lz4":  # A frame of one block that is stored as it is.
                stored = bytes.fromhex("04224d18604082") + struct.pack("<I", len(records) | 1 << 31) + records + bytes(4)
            elif compression == "zstd":
                stored = (bytes.fromhex("28b52ffda0") + struct.pack("<I", len(records)) +
                          (len(records) << 3 | 1).to_bytes(3, "little") + records)
            chunk = record(6, struct.pack("<QQQI", 0, 0, len(records), zlib.crc32(records) if crc else 0) +
                           text(compression) + struct.pack("<Q", len(stored)) + stored)
            places.append(len(data))
            index += record(8, struct.pack("<QQQQIQ", 0, 0, len(data), len(chunk), 0, 0) + text(compression) + bytes(16))
            data += chunk
        data += record(15, bytes(4))
        summary = len(data)
        data += index + record(2, struct.pack("<QQI", summary, 0, 0)) + b"\x89MCAP0\r\n"
        return bytearray(data), places

    def seconds(self, data, *flags):
        """Stamps that come out of an MCAP file, and what was said."""
        path = self.folder / "made.mcap"
        path.write_bytes(data)
        done = self.convert("mcap", path, *flags)
        rows = self.rows("magnetometer.csv")
        for time, values, _ in rows:
            self.assertEqual(list(map(float, values)), [time / 1e3, 2 * time / 1e3, -1e6])
        return [time // 10**9 for time, _, _ in rows], done.stderr

    def test_mcap_chunks_may_be_compressed(self):
        data, _ = self.made_mcap(["", "lz4", "zstd"])
        self.assertEqual(self.seconds(data)[0], list(range(1, 31)))

    def test_mcap_damaged_chunk_is_left_out(self):
        for compression in ("", "lz4", "zstd"):
            data, places = self.made_mcap(["", compression, ""])
            data[places[1] + 600] ^= 1
            kept, said = self.seconds(data)
            self.assertEqual(kept, [*range(1, 11), *range(21, 31)], compression)
            self.assertIn("damaged: 1 chunk and 0 records incomplete", said)

    def test_mcap_goes_on_at_the_next_chunk(self):
        data, places = self.made_mcap(["zstd"] * 4)
        data[places[1] + 5] = 0xFF  # Longer than the file.
        data[places[2]] = 0  # No kind of record.
        for end in (len(data), -1):  # With the index, and cut before its end.
            kept, said = self.seconds(data[:end])
            self.assertEqual(kept, [*range(1, 11), *range(31, 41)])
            self.assertIn("damaged: 0 chunks and 1 record incomplete", said)

    def test_mcap_wrong_topic_is_usage(self):
        if not MCAP.exists():
            self.skipTest("the recordings are not there")
        self.assertIn("the bag contains", self.convert("mcap", MCAP, "--topic=/nothing", code=1).stderr)
        self.assertIn("supported are Imu, MagneticField and Temperature", self.convert(
            "mcap", MCAP, "--topic=/test/geometry_msgs/twist", code=1).stderr)

    # --------------------------------------------------------------------------------- Parquet

    def test_parquet_values_are_those_it_was_made_of(self):
        # table.parquet: row i of 500, four row groups; README.md says the formulas.
        self.convert("parquet", TABLE)
        rows = self.rows("accelerometer.csv")
        self.assertEqual(len(rows), 500)
        for i, (time, values, temperature) in enumerate(rows):
            self.assertEqual(time, 1767225600000000000 + 10000001 * i)
            self.assertAlmostEqual(float(values[0]), math.sin(0.01 * i), delta=1e-7)  # float32
            self.assertAlmostEqual(float(values[1]), math.sin(0.01 * (i + 1)), delta=1e-7)
            self.assertEqual(float(values[2]), 9.8 + i / 1024)
            self.assertEqual(float(temperature), 20 + i / 128)
        self.assertEqual([(time, list(map(float, values))) for time, values, _ in self.rows("gyroscope.csv")],
                         [(1767225600000000000 + 10000001 * i, [i / 64, -i / 64, 0.5]) for i in range(0, 500, 4)])
        self.inspect()

    def test_parquet_columns_can_be_named(self):
        self.convert("parquet", TABLE, "--columns=mag_x[uT]=gyro_x[deg/s],mag_y[uT]=gyro_y[deg/s],mag_z[uT]=gyro_z[deg/s]")
        self.assertEqual(len(self.rows("magnetometer.csv")), 125)
        self.tearDown()
        self.setUp()
        self.assertIn("its columns are timestamp", self.convert("parquet", TABLE, "--columns=mag_x[uT]=nothing", code=1).stderr)
        self.assertIn("with a unit", self.convert("parquet", TABLE, "--columns=mag_x=note", code=1).stderr)

    def test_parquet_that_is_cut_has_no_index(self):
        cut = self.folder / "cut.parquet"
        cut.write_bytes(TABLE.read_bytes()[:-20])
        self.assertIn("not a complete Parquet file", self.convert("parquet", cut, code=2).stderr)

    def test_parquet_damaged_row_group_is_left_out(self):
        data = bytearray(TABLE.read_bytes())
        data[4:60] = bytes(56)  # The first pages.
        damaged = self.folder / "damaged.parquet"
        damaged.write_bytes(data)
        done = self.convert("parquet", damaged)
        self.assertEqual(len(self.rows("accelerometer.csv")), 500 - 128)
        self.assertIn("1 row group of 4 with 128 rows cannot be read", done.stderr)

    # ------------------------------------------------------------------------------------- all

    def test_wrong_files_and_usage(self):
        nothing = self.folder / "nothing"
        empty = self.folder / "empty"
        empty.write_bytes(b"")
        text = self.folder / "text"
        text.write_text("time[s],accel_x[g]\n" * 9)
        for kind in ("ulog", "mcap", "parquet"):
            for source in (nothing, empty, text, self.folder):
                self.convert(kind, source, code=2)
            program = PROGRAMS / f"truetriad-convert-{kind}"
            for arguments in ([], [text], [text, "--output="], [text, "--output=x", "--nothing=1"],
                              *([[text, text, "--output=x"]] if kind != "mcap" else []), ["--output=x"]):
                self.assertEqual(run([program, *arguments], cwd=self.folder).returncode, 1, arguments)
            # Flags of other converters.
            self.assertIn("does not apply", run([program, text, "--output=x", "--nothing=1"]).stderr)

    def test_takes_the_place_of_an_earlier_conversion_and_leaves_other_files(self):
        self.out.mkdir()
        (self.out / "mine.txt").write_text("mine")
        (self.out / "recording.yaml").write_text("old")
        self.convert("parquet", TABLE)
        self.assertEqual((self.out / "mine.txt").read_text(), "mine")
        self.assertIn("recording: 1", (self.out / "recording.yaml").read_text())
        file = self.folder / "file"
        file.write_text("")
        self.assertEqual(run([PROGRAMS / "truetriad-convert-parquet", TABLE, f"--output={file}"]).returncode, 2)


if __name__ == "__main__":
    if not (PROGRAMS / "truetriad-convert-ulog").exists():
        print("skipped: the converters are not built: node or npm is missing")
        sys.exit(77)
    sys.exit(unittest.main(verbosity=1))
