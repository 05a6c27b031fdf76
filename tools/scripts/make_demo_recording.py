#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes datasets/demo: a simulated nine-axis unit set down by hand in 24 attitudes.

    tools/scripts/make_demo_recording.py datasets/demo

recording.csv is what a logger would have written, attitudes.csv what a turntable would have said
of the same poses, truth.yaml what the unit really is. Same seed, same bytes.
"""
import math
import os
import random
import sys

RATE_HZ = 40.0
REST_S = 4.0
MOVE_S = 1.2
GRAVITY = 9.80665
FIELD_UT, DIP_DEG = 48.0, 62.0
ACCEL = {
    "bias": (0.31, -0.12, 0.22),
    "sensitivity": ((1.013, 0.0, 0.0), (0.006, 0.991, 0.0), (-0.009, 0.004, 1.006)),
    "noise": 0.02,
}
MAG = {
    "bias": (12.4, -31.0, 7.7),
    "sensitivity": ((1.06, 0.021, -0.013), (-0.008, 0.95, 0.034), (0.027, -0.019, 1.02)),
    "noise": 0.25,
}
GYRO = {
    "bias": (0.011, -0.006, 0.004),
    "sensitivity": ((1.01, 0.004, -0.006), (0.002, 0.99, 0.005), (-0.003, 0.007, 1.004)),
    "noise": 0.002,
}
SEAT_DEG = 0.02  # a hand-held unit never rests quite still: pose-to-pose excess


def multiply(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw)


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def rotate(q, v):
    return multiply(multiply(q, (0.0, *v)), conjugate(q))[1:]


def exponential(v):
    angle = math.sqrt(sum(x * x for x in v))
    if angle < 1e-12:
        return (1.0, 0.5 * v[0], 0.5 * v[1], 0.5 * v[2])
    s = math.sin(angle / 2) / angle
    return (math.cos(angle / 2), s * v[0], s * v[1], s * v[2])


def logarithm(q):
    w, *v = q if q[0] >= 0 else tuple(-x for x in q)
    norm = math.sqrt(sum(x * x for x in v))
    factor = 2.0 if norm < 1e-12 else 2.0 * math.atan2(norm, w) / norm
    return tuple(factor * x for x in v)


def attitudes(generator, count):
    """Spread over the rotations: each the best of many random ones against those before it."""
    chosen = [(1.0, 0.0, 0.0, 0.0)]
    while len(chosen) < count:
        best, best_distance = None, -1.0
        for _ in range(60):
            q = [generator.gauss(0, 1) for _ in range(4)]
            norm = math.sqrt(sum(x * x for x in q))
            q = tuple(x / norm for x in q)
            distance = min(1.0 - abs(sum(a * b for a, b in zip(q, other))) for other in chosen)
            if distance > best_distance:
                best, best_distance = q, distance
        chosen.append(best)
    return chosen


def read(sensor, truth, generator):
    return [sum(s * x for s, x in zip(row, truth)) + bias + generator.gauss(0, sensor["noise"])
            for row, bias in zip(sensor["sensitivity"], sensor["bias"])]


def matrix_text(matrix):
    return "[" + ", ".join("[" + ", ".join(repr(float(x)) for x in row) + "]" for row in matrix) + "]"


def main(folder):
    generator = random.Random(20260131)
    poses = attitudes(generator, 24)
    dip = math.radians(DIP_DEG)
    field = (FIELD_UT * math.cos(dip), 0.0, -FIELD_UT * math.sin(dip))
    rows, time, temperature = [], 0.0, 24.0
    with open(os.path.join(folder, "attitudes.csv"), "w", encoding="ascii") as table:
        table.write("# world <- body of every rest of recording.csv, as a turntable would state it\n")
        table.write("qw,qx,qy,qz\n")
        for q in poses:
            table.write(",".join(f"{x:.9f}" for x in q) + "\n")
    for k, pose in enumerate(poses):
        seat = tuple(math.radians(SEAT_DEG) * generator.gauss(0, 1) for _ in range(3))
        rest = multiply(pose, exponential(seat))
        samples = round(REST_S * RATE_HZ * generator.uniform(0.85, 1.15))
        moves = round(MOVE_S * RATE_HZ)
        target = poses[k + 1] if k + 1 < len(poses) else None
        turn = logarithm(multiply(conjugate(rest), target)) if target else None
        for i in range(samples + (moves if target else 0)):
            if i < samples:
                q, rate = rest, (0.0, 0.0, 0.0)
            else:
                u = (i - samples + 1) / moves
                share = u * u * u * (10 + u * (-15 + 6 * u))  # minimum jerk
                speed = 30 * u * u * (1 - u) * (1 - u) / MOVE_S
                q = multiply(rest, exponential(tuple(share * x for x in turn)))
                rate = tuple(speed * x for x in turn)
            force = list(rotate(conjugate(q), (0.0, 0.0, GRAVITY)))
            if i >= samples:  # the hand accelerates the unit
                force = [f + generator.gauss(0, 0.8) for f in force]
            temperature += (26.0 - temperature) * 2e-4
            rows.append([time, *read(ACCEL, force, generator), *read(GYRO, rate, generator),
                         *read(MAG, rotate(conjugate(q), field), generator), temperature])
            time += 1.0 / RATE_HZ
    with open(os.path.join(folder, "recording.csv"), "w", encoding="ascii") as log:
        log.write("# simulated nine-axis unit, 24 rests; tools/scripts/make_demo_recording.py\n")
        log.write("time[s]," + ",".join(f"accel_{a}[m/s^2]" for a in "xyz") + "," +
                  ",".join(f"gyro_{a}[rad/s]" for a in "xyz") + "," +
                  ",".join(f"mag_{a}[uT]" for a in "xyz") + ",temperature[degC]\n")
        for row in rows:
            log.write(f"{row[0]:.3f}," + ",".join(f"{x:.4f}" for x in row[1:4]) + "," +
                      ",".join(f"{x:.5f}" for x in row[4:7]) + "," +
                      ",".join(f"{x:.3f}" for x in row[7:10]) + f",{row[10]:.1f}\n")
    with open(os.path.join(folder, "truth.yaml"), "w", encoding="ascii") as truth:
        truth.write("# What the simulated unit really is: raw = sensitivity * truth + bias.\n")
        truth.write("# Body frame accel-x; written by tools/scripts/make_demo_recording.py.\n")
        truth.write(f"reference: {{gravity_mps2: {GRAVITY}, field_ut: {FIELD_UT}, dip_rad: {dip!r}}}\n")
        truth.write("sensors:\n")
        for name, sensor in (("accelerometer", ACCEL), ("gyroscope", GYRO), ("magnetometer", MAG)):
            truth.write(f"  {name}:\n    bias: [{', '.join(repr(x) for x in sensor['bias'])}]\n"
                        f"    sensitivity: {matrix_text(sensor['sensitivity'])}\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
