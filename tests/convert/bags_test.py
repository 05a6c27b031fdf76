#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Bags of messages that are not of sensor_msgs, and bags in several files, written by bags.py.

Environment: PROGRAMS, the folder of the converters; those that were not built are left out.
"""
import csv
import os
import shutil
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

import bags
from bags import CUSTOM, CUSTOM_TEXT, START_NS, custom_values

PROGRAMS = Path(os.environ["PROGRAMS"])
FORMATS = {"ros1": (bags.ros1, ".bag"), "ros2-db3": (bags.db3, ".db3"), "mcap": (bags.mcap, ".mcap")}
AVAILABLE = [kind for kind in FORMATS if (PROGRAMS / f"truetriad-convert-{kind}").exists()]

STAMPED = [("Header", "header"), ("float64", "x"), ("float64", "y"), ("float64", "z")]
ARRAY = [([("float64[]", "dim"), ("uint32", "offset")], "layout"), ("float64[]", "data")]


def float32(value):
    return struct.unpack("f", struct.pack("f", value))[0]


class Bags(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def convert(self, kind, *words, code=0):
        shutil.rmtree(self.out, ignore_errors=True)
        done = subprocess.run([PROGRAMS / f"truetriad-convert-{kind}", f"--output={self.out}", *map(str, words)],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(self.out.exists(), code == 0)
        return done

    def rows(self, name):
        with open(self.out / f"{name}.csv", encoding="ascii") as file:
            table = list(csv.reader(file))[1:]
        return [(int(row[0]), [float(value) for value in row[1:4]], row[4] if len(row) > 4 else "") for row in table]

    def write(self, kind, name, topics, messages, order="<"):
        write, ending = FORMATS[kind]
        is_cdr = kind != "ros1"
        path = self.folder / (name + ending)
        path.parent.mkdir(exist_ok=True)
        named = {topic: (kind_of if not is_cdr else kind_of.replace("/", "/msg/"),
                         text.format("msg/" if is_cdr else ""))
                 for topic, (kind_of, text, _) in topics.items()}
        write(path, named, [(topic, ns, bags.message(topics[topic][2], values, is_cdr, order))
                            for topic, ns, values in messages])
        return path

    def test_messages_of_a_type_of_ones_own(self):
        topics = {"/driver": ("mine/Reading", CUSTOM_TEXT, CUSTOM)}
        messages = [("/driver", START_NS + 2_500_000 * i, custom_values(i)) for i in range(50)]
        for kind in AVAILABLE:
            for order in "<" if kind == "ros1" else "<>":
                with self.subTest(kind=kind, order=order):
                    path = self.write(kind, f"log{order == '<'}", topics, messages, order)
                    done = self.convert(
                        kind, path, "--units=us,counts,rad/s,degC", "--columns=accelerometer=/driver:low.acc@t_us,"
                        "gyroscope=/driver:gx+gy+gz@t_us,temperature=/driver:low.temp")
                    self.assertEqual([(ns, values, float(warmth)) for ns, values, warmth in self.rows("accelerometer")],
                                     [(10**12 + 2_500_000 * i, [i, -i, 4096], 20 + i / 8) for i in range(50)])
                    self.assertEqual([(ns, [float32(v) for v in values]) for ns, values, _ in self.rows("gyroscope")],
                                     [(10**12 + 2_500_000 * i, [float32(0.1 * i), float32(-0.2 * i), float32(0.3)])
                                      for i in range(50)])
                    manifest = (self.out / "recording.yaml").read_text()
                    self.assertIn("unit: counts", manifest)
                    self.assertNotIn("skipped", done.stderr)
                    # Without a time of its own: when the bag received it. An array that is too short is left out.
                    done = self.convert(kind, path, "--units=uT", "--columns=magnetometer=/driver:all:2-4")
                    self.assertEqual([(ns, values) for ns, values, _ in self.rows("magnetometer")],
                                     [(START_NS + 2_500_000 * i, ([0.5] * (i % 4) + [i, 2, 3])[1:4])
                                      for i in range(50) if i % 4])
                    self.assertIn("time stamp", done.stderr)

    def test_vectors_and_arrays_of_their_own_topics(self):
        vector = ("std_msgs/Header header\ngeometry_msgs/Vector3 vector\n" + "=" * 80 + "\nMSG: geometry_msgs/Vector3\n"
                  "float64 x\nfloat64 y\nfloat64 z\n" + "=" * 80 + "\nMSG: std_msgs/Header\n")
        array = ("std_msgs/MultiArrayLayout layout\nfloat64[] data\n" + "=" * 80 + "\nMSG: std_msgs/MultiArrayLayout\n"
                 "float64[] dim\nuint32 data_offset\n")
        for kind in AVAILABLE:
            header = "uint32 seq\ntime stamp\nstring frame_id\n" if kind == "ros1" else \
                "builtin_interfaces/Time stamp\nstring frame_id\n"
            topics = {"/acc": ("geometry_msgs/Vector3Stamped", vector + header, STAMPED),
                      "/gyr": ("std_msgs/Float64MultiArray", array, ARRAY)}
            messages = []
            for i in range(40):
                messages.append(("/acc", START_NS + i, [(START_NS + 10**7 * i, "frame"), i, -i, 9.5]))
                messages.append(("/gyr", START_NS + 10**7 * i + 5, [[[], 0], [i, 2 * i, 0.25]]))
            with self.subTest(kind=kind):
                path = self.write(kind, "log", topics, messages)
                flags = "--columns=accelerometer=/acc,gyroscope=/gyr:data", "--units=m/s^2,rad/s"
                self.convert(kind, path, *flags)
                self.assertEqual([row[:2] for row in self.rows("accelerometer")],
                                 [(START_NS + 10**7 * i, [i, -i, 9.5]) for i in range(40)])
                self.assertEqual([row[:2] for row in self.rows("gyroscope")],
                                 [(START_NS + 10**7 * i + 5, [i, 2 * i, 0.25]) for i in range(40)])

    def test_bytes_behind_the_last_field(self):
        # Writers of CDR fill up the last word; anything else means that the fields are others.
        for kind in AVAILABLE:
            for fill, kept in ((3, 4 if kind == "ros1" else 8), (8, 4)):
                with self.subTest(kind=kind, fill=fill):
                    is_cdr = kind != "ros1"
                    text = CUSTOM_TEXT.format("msg/" if is_cdr else "")
                    path = self.folder / f"{kind}{fill}"
                    FORMATS[kind][0](path, {"/driver": ("mine/msg/Reading" if is_cdr else "mine/Reading", text)}, [
                        ("/driver", START_NS + i, bags.message(CUSTOM, custom_values(i), is_cdr) + bytes(fill * (i % 2)))
                        for i in range(8)])
                    done = self.convert(kind, path, "--columns=accelerometer=/driver:low.acc", "--units=g")
                    self.assertEqual(len(self.rows("accelerometer")), kept)
                    self.assertEqual("4 messages skipped (too short, too long" in done.stderr, kept == 4)

    def test_a_bag_without_topics_is_bad_input(self):
        for kind in AVAILABLE:
            with self.subTest(kind=kind):
                path = self.write(kind, "empty", {}, [])
                done = self.convert(kind, path, "--columns=accelerometer=/driver:low.acc", "--units=g", code=2)
                self.assertIn("no topic that can be read", done.stderr)
                self.assertIn("no topic that can be read", self.convert(kind, path, "--topic=/imu", code=2).stderr)

    def test_an_array_of_six_is_not_three(self):
        array = ("std_msgs/MultiArrayLayout layout\nfloat64[] data\n" + "=" * 80 + "\nMSG: std_msgs/MultiArrayLayout\n"
                 "float64[] dim\nuint32 data_offset\n")
        topics = {"/imu": ("std_msgs/Float64MultiArray", array, ARRAY)}
        for kind in AVAILABLE:
            with self.subTest(kind=kind):
                path = self.write(kind, "six", topics, [("/imu", START_NS + i, [[[], 0], [i, 1, 2, 3, 4, -i]])
                                                        for i in range(40)])
                for fields in ("", ":data"):
                    done = self.convert(kind, path, f"--columns=accelerometer=/imu{fields}", "--units=g", code=2)
                    self.assertIn("data:4-6", done.stderr)
                self.convert(kind, path, "--columns=accelerometer=/imu:data:1-3,gyroscope=/imu:data:4-6",
                             "--units=g,deg/s")
                self.assertEqual([row[1] for row in self.rows("accelerometer")], [[i, 1, 2] for i in range(40)])
                self.assertEqual([row[1] for row in self.rows("gyroscope")], [[3, 4, -i] for i in range(40)])
                # One message of another length, as of a sensor that restarts.
                path = self.write(kind, "mixed", topics, [("/imu", START_NS + i, [[[], 0], [i, 1, 2][:3 - i // 39]])
                                                          for i in range(40)])
                done = self.convert(kind, path, "--columns=accelerometer=/imu:data", "--units=g")
                self.assertEqual(len(self.rows("accelerometer")), 39)
                self.assertIn("1 message", done.stderr)

    def test_a_definition_that_the_bag_has_not(self):
        if "ros2-db3" not in AVAILABLE:
            self.skipTest("not built")
        topics = {"/driver": ("mine/Reading", "", CUSTOM)}
        path = self.write("ros2-db3", "log", topics, [("/driver", START_NS + i, custom_values(i)) for i in range(9)])
        flags = "--columns=accelerometer=/driver:low.acc@t_us", "--units=us,mg"
        done = self.convert("ros2-db3", path, *flags, code=1)
        self.assertIn("--layout=FILE.msg, below a line `MSG: mine/msg/Reading`", done.stderr)
        layout = self.folder / "Reading.msg"
        for text in (CUSTOM_TEXT.format(""), "MSG: mine/Reading\n" + CUSTOM_TEXT.format("msg/")):
            layout.write_text(text)
            self.convert("ros2-db3", path, *flags, f"--layout={layout}")
            self.assertEqual([row[:2] for row in self.rows("accelerometer")],
                             [(10**12 + 2_500_000 * i, [i, -i, 4096]) for i in range(9)])
        layout.write_text("uint8 unit\nuint64\n")
        done = self.convert("ros2-db3", path, *flags, f"--layout={layout}", code=2)
        self.assertIn("line 2: `uint64` is not a field", done.stderr)
        layout.write_text("mine/Reading again\n")
        self.assertIn("contains itself", self.convert("ros2-db3", path, *flags, f"--layout={layout}", code=2).stderr)
        layout.write_text("other/Type again\n")
        self.assertIn("the fields of other/Type are not known", self.convert(
            "ros2-db3", path, *flags, f"--layout={layout}", code=1).stderr)
        # A layout that is not that of the messages: none is whole, so nothing is written.
        layout.write_text("uint8 unit\nstring t_us\nmine/Sample low\nMSG: mine/Sample\nint16[3] acc\n")
        self.convert("ros2-db3", path, "--columns=accelerometer=/driver:low.acc", "--units=mg", f"--layout={layout}",
                     code=2)

    def test_what_is_not_there_is_named(self):
        topics = {"/driver": ("mine/Reading", CUSTOM_TEXT, CUSTOM)}
        for kind in AVAILABLE:
            with self.subTest(kind=kind):
                path = self.write(kind, "log", topics, [("/driver", START_NS + i, custom_values(i)) for i in range(9)])
                for columns, units, words in (
                        ("accelerometer=/nothing:acc", "g", ("no topic /nothing", "/driver (mine/")),
                        ("accelerometer=/driver:acc", "g", ("`acc` is not three numbers", "low.acc[")),
                        ("accelerometer=/driver:note", "g", ("`note` is not three numbers",)),
                        ("accelerometer=/driver:gx+gy+nothing", "g", ("nothing",)),
                        ("accelerometer=/driver:low.acc@nothing", "g,us", ("`nothing` is not",)),
                        ("accelerometer=/driver:low.acc@t_us", "g", ("the unit of the time is missing",)),
                        ("accelerometer=/driver:low.acc", "uT", ("the unit of the accelerometer is missing",)),
                        ("accelerometer=/driver:low.acc", "furlong", ("`furlong` is not a known unit",)),
                        ("speed=/driver:gx", "g", ("`speed=/driver:gx` is not one of",)),
                        ("accelerometer=/driver:low.acc,accelerometer=/driver:low.acc", "g", ("given twice",))):
                    done = self.convert(kind, path, f"--columns={columns}", f"--units={units}", code=1)
                    for word in words:
                        self.assertIn(word, done.stderr, columns)
                self.assertIn("needs --columns", self.convert(kind, path, "--units=g", code=1).stderr)

    def test_bags_in_several_files_are_one_recording(self):
        layout = [("Header", "header"), *[("float64", "")] * 3, ("float64[9]", "")]
        text = ("std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance\n" +
                "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" + "=" * 80 +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n")
        topics = {"/mag": ("sensor_msgs/MagneticField", text, layout)}

        def part(kind, name, numbers):
            return self.write(kind, name, topics, [
                ("/mag", START_NS + 10**7 * i, [(START_NS + 10**7 * i, "f"), 1e-6 * i, 2e-6, 3e-6, [0] * 9])
                for i in numbers])

        for kind in AVAILABLE:
            with self.subTest(kind=kind):
                paths = [part(kind, f"{kind}/log_{k}", range(300 * k, 300 * k + 300)) for k in range(12)]
                (paths[0].parent / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
                expected = [START_NS + 10**7 * i for i in range(3600)]
                for words in ([paths[0].parent], reversed(paths), [",".join(map(str, paths))]):
                    done = self.convert(kind, *words)
                    self.assertEqual([row[0] for row in self.rows("magnetometer")], expected)
                    self.assertNotIn("order", done.stderr)
                    self.assertIn("bags: \"12\"", (self.out / "recording.yaml").read_text())
                # A damaged part is that part's.
                whole = paths[5].read_bytes()
                paths[5].write_bytes(whole[:3])
                self.convert(kind, paths[0].parent, code=2)
                paths[5].write_bytes(whole)
                empty = self.folder / "empty"
                empty.mkdir(exist_ok=True)
                self.assertIn("without any file that ends with", self.convert(kind, empty, code=2).stderr)


if __name__ == "__main__":
    unittest.main()
