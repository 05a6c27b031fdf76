# SPDX-License-Identifier: Apache-2.0
import csv

import numpy as np
import pytest

import truetriad

DEMO = "datasets/demo/recording.csv"


@pytest.fixture(scope="module")
def demo():
    return truetriad.calibrate(DEMO)


@pytest.fixture
def raw():
    return np.random.default_rng(2).normal(size=(1000, 3)) * 5


def corrected_file(run, tmp_path, calibration, log, prefix):
    """What `truetriad apply` writes of one sensor, and its temperature."""
    calibration.save(tmp_path / "c.yaml")
    run("apply", tmp_path / "c.yaml", log, "-o", tmp_path / "out.csv")
    with open(tmp_path / "out.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = [name for axis in "xyz" for name in rows[0] if name.startswith(f"{prefix}_{axis}[")]
    return np.array([[float(row[name] or "nan") for name in names] for row in rows])


def test_correct_is_the_equation(demo, raw):
    sensor = demo.accelerometer
    expected = (raw - sensor.bias) @ sensor.correction.T
    assert sensor.correct(raw) == pytest.approx(expected, rel=1e-13, abs=1e-13)
    assert sensor.correction @ sensor.sensitivity == pytest.approx(np.eye(3), abs=1e-13)
    assert np.array_equal(sensor.correct(raw[3]), sensor.correct(raw)[3])


def test_lists_floats_and_strides_are_taken(demo, raw):
    sensor = demo.accelerometer
    assert np.array_equal(sensor.correct(raw.tolist()), sensor.correct(raw))
    assert np.array_equal(sensor.correct(np.asfortranarray(raw)), sensor.correct(raw))
    single = raw.astype(np.float32)
    assert np.array_equal(sensor.correct(single), sensor.correct(single.astype(float)))
    assert sensor.correct(np.empty((0, 3))).shape == (0, 3)


def test_out_is_filled_and_may_be_the_readings(demo, raw):
    sensor = demo.magnetometer
    expected = sensor.correct(raw)
    assert sensor.correct(raw, out=raw) is raw
    assert np.array_equal(raw, expected)
    with pytest.raises(truetriad.Usage, match="overlaps"):
        sensor.correct(raw[1:], out=raw[:-1])
    with pytest.raises(truetriad.Usage, match="out"):
        sensor.correct(raw, out=np.empty((2, 3)))
    with pytest.raises(truetriad.Usage, match="out"):
        sensor.correct(raw, out=np.empty(raw.shape, np.float32))


def test_wrong_shapes_are_refused(demo, raw):
    for wrong in (raw.T, raw.ravel(), np.zeros((2, 2, 3)), 1.0):
        with pytest.raises(ValueError):
            demo.accelerometer.correct(wrong)


def test_correct_is_apply(run, tmp_path, demo):
    with open(DEMO) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    names = [name for axis in "xyz" for name in rows[0] if name.startswith(f"gyro_{axis}[")]
    readings = np.array([[float(row[name]) for name in names] for row in rows])
    expected = corrected_file(run, tmp_path, demo, DEMO, "gyro")
    assert demo.gyroscope.correct(readings) == pytest.approx(expected, rel=1e-14, abs=1e-17)


@pytest.fixture(scope="module")
def soaked(tmp_path_factory):
    recording, truth = truetriad.simulate("configs/scenarios/thermal-soak.yaml")
    return recording, truth, recording.save(tmp_path_factory.mktemp("soak"))


def test_temperature_terms_are_those_of_apply(run, tmp_path, soaked):
    recording, truth, log = soaked
    sensor = next(s for s in (truth.accelerometer, truth.gyroscope) if s is not None and s.needs_temperature)
    readings, temperature = recording.sensors[sensor.name]["readings"], recording.temperature(sensor.name)
    time = recording.time(sensor.name)
    force = np.zeros(3) if sensor.needs_specific_force else None
    corrected = sensor.correct(readings, temperature, time=time, specific_force=force)
    prefix = {"accelerometer": "accel", "gyroscope": "gyro"}[sensor.name]
    expected = corrected_file(run, tmp_path, truth, log, prefix)
    expected = expected[~np.isnan(expected).any(axis=1)]
    assert corrected == pytest.approx(expected, rel=1e-12, abs=1e-14)


def test_missing_temperature_is_said(soaked):
    _, truth, _ = soaked
    sensor = next(s for s in (truth.accelerometer, truth.gyroscope) if s is not None and s.needs_temperature)
    with pytest.raises(truetriad.BadInput) as caught:
        sensor.correct(np.zeros((2, 3)))
    assert caught.value.code == "missing-temperature"
    with pytest.raises(truetriad.Usage, match="temperature has 3 values for 2 readings"):
        sensor.correct(np.zeros((2, 3)), np.zeros(3))
    one, many = sensor.correct(np.ones((2, 3)), 30.0), sensor.correct(np.ones((2, 3)), [30.0, 30.0])
    assert np.array_equal(one, many)
