# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import truetriad

SCENARIO = "configs/scenarios/consumer-9dof.yaml"
UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s", "magnetometer": "uT"}


@pytest.fixture(scope="module")
def simulated():
    return truetriad.simulate(SCENARIO)


@pytest.fixture(scope="module")
def calibration(simulated):
    return truetriad.calibrate(simulated[0])


def expect_same(a, b):
    """Of the same readings in other blocks, over which sums round otherwise. Rounds of weights end where they
    change by 1e-8 (kRoundTolerance); that moves an estimate by at most 1e-8 sqrt(chi^2) of its sigma, either
    of the two by 1e-7 with 98 degrees of freedom."""
    assert a.covariance.names == b.covariance.names
    assert a.covariance.matrix == pytest.approx(b.covariance.matrix, rel=1e-6)
    for sensor in UNITS:
        of_a, of_b = getattr(a, sensor), getattr(b, sensor)
        assert (abs(of_a.bias - of_b.bias) <= 2e-7 * of_a.bias_sigma).all()
        assert (abs(of_a.sensitivity - of_b.sensitivity) <= 2e-7 * of_a.sensitivity_sigma).all()


def test_simulation_is_that_of_the_command_line(run, tmp_path, simulated, calibration):
    run("simulate", SCENARIO, "-o", tmp_path)
    recording, truth = simulated
    of_file = truetriad.calibrate(tmp_path / "recording.yaml")
    expect_same(of_file, calibration)
    written = truetriad.load(tmp_path / "truth.yaml")
    assert truth.to_dict()["sensors"] == written.to_dict()["sensors"]


def test_saved_arrays_are_the_recording(tmp_path, simulated, calibration):
    again = truetriad.calibrate(simulated[0].save(tmp_path))
    expect_same(again, calibration)
    assert again.serial == calibration.serial == "A0001"


def test_calibration_is_near_the_truth(simulated, calibration):
    assert truetriad.compare(calibration, simulated[1]).verdict == "agree"


def test_evaluate_knows_its_own_recording(simulated, calibration):
    evaluation = truetriad.evaluate(calibration, simulated[0])
    assert evaluation.verdict == "no-test" and evaluation["is_own"]
    other, _ = truetriad.simulate(SCENARIO, set={"seed": 77})
    assert truetriad.evaluate(calibration, other)["poses"] > 0


def table_of(recording):
    """Columns as in a CSV, of the sensors that share times."""
    table = {"time[s]": recording.time("accelerometer")}
    for prefix, sensor in (("accel", "accelerometer"), ("gyro", "gyroscope")):
        for axis, values in zip("xyz", getattr(recording, sensor).T):
            table[f"{prefix}_{axis}[{UNITS[sensor]}]"] = values
    return table


@pytest.fixture(scope="module")
def two_sensors():
    recording, _ = truetriad.simulate("configs/scenarios/tactical-6dof.yaml")
    count = min(len(recording.accelerometer), len(recording.gyroscope))
    data = {"time_ns": recording.sensors["accelerometer"]["time_ns"][:count]}
    for sensor in ("accelerometer", "gyroscope"):
        data[sensor] = getattr(recording, sensor)[:count]
    return truetriad.Recording(data, UNITS)


def test_columns_are_as_in_a_csv(two_sensors):
    stated = truetriad.Recording(table_of(two_sensors))
    for sensor in stated.sensors:
        assert np.array_equal(getattr(stated, sensor), getattr(two_sensors, sensor))
        assert stated.sensors[sensor]["unit"] == UNITS[sensor]


def test_data_frames(two_sensors):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(table_of(two_sensors))
    assert truetriad.calibrate(frame).to_dict()["sensors"] == truetriad.calibrate(two_sensors).to_dict()["sensors"]


