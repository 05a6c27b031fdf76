# SPDX-License-Identifier: Apache-2.0
"""Logs of vehicles with several sensors of a kind, of which everything is known.

Three inertial units and two compasses are put down in attitudes and turned between them. The logs are
written from the formats' descriptions: docs.px4.io/main/en/dev_log/ulog_file_format.html, and
ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html.
"""
import math
import random
import struct

GRAVITY = 9.80665
RATE_HZ = 100
FIELD_UT = (2.0, 21.0, -43.0)  # East, north, up.
SERIAL = "000200000000353338373138511600380018"


class Triad:
    """raw = matrix * truth + bias"""

    def __init__(self, number, bias, matrix, sigma):
        self.number, self.bias, self.matrix, self.sigma = number, bias, matrix, sigma

    def raw(self, truth, draw):
        return [sum(m * t for m, t in zip(row, truth)) + b + draw.gauss(0.0, self.sigma)
                for row, b in zip(self.matrix, self.bias)]


def diagonal(*gains):
    return [[gain if i == j else 0.0 for j in range(3)] for i, gain in enumerate(gains)]


ACCELEROMETERS = [Triad(1310988, (0.31, -0.12, 0.22), diagonal(1.013, 0.991, 1.006), 0.02),
                  Triad(2621706, (-0.25, 0.18, 0.09), diagonal(0.994, 1.008, 0.989), 0.02),
                  Triad(3408138, (0.11, 0.27, -0.33), diagonal(1.004, 1.011, 0.997), 0.02)]
GYROSCOPES = [Triad(1310989, (0.021, -0.015, 0.033), diagonal(1.0, 1.0, 1.0), 0.002),
              Triad(2621707, (-0.012, 0.026, 0.018), diagonal(1.0, 1.0, 1.0), 0.002),
              Triad(3408139, (0.017, 0.019, -0.028), diagonal(1.0, 1.0, 1.0), 0.002)]
# In gauss of gauss.
MAGNETOMETERS = [Triad(396825, (0.12, -0.08, 0.15), [[1.05, 0.02, -0.01], [0.02, 0.97, 0.03], [-0.01, 0.03, 1.01]], 5e-4),
                 Triad(658945, (-0.21, 0.05, 0.09), diagonal(0.98, 1.03, 1.0), 5e-4)]


