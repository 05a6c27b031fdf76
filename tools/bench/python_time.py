#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the time that Python adds to a calibration, and how fast arrays are corrected. Prints
medians.

    PYTHONPATH=build/python /usr/bin/python3 tools/bench/python_time.py [BUILD_FOLDER]      default: build

RUNS (default 25) processes of each kind run in turns; arrays have READINGS (default 1e7) x 3
values. CPU is user and system time. Run it from the root of the repository; see
docs/performance.md.
"""
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import truetriad

LOG = "datasets/demo/recording.csv"


def cpu_and_wall(command):
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return 1e3 * spent, 1e3 * (time.perf_counter() - start)


def time_processes(build, runs):
    with tempfile.TemporaryDirectory() as folder:
        python = [sys.executable, "-c"]
        commands = {
            "truetriad calibrate": [f"{build}/truetriad", "calibrate", LOG, "-o", folder, "--overwrite"],
            "python3, nothing": python + ["pass"],
            "python3, import": python + ["import truetriad"],
            "python3, calibrate": python + [f"import truetriad; print(truetriad.calibrate({LOG!r}))"],
        }
        times = {name: [] for name in commands}
        for _ in range(runs + 1):
            for name, command in commands.items():
                times[name].append(cpu_and_wall(command))
    print(f"{'ms a process':<24} {'CPU':>8} {'wall':>8}")
    for name, found in times.items():
        cpu, wall = (statistics.median(column) for column in zip(*found[1:]))  # The first fills the page cache.
        print(f"{name:<24} {cpu:8.1f} {wall:8.1f}")


def cpu_of(work):
    start = time.process_time()
    work()
    return time.process_time() - start


def time_arrays(count):
    raw = np.random.default_rng(1).normal(size=(count, 3))
    temperature = 25 + 20 * np.sin(np.arange(count) * 1e-5)
    seconds = np.arange(count) * 1e-3
    demo = truetriad.calibrate(LOG).accelerometer
    _, truth = truetriad.simulate("configs/scenarios/thermal-soak.yaml")
    thermal, lagging = truth.accelerometer, with_lag(truth)
    bias, transposed = demo.bias, demo.correction.T
    out = np.empty_like(raw)
    work = {
        "(a - b) @ C.T": lambda: (raw - bias) @ transposed,
        "correct": lambda: demo.correct(raw),
        "correct, out=": lambda: demo.correct(raw, out=out),
        "with temperature terms": lambda: thermal.correct(raw, temperature),
        "and a lag": lambda: lagging.correct(raw, temperature, time=seconds),
    }
    times = {name: [] for name in work}
    for _ in range(5):
        for name, call in work.items():
            times[name].append(cpu_of(call))
    floor = statistics.median(times["(a - b) @ C.T"])
    print(f"{count:.0e} x 3 values {'CPU s':>14} {'times NumPy':>12}")
    for name, found in times.items():
        print(f"{name:<24} {statistics.median(found):8.3f} {statistics.median(found) / floor:12.2f}")


def with_lag(truth):
    """The accelerometer of `truth` with temperature terms that lag the thermometer by half a minute."""
    text = truth.to_yaml().replace("      rate: {", "      element_lag_s: [30, 30, 30]\n      rate: {", 1)
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(text)
        file.flush()
        sensor = truetriad.load(file.name).accelerometer
    assert sensor.needs_time
    return sensor


build = sys.argv[1] if len(sys.argv) > 1 else "build"
if os.environ.get("RUNS") != "0":
    time_processes(build, int(os.environ.get("RUNS", "25")))
time_arrays(int(float(os.environ.get("READINGS", "1e7"))))