def test_rows_without_a_reading_are_dropped(two_sensors):
    count = len(two_sensors.accelerometer)
    twice = np.full((2 * count, 3), np.nan)
    twice[::2] = two_sensors.accelerometer
    time_ns = np.repeat(two_sensors.sensors["accelerometer"]["time_ns"], 2)
    data = {"accelerometer": {"time_ns": time_ns, "readings": twice},
            "gyroscope": {"time_ns": time_ns[::2], "readings": two_sensors.gyroscope}}
    a, b = truetriad.calibrate(data, units=UNITS), truetriad.calibrate(two_sensors)
    assert np.array_equal(a.accelerometer.bias, b.accelerometer.bias)
    assert np.array_equal(a.gyroscope.bias, b.gyroscope.bias)


def test_rows_as_poses():
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(60, 3))
    readings = 9.80665 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    readings = readings @ np.diag([1.01, 0.99, 1.02]) + [0.1, -0.2, 0.3] + 1e-3 * rng.normal(size=(60, 3))
    config = {"experiment": 1, "sensors": {"accelerometer": {"model": "full"}}, "poses": "every_row"}
    calibration = truetriad.calibrate({"accelerometer": readings}, config, units=UNITS)
    assert calibration.usable
    assert calibration.accelerometer.bias == pytest.approx([0.1, -0.2, 0.3], abs=0.01)


def test_units_and_shapes_are_never_guessed():
    readings = np.zeros((10, 3))
    with pytest.raises(truetriad.Usage, match="mapping"):
        truetriad.calibrate(readings)
    with pytest.raises(truetriad.Usage, match="no unit"):
        truetriad.Recording({"accelerometer": readings})
    with pytest.raises(truetriad.Usage, match=r"expected \(N, 3\)"):
        truetriad.Recording({"accelerometer": readings.T}, UNITS)
    with pytest.raises(truetriad.Usage, match="10 readings, but time"):
        truetriad.Recording({"time": np.arange(9.0), "accelerometer": readings}, UNITS)
    with pytest.raises(truetriad.Usage, match="not known"):
        truetriad.Recording({"accelerometr": readings}, UNITS)
    with pytest.raises(truetriad.Usage, match="rate_hz and time"):
        truetriad.Recording({"time": np.arange(10.0), "accelerometer": readings}, UNITS, rate_hz=1)
    with pytest.raises(truetriad.BadInput, match="unit"):
        truetriad.calibrate({"time": np.arange(10.0), "accelerometer": readings}, units={"accelerometer": "furlong"})


def test_times_that_go_back_and_infinite_readings_are_refused():
    time, readings = np.arange(100.0), np.random.default_rng(1).normal(size=(100, 3))
    time[50] = 3
    with pytest.raises(truetriad.BadInput) as caught:
        truetriad.calibrate({"time": time, "accelerometer": readings}, units=UNITS)
    assert caught.value.code == "time-goes-back" and "row 50" in str(caught.value)
    readings[7, 1] = np.inf
    with pytest.raises(truetriad.BadInput, match="row 7"):
        truetriad.calibrate({"time": np.arange(100.0), "accelerometer": readings}, units=UNITS)


def test_allan_of_an_array_finds_its_noise():
    density, rate = 1e-3, 100.0
    readings = np.random.default_rng(5).normal(size=(400_000, 3)) * density * rate**0.5
    result = truetriad.allan(readings, rate)
    for axis in result["sensors"]["gyroscope"]["axes"].values():
        # 4 sigma of N over 4000 s of white noise, fitted over a decade of tau: some per cent.
        assert axis["noise_density"]["value"] == pytest.approx(density, rel=0.05)


def test_plan_says_whether_it_is_met():
    plan = truetriad.plan("configs/plans/joint-12.yaml")
    assert plan.met is plan["met"] and len(plan["program"]["poses"]) > 0
    assert str(plan) == plan.text


def test_sessions_of_arrays():
    sessions = [truetriad.simulate(SCENARIO, set={"seed": 5})[0], truetriad.simulate(SCENARIO, set={"seed": 5})[0]]
    sessions[1].name = "again"
    with pytest.raises(truetriad.Error):  # The same readings twice are no second session.
        truetriad.calibrate(sessions)