def turned(attitude, axis, angle):
    """attitude (world <- body) after a turn about an axis of the body."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    turn = [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]
    return [[sum(row[k] * turn[k][j] for k in range(3)) for j in range(3)] for row in attitude]


def in_body(attitude, vector):
    return [sum(attitude[i][j] * vector[i] for i in range(3)) for j in range(3)]


def product(matrix, vector):
    return [sum(m * v for m, v in zip(row, vector)) for row in matrix]


def motion(rests=24, rest_s=3.0, turn_s=1.5, rate_hz=RATE_HZ, gap_s=0.0):
    """(time in us, force in m/s^2, rate in rad/s, field in gauss), all in the body; gap_s: behind the first rest."""
    draw = random.Random(20260131)
    attitude = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    step = 0
    for _ in range(rests):
        axis = [draw.gauss(0.0, 1.0) for _ in range(3)]
        length = math.sqrt(sum(a * a for a in axis))
        axis = [a / length for a in axis]
        whole = draw.uniform(0.8, 2.5)
        rest_steps, turn_steps = round(rest_s * rate_hz), round(turn_s * rate_hz)
        for k in range(rest_steps + turn_steps):
            share = max(0.0, (k - rest_steps) / turn_steps)
            now = turned(attitude, axis, whole * (share - math.sin(2 * math.pi * share) / (2 * math.pi)))
            speed = whole / turn_s * (1 - math.cos(2 * math.pi * share))
            yield (2_000_000 + round(step * 1e6 / rate_hz + (step > rest_steps) * gap_s * 1e6), in_body(now, (0.0, 0.0, GRAVITY)),
                   [speed * a for a in axis], [b / 100 for b in in_body(now, FIELD_UT)])
            step += 1
        attitude = turned(attitude, axis, whole)


def ulog(path, parameters=None, earlier=(), mounted=None, broken=None, absent=(), accelerometers=3, gyroscopes=3, nameless=(),
         gains=(1.0, 1.0, 1.0), **how):
    """parameters: {}: the log has none; earlier: those that changed; mounted: the body's axes of the compasses;
    broken: what the topics of some instances say; absent: topics and instances that are not logged; nameless: those
    without a device id; gains: those of the axes of the first two of a kind."""
    def message(kind, body):
        return struct.pack("<Hc", len(body), kind) + body

    def keyed(kind, key, value):
        return message(kind, bytes([len(key)]) + key.encode() + value)

    inertial = ("uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
                "float temperature;uint32_t error_count;uint8_t[3] clip_counter;uint8_t samples;")
    magnetic = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;float temperature;"
    draw = random.Random(1 if gains == (1.0, 1.0, 1.0) else 2)
    with open(path, "wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message(b"B", bytes(40)))
        for name, fields in (("sensor_accel", inertial), ("sensor_gyro", inertial), ("sensor_mag", magnetic)):
            file.write(message(b"F", f"{name}:{fields}".encode()))
        file.write(keyed(b"I", f"char[{len(SERIAL)}] sys_uuid", SERIAL.encode()))
        for name, value in (*earlier, *({} if parameters == {} else {"CAL_ACC0_ID": 0, **(parameters or {})}).items()):
            kind, layout = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
            file.write(keyed(b"P", f"{kind} {name}", struct.pack(layout, value)))
        sensors = []
        for topic, triads, truth in (("sensor_accel", ACCELEROMETERS[:accelerometers], 1), ("sensor_gyro", GYROSCOPES[:gyroscopes], 2),
                                     ("sensor_mag", MAGNETOMETERS, 3)):
            for instance, triad in enumerate(triads):
                if (topic, instance) in absent:
                    continue
                file.write(message(b"A", struct.pack("<BH", instance, len(sensors)) + topic.encode()))
                number = 0 if (topic, instance) in nameless else triad.number
                sensors.append((Triad(number, triad.bias, [[m * gain for m in row] for row, gain in zip(triad.matrix, gains)],
                                      triad.sigma) if instance < 2 else triad, truth, (broken or {}).get((topic, instance))))
        for row in motion(**how):
            if mounted:
                row = (*row[:3], in_body(mounted, row[3]))
            for number, (triad, truth, said) in enumerate(sensors):
                reading = said or triad.raw(row[truth], draw)
                body = struct.pack("<HQQI4f", number, row[0] + 300, row[0], triad.number, *reading, 31.5)
                file.write(message(b"D", body + (bytes(8) if truth < 3 else b"")))


# What the firmware had corrected by before.
APPLIED_OFFSETS, APPLIED_SCALES = (0.05, -0.07, 0.02), (1.002, 0.999, 1.001)


def dataflash(path, parameters=None, board=None, later=None, early=0, on_board=False, **how):
    """board: the vehicle's axes of the inertial sensors, and where it is on_board of the compasses; later: parameters that change at the end; early: rows of the
    first gyroscope's own message before any temperature."""
    more, board = parameters or {}, board or diagonal(1.0, 1.0, 1.0)
    draw = random.Random(1)
    with open(path, "wb") as file:
        def message(kind, layout, *values):
            file.write(b"\xa3\x95" + struct.pack("<B" + layout, kind, *values))

        for kind, name, letters, layout, columns in (
                (128, "FMT", "BBnNZ", "BB4s16s64s", "Type,Length,Name,Format,Columns"),
                (129, "PARM", "QNff", "Q16sff", "TimeUS,Name,Value,Default"),
                (130, "IMU", "QBfffffff", "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"),
                (131, "MAG", "QBhhhhhh", "QBhhhhhh", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ"),
                (132, "GYR", "QBQfff", "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ")):
            message(128, "BB4s16s64s", kind, 3 + struct.calcsize("<" + layout), name.encode(), letters.encode(),
                    columns.encode())
        parameters = {"AHRS_ORIENTATION": 0}
        for i, number in enumerate(("", "2", "3")):
            parameters |= {f"INS_ACC{number}_ID": ACCELEROMETERS[i].number, f"INS_GYR{number}_ID": GYROSCOPES[i].number}
            for axis, letter in enumerate("XYZ"):
                parameters |= {f"INS_ACC{number}OFFS_{letter}": APPLIED_OFFSETS[axis],
                               f"INS_ACC{number}SCAL_{letter}": APPLIED_SCALES[axis], f"INS_GYR{number}OFFS_{letter}": 0.0}
        for i, number in enumerate(("", "2")):
            parameters[f"COMPASS_DEV_ID{number}"] = MAGNETOMETERS[i].number
            for letter in "XYZ":
                parameters |= {f"COMPASS_OFS{number}_{letter}": 0.0, f"COMPASS_DIA{number}_{letter}": 1.0,
                               f"COMPASS_ODI{number}_{letter}": 0.0}
        parameters |= more
        # Along x, by the number of a compass, wherever it stands.
        offsets = {parameters[f"COMPASS_DEV_ID{n}"]: parameters[f"COMPASS_OFS{n}_X"] for n in ("", "2")}
        for name, value in parameters.items():
            message(129, "Q16sff", 0, name.encode(), value, 0.0)
        for k in range(early):
            message(132, "QBQfff", 1_900_000 + k, 0, 1_900_000 + k, 0.0, 0.0, 0.0)
        for k, (us, force, rate, field) in enumerate(motion(**how)):
            if early:
                message(132, "QBQfff", us, 0, us, *product(board, GYROSCOPES[0].raw(in_body(board, rate), draw)))
            for i in range(3):
                raw = ACCELEROMETERS[i].raw(in_body(board, force), draw)
                if f"INS_TCAL{i + 1}_ACC1_X" in more:  # P(40 degC) - P(CALTEMP)
                    raw[0] -= 1e-6 * more[f"INS_TCAL{i + 1}_ACC1_X"] * (40.0 - more[f"INS_ACC{i + 1}_CALTEMP"])
                corrected = [(y - o) * s for y, o, s in zip(raw, APPLIED_OFFSETS, APPLIED_SCALES)]
                turned = product(board, GYROSCOPES[i].raw(in_body(board, rate), draw))
                message(130, "QBfffffff", us, i, *turned, *product(board, corrected), 40.0)
            if k % 10 == 0:  # A filtered copy of the first gyroscope, as INS_RAW_LOG_OPT adds them.
                message(132, "QBQfff", us, 3, us, *GYROSCOPES[0].raw(rate, draw))
            for i in range(2 if k % 5 == 0 else 0):
                turn = board if on_board else diagonal(1.0, 1.0, 1.0)
                reading = [round(1e3 * y) for y in product(turn, MAGNETOMETERS[i].raw(in_body(turn, field), draw))]
                added = int(offsets.get(MAGNETOMETERS[i].number, 0))
                message(131, "QBhhhhhh", us, i, reading[0] + added, *reading[1:], added, 0, 0)
        for name, value in (later or {}).items():
            message(129, "Q16sff", us, name.encode(), value, 0.0)
