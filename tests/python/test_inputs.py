# SPDX-License-Identifier: Apache-2.0
"""Whatever is given: it is taken as it is meant, or refused by an error that says what to do."""
import os
import pathlib

import numpy as np
import pytest

import truetriad

DEMO = "datasets/demo/recording.csv"
UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s", "magnetometer": "uT"}
ONES = np.ones((5, 3))
TIME = np.arange(5.0)


@pytest.fixture(scope="module")
def demo():
    return truetriad.calibrate(DEMO)


def recording(**data):
    return truetriad.Recording({"time": TIME, "accelerometer": ONES, **data}, UNITS)


NO_NUMBERS = {
    "complex": ONES + 1j, "texts": [["1", "2", "3"]], "booleans": ONES > 0, "dates": ONES.astype("M8[ns]"),
    "ragged": [[1, 2], [3]], "objects": [[object()] * 3],
}


@pytest.mark.parametrize("name", NO_NUMBERS)
def test_what_is_no_number_is_refused(demo, name):
    with pytest.raises(truetriad.Usage, match="expected an array of integers or real numbers"):
        demo.accelerometer.correct(NO_NUMBERS[name])
    with pytest.raises(truetriad.Usage, match="accelerometer: .* expected an array"):
        recording(accelerometer=NO_NUMBERS[name])


def test_masked_readings_are_none(demo):
    mask = np.zeros(ONES.shape, bool)
    mask[2, 1] = True
    for masked in (np.ma.masked_array(ONES, mask), np.ma.masked_array(ONES.astype(int), mask)):
        corrected = demo.accelerometer.correct(masked)
        assert np.isnan(corrected[2]).all() and np.isfinite(np.delete(corrected, 2, axis=0)).all()
        assert np.isnan(recording(accelerometer=masked).accelerometer[2, 1])
    with pytest.raises(truetriad.Usage, match="row 1: time is nan"):
        recording(time=np.ma.masked_array(TIME, [0, 1, 0, 0, 0]))


def test_every_layout_is_the_same_numbers(demo):
    raw = np.random.default_rng(2).normal(size=(7, 3))
    expected = demo.accelerometer.correct(raw)
    shifted = np.frombuffer(b"x" + raw.tobytes(), np.uint8)[1:].view(np.float64).reshape(7, 3)
    read_only = raw.copy()
    read_only.flags.writeable = False
    for same in (raw.astype(">f8"), raw.astype(np.longdouble), raw[::-1][::-1], shifted, read_only,
                 np.asfortranarray(raw), raw.astype(object), np.repeat(raw, 2, axis=0)[::2]):
        assert np.array_equal(demo.accelerometer.correct(same), expected)
    with pytest.raises(truetriad.Usage, match="out"):
        demo.accelerometer.correct(raw, out=read_only)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_times_of_numpy_are_exact(unit):
    dates = np.datetime64("2026-01-31", unit) + np.arange(5).astype(f"m8[{unit}]")
    stated = recording(time=dates).sensors["accelerometer"]["time_ns"]
    assert np.array_equal(stated, dates.astype("M8[ns]").astype(np.int64))
    assert np.array_equal(recording(time=dates - dates[0]).sensors["accelerometer"]["time_ns"], stated - stated[0])
    dates[3] = "NaT"
    with pytest.raises(truetriad.Usage, match="row 3: time is NaT"):
        recording(time=dates)


