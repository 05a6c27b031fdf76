#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs ellipsoid_fit of a checkout of ellipsoid_fit_python on a table of readings.

    ellipsoid_fit_main.py CHECKOUT TABLE OUT.json

TABLE has x y z a row. Its ellipsoid (centre, axes, radii) becomes bias and the symmetric correction
that makes the ellipsoid a sphere of the mean radius, as its own sample script does it.
"""
import json
import sys

import numpy as np


def main():
    checkout, table, output = sys.argv[1:]
    sys.path.insert(0, checkout)
    from ellipsoid_fit import ellipsoid_fit

    centre, axes, radii = ellipsoid_fit(np.loadtxt(table))
    correction = axes.T @ np.diag(np.mean(radii) / radii) @ axes
    triad = {"bias": centre.tolist(), "correction": correction.tolist()}
    with open(output, "w", encoding="utf-8") as file:
        json.dump({"sensors": {"magnetometer": triad}}, file)


if __name__ == "__main__":
    main()
