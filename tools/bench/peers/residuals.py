#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the residuals of a recording after a calibration, by one measure for all calibrators.

    residuals.py pair FOLDER CALIBRATION     the Xsens pair: rests and turns
    residuals.py joint TABLE CALIBRATION     accelerometer and magnetometer, one row per pose
    residuals.py field TABLE CALIBRATION     magnetometer alone, one row per reading
    residuals.py poses TABLE CALIBRATION     accelerometer alone, 100 rows per pose

A CALIBRATION is truetriad's calibration.json, a file with the same `sensors: NAME: {bias,
correction}` that a driver beside this script wrote, or imu_tk's two files as ACC,GYRO.

pair: RMS over rests of |C (mean − b)| − g in mm/s²; and RMS over turns of the angle, in degrees,
between gravity as the gyroscope predicts it after the turn and gravity as the accelerometer reads
it. The rests are those of the recording's reference.json; none of the compared programs found them.
joint: RMS of |v| / mean |v| − 1 for each sensor in per cent, and the standard deviation of the
angle between the two vectors in degrees. field, poses: that RMS alone.
"""
import csv
import json
import math
import os
import sys


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def times(matrix, vector):
    return [dot(row, vector) for row in matrix]


def norm(a):
    return math.sqrt(dot(a, a))


def mean(rows):
    return [sum(column) / len(rows) for column in zip(*rows)]


def angle_deg(a, b):
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return math.degrees(math.atan2(norm(cross), dot(a, b)))


def rms(values):
    return math.sqrt(sum(x * x for x in values) / len(values))


def imu_tk_triad(path):
    """Bias and correction T K from an imu_tk file with misalignment T, scale K, bias B: X' = T K (X − B)."""
    with open(path, encoding="utf-8") as file:
        numbers = [float(word) for word in file.read().split()]
    rows = [[numbers[3 * i + j] * numbers[9 + 4 * j] for j in range(3)] for i in range(3)]
    return {"bias": numbers[18:21], "correction": rows}


def sensors_of(path):
    if path.endswith(".json"):
        with open(path, encoding="utf-8") as file:
            return json.load(file)["sensors"]
    accelerometer, gyroscope = path.split(",")
    return {"accelerometer": imu_tk_triad(accelerometer), "gyroscope": imu_tk_triad(gyroscope)}


def corrected(sensor, reading, force=None):
    """truth = C (raw − b − G force). force [m/s²] is used only for a gyroscope with g-sensitivity G."""
    drift = times(sensor["g_sensitivity"], force) if force and "g_sensitivity" in sensor else (0, 0, 0)
    return times(
        sensor["correction"], [y - b - d for y, b, d in zip(reading, sensor["bias"], drift)]
    )


def turned_back(vector, rate, dt):
    """A fixed direction in the body frame, after the body has turned by rate · dt (Rodrigues)."""
    angle = norm(rate) * dt
    if angle == 0:
        return vector
    k = [-x / norm(rate) for x in rate]
    c, s, d = math.cos(angle), math.sin(angle), dot(k, vector)
    cross = [
        k[1] * vector[2] - k[2] * vector[1],
        k[2] * vector[0] - k[0] * vector[2],
        k[0] * vector[1] - k[1] * vector[0],
    ]
    return [v * c + x * s + n * d * (1 - c) for v, x, n in zip(vector, cross, k)]


def pair(folder, sensors):
    with open(os.path.join(folder, "reference.json"), encoding="utf-8") as file:
        reference = json.load(file)
    read = {}
    for name, file in (("accelerometer", "xsens_acc.mat"), ("gyroscope", "xsens_gyro.mat")):
        with open(os.path.join(folder, file), encoding="utf-8") as rows:
            read[name] = [[float(word) for word in row.split()] for row in rows]
    gravity = reference["target_norm"]
    rests = reference["static_intervals_first_last_sample"]
    force = [row[1:] for row in read["accelerometer"]]
    force = [corrected(sensors["accelerometer"], row) for row in force]
    seen = [mean(force[first : last + 1]) for first, last in rests]
    turns = []
    for (_, start), (end, _), before, after in zip(rests, rests[1:], seen, seen[1:]):
        direction = before
        rows = read["gyroscope"][start : end + 1]
        rates = [
            corrected(sensors["gyroscope"], row[1:], f)
            for row, f in zip(rows, force[start : end + 1])
        ]
        for k in range(len(rows) - 1):
            middle = [(a + b) / 2 for a, b in zip(rates[k], rates[k + 1])]
            direction = turned_back(direction, middle, rows[k + 1][0] - rows[k][0])
        turns.append(angle_deg(direction, after))
    norms = [1e3 * (norm(row) - gravity) for row in seen]
    return f"{rms(norms):.2f}; {rms(turns):.3f}"


def uneven_percent(vectors):
    lengths = [norm(vector) for vector in vectors]
    usual = sum(lengths) / len(lengths)
    return 100 * rms([length / usual - 1 for length in lengths])


def joint(table, sensors):
    with open(table, encoding="utf-8") as file:
        rows = [[float(word) for word in row] for row in list(csv.reader(file))[1:]]
    gravity = [corrected(sensors["accelerometer"], row[:3]) for row in rows]
    field = [corrected(sensors["magnetometer"], row[3:6]) for row in rows]
    angles = [angle_deg(g, m) for g, m in zip(gravity, field)]
    usual = sum(angles) / len(angles)
    return (
        f"{uneven_percent(gravity):.3f}; {uneven_percent(field):.3f}; "
        f"{rms([angle - usual for angle in angles]):.3f}"
    )


def field_alone(table, sensors):
    with open(table, encoding="utf-8") as file:
        rows = [[float(word) for word in row.split()] for row in file]
    return f"{uneven_percent([corrected(sensors['magnetometer'], row) for row in rows]):.3f}"


def poses(table, sensors):
    with open(table, encoding="utf-8") as file:
        rows = [[float(word) for word in row] for row in list(csv.reader(file))[1:]]
    means = [mean(rows[k : k + 100]) for k in range(0, len(rows), 100)]
    return f"{uneven_percent([corrected(sensors['accelerometer'], row) for row in means]):.4f}"


def main():
    measures = {"pair": pair, "joint": joint, "field": field_alone, "poses": poses}
    if len(sys.argv) != 4 or sys.argv[1] not in measures:
        sys.exit(__doc__)
    print(measures[sys.argv[1]](sys.argv[2], sensors_of(sys.argv[3])))


if __name__ == "__main__":
    main()
