#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a log of another system with known raw readings, for tests and measurements.

    make_log.py dataflash|dataflash-raw|dataflash-2014|vectornav|ros1|ros2-db3 FILE MESSAGES [TRUTH.csv]

The unit rests for 2 s in each of many attitudes and is sampled at 100 Hz. `dataflash`: a board
mounted upside down, with readings corrected as by ArduPilot (offsets, scales, a polynomial of
temperature). `dataflash-raw`: also ACC and GYR, and IMU only for every fourth sample.
`dataflash-2014`: what ArduCopter 3.1 logged, with milliseconds, no temperature, and offsets
subtracted last. TRUTH.csv gets the raw readings (not of ros1 and ros2-db3): time_ns, accel_x…z,
gyro_x…z, mag_x…z.
"""

import math
import random
import sqlite3
import struct
import sys

RATE_HZ = 100
START_NS = 1_700_000_000 * 10**9
OFFSETS = {"ACC": (0.11, -0.23, 0.31), "GYR": (0.012, -0.008, 0.004)}
SCALE = (1.013, 0.987, 1.004)
COEFFICIENTS = {"ACC": ((900.0, -700.0, 1200.0), (15.0, 5.0, -8.0), (0.2, -0.1, 0.3)),
                "GYR": ((40.0, 25.0, -30.0), (0.5, -0.25, 0.125), (0.0, 0.0, 0.0))}
RANGE_DEGC = (5.0, 60.0)
CALTEMP = {"ACC": 41.0, "GYR": 39.5}
COMPASS_OFFSET = (-58.5, 57.25, 90.125)
COMPASS_DIAGONAL = (1.02, 0.98, 1.14)
COMPASS_OFF_DIAGONAL = (-0.01, 0.0067, 0.0145)


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def samples(count):
    """Yields index, time_ns and the raw acceleration m/s^2, rate rad/s, field uT, temperature degC."""
    generator = random.Random(20260131)
    for i in range(count):
        if i % (2 * RATE_HZ) == 0:
            direction = [generator.gauss(0, 1) for _ in range(3)]
            size = math.sqrt(sum(d * d for d in direction))
            up = [d / size for d in direction]
            field = [48.0 * math.cos(k + i) for k in range(3)]
        noise = [generator.uniform(-0.01, 0.01) for _ in range(3)]
        yield (i, i * 10**9 // RATE_HZ, [9.80665 * u + n for u, n in zip(up, noise)],
               [0.01 * n for n in noise], [f + n for f, n in zip(field, noise)],
               30.0 + 20.0 * math.sin(i * 1e-3))


def thermal(sensor, temperature):
    tau = min(max(temperature, RANGE_DEGC[0]), RANGE_DEGC[1]) - 35.0
    return [1e-6 * sum(row[axis] * tau**(k + 1) for k, row in enumerate(COEFFICIENTS[sensor]))
            for axis in range(3)]


def dataflash(path, count, truth, raw_rate=False):
    out = open(path, "wb")

    def message(kind, layout, *values):
        out.write(b"\xa3\x95" + struct.pack("<B" + layout, kind, *values))

    formats = {128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "BB4s16s64s"),
               129: ("PARM", "QNff", "TimeUS,Name,Value,Default", "Q16sff"),
               130: ("MSG", "QZ", "TimeUS,Message", "Q64s"),
               131: ("IMU", "QBffffffIIfBBHH",
                     "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
                     "QBffffffIIfBBHH"),
               132: ("MAG", "QBhhhhhhhhhBI",
                     "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S",
                     "QBhhhhhhhhhBI"),
               133: ("ACC", "QBQfff", "TimeUS,I,SampleUS,AccX,AccY,AccZ", "QBQfff"),
               134: ("GYR", "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ", "QBQfff")}
    for kind, (name, letters, columns, layout) in formats.items():
        message(128, "BB4s16s64s", kind, 3 + struct.calcsize("<" + layout), name.encode(),
                letters.encode(), columns.encode())
    message(130, "Q64s", 0, b"ArduCopter V4.6.2 (made up)")
    parameters = {"AHRS_ORIENTATION": 8, "INS_TCAL1_ENABLE": 1, "INS_TCAL1_TMIN": RANGE_DEGC[0],
                  "INS_TCAL1_TMAX": RANGE_DEGC[1], "INS_ACC1_CALTEMP": CALTEMP["ACC"],
                  "INS_GYR1_CALTEMP": CALTEMP["GYR"], "COMPASS_SCALE": 1.05}
    for axis, letter in enumerate("XYZ"):
        parameters["INS_ACCOFFS_" + letter] = OFFSETS["ACC"][axis]
        parameters["INS_GYROFFS_" + letter] = OFFSETS["GYR"][axis]
        parameters["INS_ACCSCAL_" + letter] = SCALE[axis]
        parameters["COMPASS_OFS_" + letter] = COMPASS_OFFSET[axis]
        parameters["COMPASS_DIA_" + letter] = COMPASS_DIAGONAL[axis]
        parameters["COMPASS_ODI_" + letter] = COMPASS_OFF_DIAGONAL[axis]
        for sensor in ("ACC", "GYR"):
            for power in range(3):
                name = f"INS_TCAL1_{sensor}{power + 1}_{letter}"
                parameters[name] = COEFFICIENTS[sensor][power][axis]
    for name, value in parameters.items():
        message(129, "Q16sff", 0, name.encode(), value, 0.0)
    dx, dy, dz = COMPASS_DIAGONAL
    ox, oy, oz = COMPASS_OFF_DIAGONAL
    ellipse = ((dx, ox, oy), (ox, dy, oz), (oy, oz, dz))
    sign = (1, -1, -1)  # Rolled by half a turn.
    for i, time_ns, acceleration, rate, field, temperature in samples(count):
        if i % 4 == 0 or not raw_rate:
            logged_temperature = float32(temperature)
        temperature = logged_temperature
        logged = []
        for sensor, raw, scale in (("GYR", rate, (1, 1, 1)), ("ACC", acceleration, SCALE)):
            at, calibrated = thermal(sensor, temperature), thermal(sensor, CALTEMP[sensor])
            logged += [sign[k] * scale[k] *
                       (raw[k] - at[k] + calibrated[k] - OFFSETS[sensor][k]) for k in range(3)]
        us = time_ns // 1000
        if i % 4 == 0 or not raw_rate:
            message(131, "QBffffffIIfBBHH", us, 0, *logged, 0, 0, temperature, 1, 1, 8000, 4000)
        if raw_rate:
            message(134, "QBQfff", us + 120, 0, us, *logged[:3])
            message(133, "QBQfff", us + 130, 0, us, *logged[3:])
        if i % 10 == 0:
            sum_ = [1.05 * (10.0 * s * f + o) for s, f, o in zip(sign, field, COMPASS_OFFSET)]
            corrected = [round(sum(m * s for m, s in zip(row, sum_))) for row in ellipse]
            message(132, "QBhhhhhhhhhBI", time_ns // 1000, 0, *corrected,
                    *(int(o) for o in COMPASS_OFFSET), 0, 0, 0, 1, 0)
        if truth:
            truth.write(",".join(map(repr, [time_ns, *acceleration, *rate, *field])) + "\n")


def dataflash_2014(path, count, truth):
    out = open(path, "wb")

    def message(kind, layout, *values):
        out.write(b"\xa3\x95" + struct.pack("<B" + layout, kind, *values))

    formats = ((128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "BB4s16s64s"),
               (129, "PARM", "Nf", "Name,Value", "16sf"), (130, "MSG", "Z", "Message", "64s"),
               (131, "IMU", "Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "Iffffff"),
               (132, "MAG", "Ihhhhhhhhh", "TimeMS,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOfsX,MOfsY,MOfsZ",
                "Ihhhhhhhhh"))
    for kind, name, letters, columns, layout in formats:
        message(128, "BB4s16s64s", kind, 3 + struct.calcsize("<" + layout), name.encode(),
                letters.encode(), columns.encode())
    message(130, "64s", b"ArduCopter V3.1.5 (made up)")
    message(129, "16sf", b"AHRS_ORIENTATION", 8)
    for axis, letter in enumerate("XYZ"):
        for name, value in (("INS_ACCOFFS_", OFFSETS["ACC"]), ("INS_GYROFFS_", OFFSETS["GYR"]),
                            ("INS_ACCSCAL_", SCALE), ("COMPASS_OFS_", COMPASS_OFFSET)):
            message(129, "16sf", (name + letter).encode(), value[axis])
    sign = (1, -1, -1)  # Rolled by half a turn.
    for i, time_ns, acceleration, rate, field, _ in samples(count):
        logged = [sign[k] * rate[k] - OFFSETS["GYR"][k] for k in range(3)]
        logged += [sign[k] * acceleration[k] * SCALE[k] - OFFSETS["ACC"][k] for k in range(3)]
        message(131, "Iffffff", time_ns // 10**6, *logged)
        if i % 10 == 0:
            motor = (i % 7, -3, 2)
            message(132, "Ihhhhhhhhh", time_ns // 10**6,
                    *(round(10.0 * s * f + o) + m
                      for s, f, o, m in zip(sign, field, COMPASS_OFFSET, motor)),
                    *(int(o) for o in COMPASS_OFFSET), *motor)
        if truth:
            truth.write(",".join(map(repr, [time_ns, *acceleration, *rate, *field])) + "\n")


def vectornav(path, count, truth):
    with open(path, "w", newline="") as out:
        for i, time_ns, acceleration, rate, field, temperature in samples(count):
            # Ten thousandths of a gauss, thousandths of m/s^2, millionths of rad/s.
            numbers = [f"{0.01 * f:+08.4f}" for f in field] + [f"{a:+08.3f}" for a in acceleration]
            numbers += [f"{w:+010.6f}" for w in rate] + [f"{temperature:+05.1f}", "+101.325"]
            text = "VNIMU," + ",".join(numbers)
            checksum = 0
            for byte in text.encode():
                checksum ^= byte
            out.write(f"${text}*{checksum:02X}\r\n")
            if truth:
                truth.write(",".join(map(repr, [time_ns, *acceleration, *rate, *field])) + "\n")


def imu_body(time_ns, acceleration, rate):
    return struct.pack("<37d", *([0.0] * 4 + [0.1] * 9), *rate, *([0.2] * 9), *acceleration,
                       *([0.3] * 9))


def ros2_db3(path, count, _):
    database = sqlite3.connect(path)
    database.executescript("""
        PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF;
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
                              timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
        INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr', ''),
                                  (2, '/mag', 'sensor_msgs/msg/MagneticField', 'cdr', '');""")

    def rows():
        for i, time_ns, acceleration, rate, field, _ in samples(count):
            stamp = START_NS + time_ns
            head = b"\0\1\0\0" + struct.pack("<iII", stamp // 10**9, stamp % 10**9, 4) + b"imu\0"
            yield 1, stamp + 150_000, head + imu_body(time_ns, acceleration, rate)
            if i % 10 == 0:
                tesla = [1e-6 * f for f in field]
                yield 2, stamp + 160_000, head + struct.pack("<12d", *tesla, *([0.0] * 9))

    database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows())
    database.commit()
    database.close()


def header(**fields):
    parts = b""
    for name, value in fields.items():
        field = name.encode() + b"=" + value
        parts += struct.pack("<I", len(field)) + field
    return struct.pack("<I", len(parts)) + parts


def record(data, **fields):
    return header(**fields) + struct.pack("<I", len(data)) + data


def ros1(path, count, _):
    out = open(path, "wb")
    out.write(b"#ROSBAG V2.0\n")
    out.write(record(b" " * 4027, op=b"\3", index_pos=b"\0" * 8, conn_count=struct.pack("<I", 2),
                     chunk_count=struct.pack("<I", 0)))
    connections = b""
    for number, (topic, kind) in enumerate((("/imu", "Imu"), ("/mag", "MagneticField"))):
        body = header(topic=topic.encode(), type=b"sensor_msgs/" + kind.encode(),
                      md5sum=b"0" * 32, message_definition=b"")[4:]
        connections += record(body, op=b"\7", conn=struct.pack("<I", number),
                              topic=topic.encode())
    chunk = connections

    def flush():
        out.write(record(chunk, op=b"\5", compression=b"none", size=struct.pack("<I", len(chunk))))

    for i, time_ns, acceleration, rate, field, _ in samples(count):
        stamp = START_NS + time_ns
        time = struct.pack("<II", stamp // 10**9, stamp % 10**9)
        head = struct.pack("<I", i) + time + struct.pack("<I", 3) + b"imu"
        chunk += record(head + imu_body(time_ns, acceleration, rate), op=b"\2",
                        conn=struct.pack("<I", 0), time=time)
        if i % 10 == 0:
            tesla = [1e-6 * f for f in field]
            chunk += record(head + struct.pack("<12d", *tesla, *([0.0] * 9)), op=b"\2",
                            conn=struct.pack("<I", 1), time=time)
        if len(chunk) > 700_000:
            flush()
            chunk = b""
    if chunk:
        flush()
    out.write(connections)  # A bag's index repeats the connections.


def main():
    kind, path, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    truth = open(sys.argv[4], "w") if len(sys.argv) > 4 else None
    def dataflash_raw(path, count, truth):
        dataflash(path, count, truth, raw_rate=True)

    {"vectornav": vectornav, "dataflash": dataflash, "dataflash-raw": dataflash_raw, "dataflash-2014": dataflash_2014,
     "ros1": ros1, "ros2-db3": ros2_db3}[kind](path, count, truth)


main()
