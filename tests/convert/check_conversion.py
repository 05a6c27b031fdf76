#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares a converted recording with the log it was made from.

    check_conversion.py FORMAT LOG DIRECTORY [INSTANCE]

Reads LOG with a reader of its own (struct, sqlite3, bz2; nothing of truetriad), and the CSV files of
DIRECTORY, and wants every time and every reading to be the same bits. FORMAT: dataflash, ros1,
ros2-db3. Prints `STREAM COUNT FIRST_NS LAST_NS CRC32` for each triad; exit code 1 if they differ.
"""

import bz2
import csv
import math
import sqlite3
import struct
import sys
import zlib

SIZES = dict(zip("bBhHiIqQfdnNZcCeELMa",
                 ["b", "B", "h", "H", "i", "I", "q", "Q", "f", "d", "4s", "16s", "64s", "h", "H",
                  "i", "I", "i", "B", "64s"]))


def text(raw):
    return raw.split(b"\0")[0].decode("ascii", "replace")


def dataflash(path, instance):
    data = open(path, "rb").read()
    kinds = {128: ("FMT", "<BB4s16s64s", 89, ["Type", "Length", "Name", "Format", "Columns"])}
    streams = {"accelerometer": [], "gyroscope": [], "magnetometer": []}
    at = 0
    while at + 3 <= len(data):
        kind = kinds.get(data[at + 2]) if data[at:at + 2] == b"\xa3\x95" else None
        if kind is None or at + kind[2] > len(data):
            break  # The files checked here are whole but for their last message.
        name, layout, length, columns = kind
        row = dict(zip(columns, struct.unpack(layout, data[at + 3:at + length])))
        at += length
        if name == "FMT":
            letters = text(row["Format"])
            kinds[row["Type"]] = (text(row["Name"]), "<" + "".join(SIZES[c] for c in letters),
                                  row["Length"], text(row["Columns"]).split(","))
        wanted = str(instance + 1) if instance else ""
        if name.rstrip("123456789") not in ("IMU", "MAG"):
            continue
        if row.get("I", instance) != instance or (name[3:] != wanted and "I" not in row):
            continue
        time = 1000 * row["TimeUS"] if "TimeUS" in row else 10**6 * row["TimeMS"]
        if name.startswith("IMU"):
            streams["gyroscope"].append((time, row["GyrX"], row["GyrY"], row["GyrZ"]))
            streams["accelerometer"].append((time, row["AccX"], row["AccY"], row["AccZ"]))
        else:
            motor = [row.get("MO" + a, row.get("MOfs" + a)) for a in "XYZ"]
            streams["magnetometer"].append(
                (time, *(float(row["Mag" + a]) - m for a, m in zip("XYZ", motor))))
    return streams


def imu_streams(messages):
    """messages: (kind, stamp_ns, six or three numbers)"""
    streams = {"accelerometer": [], "gyroscope": [], "magnetometer": []}
    for kind, stamp, values in messages:
        if kind == "Imu":
            streams["gyroscope"].append((stamp, *values[:3]))
            streams["accelerometer"].append((stamp, *values[3:]))
        else:
            streams["magnetometer"].append((stamp, *(v * 1e6 for v in values)))
    return {name: [row for row in rows if all(map(math.isfinite, row[1:]))]
            for name, rows in streams.items()}


def ros2_db3(path, _):
    database = sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
    messages = []
    query = ("SELECT type, data FROM messages JOIN topics ON topic_id = topics.id "
             "WHERE type IN ('sensor_msgs/msg/Imu', 'sensor_msgs/msg/MagneticField') "
             "ORDER BY messages.id")
    for kind, data in database.execute(query):
        assert data[:4] == b"\0\1\0\0"
        body = data[4:]
        seconds, nanoseconds, length = struct.unpack_from("<iII", body)
        at = (12 + length + 7) // 8 * 8
        numbers = struct.unpack_from("<37d" if kind.endswith("Imu") else "<3d", body, at)
        stamp = seconds * 10**9 + nanoseconds
        messages.append(("Imu", stamp, numbers[13:16] + numbers[25:28])
                        if kind.endswith("Imu") else ("MagneticField", stamp, numbers))
    return imu_streams(messages)


def fields(header):
    found, at = {}, 0
    while at < len(header):
        size, = struct.unpack_from("<I", header, at)
        key, value = header[at + 4:at + 4 + size].split(b"=", 1)
        found[key.decode()] = value
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


def ros1(path, _):
    data = open(path, "rb").read()
    magic = b"#ROSBAG V2.0\n"
    assert data.startswith(magic)
    types, messages = {}, []
    for header, chunk in records(data, len(magic)):
        if header["op"] != b"\5":
            continue
        plain = {b"bz2": bz2.decompress, b"none": bytes}[header["compression"]](chunk)
        for inner, body in records(plain):
            connection = struct.unpack("<I", inner["conn"])[0]
            if inner["op"] == b"\7":
                types[connection] = fields(body)["type"].decode()
            kind = types[connection]
            if inner["op"] != b"\2" or kind not in ("sensor_msgs/Imu", "sensor_msgs/MagneticField"):
                continue
            _, seconds, nanoseconds, length = struct.unpack_from("<4I", body)
            numbers = struct.unpack_from("<37d" if kind.endswith("Imu") else "<3d", body, 16 + length)
            stamp = seconds * 10**9 + nanoseconds
            messages.append(("Imu", stamp, numbers[13:16] + numbers[25:28])
                            if kind.endswith("Imu") else ("MagneticField", stamp, numbers))
    return imu_streams(messages)


def converted(directory):
    streams = {"accelerometer": [], "gyroscope": [], "magnetometer": []}
    prefixes = {"accelerometer": "accel", "gyroscope": "gyro", "magnetometer": "mag"}
    for name in ("imu", "accelerometer", "gyroscope", "magnetometer"):
        try:
            rows = csv.DictReader(open(f"{directory}/{name}.csv"))
        except FileNotFoundError:
            continue
        for row in rows:
            for triad, prefix in prefixes.items():
                axes = [row.get(f"{prefix}_{a}") for a in "xyz"]
                if all(axes):
                    streams[triad].append((int(row["time_ns"]), *map(float, axes)))
    return streams


def main():
    kind, log, directory = sys.argv[1:4]
    instance = int(sys.argv[4]) if len(sys.argv) > 4 else 0
    read = {"dataflash": dataflash, "ros1": ros1, "ros2-db3": ros2_db3}[kind]
    original = {name: sorted(rows, key=lambda row: row[0])
                for name, rows in read(log, instance).items()}
    result = converted(directory)
    different = False
    for name, rows in result.items():
        bits = b"".join(struct.pack("<qddd", *row) for row in rows)
        wanted = b"".join(struct.pack("<qddd", *row) for row in original[name])
        if rows:
            print(name, len(rows), rows[0][0], rows[-1][0], zlib.crc32(bits))
        if bits != wanted:
            print(f"{name}: {len(rows)} rows, but the log has {len(original[name])}, or others")
            different = True
    return 1 if different else 0


sys.exit(main())
