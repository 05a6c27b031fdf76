# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

import truetriad


@pytest.fixture(scope="module")
def calibration():
    return truetriad.calibrate("datasets/demo/recording.csv")


def test_html_has_each_bias_with_its_sigma(calibration):
    page = calibration._repr_html_()
    for sensor in (calibration.accelerometer, calibration.gyroscope, calibration.magnetometer):
        for value, sigma in zip(sensor.bias, sensor.bias_sigma):
            assert f"<td>{value:.6g} ± {sigma:.2g}</td>" in page


def test_html_of_no_result_says_so():
    experiment = {"experiment": 1, "poses": "every_row", "sensors": {"accelerometer": {"model": "full"}}}
    few = truetriad.calibrate({"accelerometer": np.eye(3) * 9.8}, experiment, units={"accelerometer": "m/s^2"})
    assert "NO RESULT" in few._repr_html_() and "<table>" not in few._repr_html_()


def test_frame_has_every_parameter(calibration):
    pytest.importorskip("pandas")
    frame = calibration.to_frame()
    assert list(frame.index) == calibration.covariance.names
    assert frame.notna().all().all()
    assert frame.value["accelerometer.sensitivity.yx"] == calibration.accelerometer.sensitivity[1, 0]
    assert frame.sigma["magnetometer.bias.z"] == calibration.magnetometer.bias_sigma[2]


def test_plot_has_both_vector_sensors(calibration):
    pytest.importorskip("matplotlib").use("Agg")
    figure = calibration.plot()
    assert [axes.get_ylabel().split(":")[0] for axes in figure.axes] == ["accelerometer", "magnetometer"]
    before, after = figure.axes[0].lines
    assert np.median(after.get_ydata()) < 0.1 * np.median(before.get_ydata())


def test_the_example_runs_from_cell_to_cell():
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib").use("Agg")
    with open("examples/python/notebook.ipynb") as file:
        cells = json.load(file)["cells"]
    names = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert names["c"].usable