REFUSED = {
    "unknown key": (lambda: recording(accelerometer={"readings": ONES, "tempature": TIME}), "`tempature`"),
    "no readings": (lambda: recording(accelerometer={"time": TIME}), "no readings"),
    "unit of nothing": (lambda: truetriad.Recording({"accelerometer": ONES}, {**UNITS, "accel": "g"}), "`accel`"),
    "units": (lambda: truetriad.Recording({"accelerometer": ONES}, "g"), "expected a mapping"),
    "a number as unit": (lambda: truetriad.Recording({"accelerometer": ONES}, {"accelerometer": 1}), "a text"),
    "transposed": (lambda: recording(accelerometer=np.ones((3, 5))), "transpose"),
    "two times": (lambda: recording(time_ns=TIME.astype(int)), "both stated"),
    "times too far": (lambda: recording(time=TIME + 1e12), "expected seconds"),
    "part of a pose": (lambda: recording(pose=TIME + 0.5), "row 0: 0.5 is no integer"),
    "no pose": (lambda: recording(pose=TIME * np.nan), "no integer"),
    "too great a pose": (lambda: recording(pose=TIME + 1e12), "32 bits"),
    "heat": (lambda: recording(temperature=TIME + np.inf), "temperature is infinite"),
    "endless rate": (lambda: truetriad.Recording({"accelerometer": ONES}, UNITS, rate_hz=np.inf), "rate_hz"),
    "rate as text": (lambda: truetriad.Recording({"accelerometer": ONES}, UNITS, rate_hz="3"), "rate_hz"),
    "several rates": (lambda: truetriad.Recording({"accelerometer": ONES}, UNITS, rate_hz=TIME), "rate_hz"),
    "rate of allan": (lambda: truetriad.allan(ONES, -1), "rate_hz"),
    "sensor of allan": (lambda: truetriad.allan(ONES, 1, sensor="imu"), "sensor is `imu`"),
    "mapping of allan": (lambda: truetriad.allan({"gyroscope": ONES}, 1), "make a Recording"),
    "no log": (lambda: truetriad.calibrate(""), "name of a file"),
    "number as log": (lambda: truetriad.calibrate(3), "not int"),
    "no config": (lambda: truetriad.plan(None), "no config"),
    "list as config": (lambda: truetriad.calibrate(DEMO, [1]), "not list"),
    "no scenario": (lambda: truetriad.simulate(None), "no scenario"),
    "object in config": (lambda: truetriad.calibrate(DEMO, {"experiment": object()}), "not object"),
    "list as set": (lambda: truetriad.calibrate(DEMO, set=["a"]), "expected a mapping"),
    "progress": (lambda: truetriad.calibrate(DEMO, progress=3), "expected a function"),
    "folder": (lambda: truetriad.calibrate(DEMO, folder=3), "expected a path"),
    "calibration": (lambda: truetriad.compare(3, 3), "path of one"),
    "two to evaluate": (lambda: truetriad.evaluate(3, [DEMO, DEMO]), "one recording"),
    "unit of scenario": (lambda: truetriad.simulate("configs/scenarios/consumer-9dof.yaml", unit="a"), "integer"),
    "great unit": (lambda: truetriad.simulate("configs/scenarios/consumer-9dof.yaml", unit=2**40), "count"),
    "same name": (lambda: truetriad.calibrate([recording(), recording()]), "two recordings have the name"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused(name):
    call, words = REFUSED[name]
    with pytest.raises(truetriad.Usage, match=words) as caught:
        call()
    assert caught.value.code and caught.value.message == str(caught.value)


def test_columns_that_contradict_are_refused():
    columns = {"time[s]": TIME, **{f"accel_{axis}[g]": TIME for axis in "xyz"}}
    assert truetriad.Recording(columns).sensors["accelerometer"]["unit"] == "g"
    with pytest.raises(truetriad.Usage, match="in g by its column names, but in m/s"):
        truetriad.Recording(columns, {"accelerometer": "m/s^2"})
    with pytest.raises(truetriad.Usage, match="second time"):
        truetriad.Recording({**columns, "time[ns]": TIME.astype(int)})
    with pytest.raises(truetriad.Usage, match="second accel_x"):
        truetriad.Recording({**columns, "accel_x[m/s^2]": TIME})


def test_a_sensors_own_time_stands_for_the_shared_one():
    stated = truetriad.Recording({"time": TIME, "accelerometer": ONES,
                                  "gyroscope": {"time_ns": np.arange(3), "readings": np.ones((3, 3))}}, UNITS)
    assert np.array_equal(stated.sensors["gyroscope"]["time_ns"], [0, 1, 2])
    assert np.array_equal(stated.time("accelerometer"), TIME)


def test_a_recording_does_not_change():
    own = ONES.copy()
    kept = recording(accelerometer=own)
    own[:] = 7
    assert np.array_equal(kept.accelerometer, ONES)
    with pytest.raises(ValueError):
        kept.accelerometer += 1
    with pytest.raises(TypeError):
        kept.sensors["accelerometer"]["readings"] = own


def test_config_takes_paths_and_numbers_of_numpy():
    config = {"experiment": 1, "input": pathlib.Path(DEMO), "sensors": {"accelerometer": {"model": "diagonal"}},
              "reference": {"gravity_mps2": np.float32(9.75)}, "exclude_poses": np.array([3])}
    stated = truetriad.calibrate(None, config).to_dict()
    assert stated["reference"]["gravity_mps2"] == 9.75
    assert stated["config"]["exclude_poses"] == [3]


def test_names_of_files_need_not_be_utf8(tmp_path):
    folder = os.fsencode(tmp_path)
    log, result = folder + b"/l\xff.csv", folder + b"/c\xff.yaml"
    pathlib.Path(os.fsdecode(log)).write_bytes(pathlib.Path(DEMO).read_bytes())
    for name in (log, os.fsdecode(log), pathlib.Path(os.fsdecode(log))):
        calibration = truetriad.calibrate(name)
        assert calibration.usable and "l\\xFF.csv" in str(calibration)
    calibration.save(result)
    calibration.report(os.fsdecode(result) + ".html")
    assert truetriad.load(result).to_yaml() == calibration.to_yaml()
    assert truetriad.evaluate(result, log).verdict == "no-test"
    with pytest.raises(truetriad.BadInput) as caught:
        truetriad.load(folder + b"/nothing\xff")
    assert os.fsencode(caught.value.file) == folder + b"/nothing\xff"
    str(caught.value).encode()  # Can be printed.


def test_an_edited_calibration_is_a_dict_whatever_the_style_of_its_text(demo, tmp_path):
    text = demo.to_yaml()
    above = text[:text.index("\nconfig:")]
    (tmp_path / "edited.yaml").write_text(above + "\nconfig:\n  note: |\n    of two\n    lines\n")
    assert truetriad.load(tmp_path / "edited.yaml").to_dict()["config"] == {"note": "of two\nlines\n"}


@pytest.mark.parametrize("time, code", [([0, np.nan], "value-out-of-range"), ([0, 1e30], "value-out-of-range"),
                                        ([1, 0], "time-goes-back")])
def test_times_that_a_lag_cannot_follow_are_refused(tmp_path, time, code):
    _, truth = truetriad.simulate("configs/scenarios/thermal-soak.yaml")
    text = truth.to_yaml().replace("      rate: {", "      element_lag_s: [30, 30, 30]\n      rate: {", 1)
    (tmp_path / "lagging.yaml").write_text(text)
    sensor = truetriad.load(tmp_path / "lagging.yaml").accelerometer
    assert sensor.needs_time and not truth.accelerometer.needs_time
    with pytest.raises(truetriad.BadInput) as caught:
        sensor.correct(ONES[:2], 20.0, time=time)
    assert caught.value.code == code
    with pytest.raises(truetriad.BadInput, match="temperature 1 is infinite"):
        sensor.correct(ONES[:2], [20.0, np.inf], time=[0, 1])
