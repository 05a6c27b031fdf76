# SPDX-License-Identifier: Apache-2.0
"""Are the sigmas of a calibration right? Simulates one unit's recording many times, calibrates each, and holds
the errors against what each calibration says of itself.

    python3 examples/python/monte_carlo.py configs/scenarios/consumer-9dof.yaml 20

The RMS of errors in sigmas should be 1, give or take 1 / sqrt(2 runs) for one parameter.
"""
import sys

import numpy as np

import truetriad

scenario, runs = sys.argv[1], int(sys.argv[2])
in_sigmas = {}
for run in range(runs):
    recording, truth = truetriad.simulate(scenario, set={"seed": 1000 + run})
    calibration = truetriad.calibrate(recording)
    if not calibration.usable:
        print(f"run {run}: {calibration.verdict}: {calibration.findings[0].message}")
        continue
    for entry in truetriad.compare(calibration, truth)["parameters"]:
        if entry["sigma"]:
            in_sigmas.setdefault(entry["parameter"], []).append(entry["difference"] / entry["sigma"])

print(f"{'parameter':<36} RMS error in sigmas")
for parameter, errors in in_sigmas.items():
    print(f"{parameter:<36} {np.sqrt(np.mean(np.square(errors))):.2f}")
everything = np.concatenate([np.array(errors) for errors in in_sigmas.values()])
print(f"{'all':<36} {np.sqrt(np.mean(everything**2)):.2f}")
