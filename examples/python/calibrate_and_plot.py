# SPDX-License-Identifier: Apache-2.0
"""Calibrates a log and draws how long its accelerometer's readings at rest are, before and after.

    python3 examples/python/calibrate_and_plot.py datasets/demo/recording.csv out/norms.png

Without matplotlib it prints the numbers alone.
"""
import sys

import numpy as np

import truetriad

log, picture = sys.argv[1:3]
calibration = truetriad.calibrate(log)
print(calibration)
if not calibration.usable:
    sys.exit(3)

with open(log) as file:
    lines = [line for line in file if not line.startswith("#")]
names = lines[0].strip().split(",")
table = np.genfromtxt(lines[1:], delimiter=",")
raw = table[:, [k for axis in "xyz" for k, name in enumerate(names) if name.startswith(f"accel_{axis}[")]]
before = np.linalg.norm(raw, axis=1)
after = np.linalg.norm(calibration.accelerometer.correct(raw), axis=1)
for title, norm in (("raw", before), ("corrected", after)):
    low, high = np.nanpercentile(norm, [5, 95])
    print(f"{title:>9}: 90 % of the lengths are within {low:.4f} and {high:.4f}")

try:
    import matplotlib
except ImportError:
    print("no picture: matplotlib is not installed")
    sys.exit(0)
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

figure, axes = plt.subplots(figsize=(8, 4))
axes.plot(before, label=f"raw, {calibration.accelerometer.input_unit}", linewidth=0.5)
axes.plot(after, label="corrected, m/s^2", linewidth=0.5)
axes.set_xlabel("row")
axes.set_ylabel("length of the accelerometer's reading")
axes.legend()
figure.savefig(picture)
print(f"picture: {picture}")
