#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs ellipsoid_fit from a checkout of ellipsoid_fit_python on a table of readings.

    ellipsoid_fit_main.py CHECKOUT TABLE OUT.json [SENSOR ROWS]

TABLE has magnetometer readings, x y z in each row. With SENSOR and ROWS, TABLE is a CSV with a
header line, and each ROWS rows are first averaged to one pose. The centre of the ellipsoid is the
bias. Its axes and radii give the symmetric correction to a sphere of the mean radius, as in the
checkout's sample script.
"""
import json
import sys

import numpy as np


def main():
    checkout, table, output = sys.argv[1:4]
    sensor, rows = (sys.argv[4], int(sys.argv[5])) if len(sys.argv) == 6 else ("magnetometer", 0)
    sys.path.insert(0, checkout)
    from ellipsoid_fit import ellipsoid_fit

    if rows:
        points = np.loadtxt(table, delimiter=",", skiprows=1)
        points = points.reshape(-1, rows, 3).mean(axis=1)
    else:
        points = np.loadtxt(table)
    centre, axes, radii = ellipsoid_fit(points)
    correction = axes.T @ np.diag(np.mean(radii) / radii) @ axes
    triad = {"bias": centre.tolist(), "correction": correction.tolist()}
    with open(output, "w", encoding="utf-8") as file:
        json.dump({"sensors": {sensor: triad}}, file)


if __name__ == "__main__":
    main()
