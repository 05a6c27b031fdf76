# SPDX-License-Identifier: Apache-2.0
"""The module among others in a process: threads, forks, interpreters, signals, and what 1000 calibrations leave."""
import signal
import subprocess
import sys
import threading
import time

import pytest

import truetriad

DEMO = "datasets/demo/recording.csv"
SCENARIO = "configs/scenarios/consumer-9dof.yaml"


def run_script(script, code=0, flags=()):
    done = subprocess.run([sys.executable, *flags, "-c", script], capture_output=True, text=True)
    assert done.returncode == code, (done.returncode, done.stderr)
    return done


def test_threads_that_calibrate_at_once_do_not_meet(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    recording, _ = truetriad.simulate(SCENARIO)
    found = []
    work = [threading.Thread(target=lambda log=log: found.append((log is DEMO, truetriad.calibrate(log).to_yaml())))
            for log in (DEMO, recording) * 3]
    for thread in work:
        thread.start()
    for thread in work:
        thread.join()
    assert len(found) == 6 and len(set(found)) == 2


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_pools_of_processes_return_calibrations(tmp_path, method):
    script = tmp_path / "pool.py"
    script.write_text(f"""
import multiprocessing
import truetriad

if __name__ == "__main__":
    truetriad.calibrate({DEMO!r})  # Whatever it holds is there before the fork.
    with multiprocessing.get_context({method!r}).Pool(2) as pool:
        found = pool.map(truetriad.calibrate, [{DEMO!r}] * 4)
        assert all(c.usable for c in found)
        try:
            pool.map(truetriad.load, ["nothing.yaml"])
        except truetriad.BadInput as error:
            assert error.file == "nothing.yaml"
""")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_another_library_may_hold_gflags_and_glog():
    run_script(f"""
import ctypes, ctypes.util
libraries = [ctypes.CDLL(name, ctypes.RTLD_GLOBAL) for name in map(ctypes.util.find_library, ("gflags", "glog")) if name]
import truetriad
assert truetriad.calibrate({DEMO!r}).usable
""")


def test_further_interpreters_do_not_abort():
    pytest.importorskip("_xxsubinterpreters")
    done = run_script(f"""
import _xxsubinterpreters as interpreters
import truetriad
for _ in range(2):
    one = interpreters.create()
    try:
        interpreters.run_string(one, "import truetriad; assert truetriad.calibrate({DEMO!r}).usable")
    except interpreters.RunFailedError as error:
        print(error)
    interpreters.destroy(one)
assert truetriad.calibrate({DEMO!r}).usable
""")
    assert done.stdout == ""


def test_warnings_as_errors():
    run_script(f"""
import truetriad
recording, truth = truetriad.simulate({SCENARIO!r})
calibration = truetriad.calibrate(recording)
truetriad.compare(calibration, truth)
print(calibration.text, calibration.covariance, calibration.to_dict())
""", flags=("-W", "error"))


def test_a_closed_stdout_is_no_crash():
    run_script(f"""
import os, sys, truetriad
os.close(1)
calibration = truetriad.calibrate({DEMO!r})
assert calibration.usable
try:
    print(calibration, flush=True)
except OSError:
    sys.stdout = None
""")


def enough(share):
    raise RuntimeError("enough")


CALLS = {
    "calibrate": lambda stop: truetriad.calibrate(DEMO, progress=stop),
    "evaluate": lambda stop: truetriad.evaluate(truetriad.calibrate(DEMO), DEMO, progress=stop),
    "allan": lambda stop: truetriad.allan(DEMO, progress=stop),
    "plan": lambda stop: truetriad.plan("configs/plans/joint-12.yaml", DEMO, progress=stop),
    "simulate": lambda stop: truetriad.simulate(SCENARIO, progress=stop),
}


@pytest.mark.parametrize("name", CALLS)
def test_what_progress_raises_ends_the_work(name):
    with pytest.raises(RuntimeError, match="enough"):
        CALLS[name](enough)


def test_progress_may_calibrate_itself():
    found = []

    def calibrate_another(share):
        found.append(truetriad.calibrate(DEMO).usable)

    assert truetriad.calibrate(DEMO, progress=calibrate_another).usable and found and all(found)


# Each in a loop, so that Ctrl-C comes wherever it may.
LONG = {
    "calibrate": f"truetriad.calibrate({DEMO!r})",
    "calibrate arrays": "truetriad.calibrate(recording)",
    "evaluate": f"truetriad.evaluate(calibration, {DEMO!r})",
    "allan": f"truetriad.allan({DEMO!r})",
    "plan": "truetriad.plan('configs/plans/joint-12.yaml')",
    "simulate": f"truetriad.simulate({SCENARIO!r})",
    "correct": "calibration.accelerometer.correct(raw)",
}


@pytest.mark.parametrize("name", LONG)
def test_control_c_ends_every_call(name):
    script = f"""
import sys, numpy, truetriad
recording, _ = truetriad.simulate({SCENARIO!r})
calibration = truetriad.calibrate({DEMO!r})
raw = numpy.ones((2_000_000, 3))
try:
    print("ready", flush=True)
    while True:
        {LONG[name]}
except KeyboardInterrupt:
    sys.exit(42)
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    assert process.wait() == 42
    process.stdout.close()


def test_a_thousand_calibrations_leave_nothing():
    """Memory in use after 1000 more is that after the first, but for what allocators hold back."""
    done = run_script(f"""
import gc, truetriad
recording, _ = truetriad.simulate({SCENARIO!r})
raw = recording.accelerometer[:100]

def resident_kib():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))

def once():
    calibration = truetriad.calibrate({DEMO!r}, set={{"sensors": {{"accelerometer": {{"model": "diagonal"}}}}}})
    calibration.accelerometer.correct(raw), calibration.to_dict(), calibration.findings, calibration.covariance
    try:
        truetriad.load("nothing.yaml")
    except truetriad.BadInput:
        pass

for _ in range(50):
    once()
before = resident_kib()
for _ in range({LEAK_RUNS}):
    once()
gc.collect()
print(resident_kib() - before)
""")
    # A leaked result alone would be 20 KiB a run.
    assert int(done.stdout) < 4 * LEAK_RUNS, done.stdout


LEAK_RUNS = 1000
