# SPDX-License-Identifier: Apache-2.0
import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import truetriad

DEMO = "datasets/demo/recording.csv"
JOINT = "configs/experiments/joint.yaml"


@pytest.fixture(scope="module")
def demo():
    return truetriad.calibrate(DEMO)


@pytest.fixture(autouse=True)
def same_time(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")


def bytes_of(path):
    with open(path, "rb") as file:
        return file.read()


@pytest.mark.parametrize("set_, words", [({}, []), ({"reference.gravity_mps2": 9.81, "gauge": "accel-z"},
                                                    ["--set=reference.gravity_mps2=9.81,gauge=accel-z"])])
def test_log_alone_gives_the_bytes_of_the_command_line(run, tmp_path, set_, words):
    run("calibrate", DEMO, "-o", tmp_path / "cli", *words)
    calibration = truetriad.calibrate(DEMO, set=set_, folder=tmp_path / "cli")
    calibration.save(tmp_path / "calibration.yaml")
    assert bytes_of(tmp_path / "calibration.yaml") == bytes_of(tmp_path / "cli" / "calibration.yaml")


def test_experiment_gives_the_bytes_of_the_command_line(run, tmp_path):
    run("calibrate", "-c", JOINT, "-o", tmp_path)
    calibration = truetriad.calibrate(config=JOINT)
    assert calibration.to_yaml().encode() == bytes_of(tmp_path / "calibration.yaml")
    assert json.dumps(calibration.to_dict()) == json.dumps(json.loads(bytes_of(tmp_path / "calibration.json")))


def test_default_folder_is_that_of_the_command_line(run, tmp_path, monkeypatch):
    (tmp_path / "log.csv").write_bytes(bytes_of(DEMO))
    monkeypatch.chdir(tmp_path)
    run("calibrate", "log.csv")
    assert truetriad.calibrate("log.csv").to_yaml().encode() == bytes_of("log.csv.truetriad/calibration.yaml")


def test_print_gives_verdict_and_head_of_the_report(demo):
    lines = str(demo).splitlines()
    assert lines[0].startswith("NO LIMITS SET: ") and demo.verdict == "NO_LIMITS"
    assert any(DEMO in line for line in lines)
    assert "Limits" not in lines and "Limits" in demo.text.splitlines()
    assert demo.usable and demo.status == "converged" and demo.within_limits is None


def test_dict_is_an_experiment():
    config = {"experiment": 1, "sensors": {"accelerometer": {"model": "diagonal"}},
              "reference": {"gravity_mps2": {"value": 9.80665, "sigma": 0.02}},
              "limits": {"accelerometer.bias": 1e-6}}
    calibration = truetriad.calibrate(DEMO, config)
    assert calibration.magnetometer is None and calibration.gyroscope is None
    assert calibration.usable and calibration.within_limits is False
    assert np.count_nonzero(calibration.accelerometer.sensitivity) == 3


def test_saves_loads_and_reports(demo, tmp_path):
    demo.save(tmp_path / "c.yaml")
    again = truetriad.load(tmp_path / "c.yaml")
    assert again.to_yaml() == demo.to_yaml()
    demo.report(tmp_path / "c.html")
    assert bytes_of(tmp_path / "c.html").lower().startswith(b"<!doctype html>")


def test_does_not_overwrite_its_recording(tmp_path):
    log = tmp_path / "log.csv"
    log.write_bytes(bytes_of(DEMO))
    with pytest.raises(truetriad.BadInput) as caught:
        truetriad.calibrate(log).save(log)
    assert caught.value.code == "output-in-the-way" and log.read_bytes() == bytes_of(DEMO)


def test_covariance_has_names(demo):
    covariance = demo.covariance
    file = demo.to_dict()["covariance"]
    assert covariance.names == file["parameters"]
    assert np.array_equal(np.asarray(covariance), np.array(file["matrix"]))
    sigma = covariance.sigma("accelerometer.bias.y")
    assert sigma == pytest.approx(demo.accelerometer.bias_sigma[1], rel=1e-12)
    with pytest.raises(KeyError):
        covariance["accelerometer.bias.x", "nothing"]


def test_findings_have_code_severity_and_values(demo):
    finding = next(f for f in demo.findings if f.code == "nominal-field")
    assert finding.severity == "note" and finding.sensor == "magnetometer" and finding.axis is None
    assert finding.remedy in finding.message
    assert finding.values["strength"]["unit"] == "uT"


def test_errors_say_where(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time[s],accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]\n0,0,0,9.8\n0.01,0,x,9.8\n")
    with pytest.raises(truetriad.BadInput) as caught:
        truetriad.calibrate(log)
    error = caught.value
    assert (error.code, error.file, error.line) == ("unreadable-number", str(log), 3)
    assert error.message == str(error)
    with pytest.raises(truetriad.Error) as caught:
        truetriad.calibrate(DEMO, {"experiment": 1, "sensor": {}})
    assert caught.value.code == "unknown-key" and "sensors" in str(caught.value)
    with pytest.raises(truetriad.Usage):
        truetriad.calibrate()
    with pytest.raises(truetriad.BadInput):
        truetriad.load(tmp_path / "nothing.yaml")


def test_too_little_data_is_no_exception(tmp_path):
    with open(DEMO) as file:
        (tmp_path / "log.csv").write_text("".join(file.readlines()[:600]))
    calibration = truetriad.calibrate(tmp_path / "log.csv")
    assert not calibration.usable and calibration.accelerometer is None
    assert len(calibration.covariance) == 0
    assert any(f.severity == "refusal" for f in calibration.findings)
    assert "sensors" not in calibration.to_dict()


def test_gyroscope_alone_is_not_enough():
    gyroscope = 1e-3 * np.random.default_rng(1).normal(size=(5000, 3))
    with pytest.raises(truetriad.NotEnough):
        truetriad.calibrate(truetriad.Recording({"gyroscope": gyroscope}, {"gyroscope": "rad/s"}, rate_hz=100))


def test_progress_rises_and_may_stop_the_work(tmp_path):
    shares = []
    truetriad.calibrate(DEMO, progress=shares.append)
    assert shares and shares == sorted(shares) and 0 <= shares[0] <= shares[-1] <= 1

    def stop(share):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        truetriad.calibrate(DEMO, progress=stop)


LONG = """
import numpy, sys, truetriad
rng = numpy.random.default_rng(1)
readings = rng.normal(size=(20_000_000, 3))
recording = truetriad.Recording({"gyroscope": readings}, {"gyroscope": "rad/s"}, rate_hz=100)
recording._core()
del readings
try:
    print("ready", flush=True)
    truetriad.allan(recording)
except KeyboardInterrupt:
    sys.exit(42)
"""


def test_control_c_ends_long_work():
    with subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        assert process.wait() == 42


def test_other_threads_go_on():
    rng = np.random.default_rng(1)
    recording = truetriad.Recording({"gyroscope": rng.normal(size=(3_000_000, 3))}, {"gyroscope": "rad/s"},
                                    rate_hz=100)
    recording._core()
    thread = threading.Thread(target=truetriad.allan, args=(recording,))
    thread.start()
    turns = 0
    while thread.is_alive():
        time.sleep(0.001)
        turns += 1
    thread.join()
    assert turns > 50


def test_numpy_is_imported_only_when_needed():
    script = (f"import sys, truetriad; print(truetriad.calibrate({DEMO!r}).verdict);"
              "sys.exit('numpy' in sys.modules)")
    assert subprocess.run([sys.executable, "-c", script], stdout=subprocess.DEVNULL).returncode == 0


def test_magnetic_model_comes_along():
    config = {"experiment": 1, "sensors": {"accelerometer": {"model": "full"}, "magnetometer": {"model": "full"}},
              "reference": {"position": {"latitude_deg": 47.0, "longitude_deg": 8.0, "height_m": 400.0,
                                         "date": "2026-01-31"}}}
    environment = {key: value for key, value in os.environ.items() if key != "TRUETRIAD_SHARE"}
    script = f"import truetriad; truetriad.calibrate({DEMO!r}, {config!r})"
    subprocess.run([sys.executable, "-c", script], check=True, env=environment)
