#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the calibration from a checkout of CircuitPython_mag_cal on a table of poses.

    mag_cal_main.py CHECKOUT TABLE OUT.json

TABLE has a header line, then accel_x y z and mag_x y z in each row, in device axes. The routine is
AXIS_CORRECTION: it fits an ellipsoid to each sensor, then turns both sensors so that poses rolled
about the instrument's y axis agree. mag_cal multiplies a row by its matrix; OUT.json has the
transposed matrix.
"""
import json
import sys

import numpy as np


def main():
    checkout, table, output = sys.argv[1:]
    sys.path.insert(0, checkout)
    from mag_cal import Calibration

    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    calibration = Calibration()
    calibration.calibrate(rows[:, 3:6], rows[:, :3], routine=Calibration.AXIS_CORRECTION)
    sensors = {
        name: {"bias": sensor.centre.tolist(), "correction": sensor.transform.T.tolist()}
        for name, sensor in (
            ("accelerometer", calibration.grav),
            ("magnetometer", calibration.mag),
        )
    }
    with open(output, "w", encoding="utf-8") as file:
        json.dump({"sensors": sensors}, file)


if __name__ == "__main__":
    main()
