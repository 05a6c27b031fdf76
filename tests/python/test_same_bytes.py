# SPDX-License-Identifier: Apache-2.0
"""Python, the command line and a worker of the fleet are one program: the same bytes of calibration.yaml."""
import pathlib

import pytest

import truetriad

EXPERIMENTS = pathlib.Path("configs/experiments")
DEMO = "datasets/demo/recording.csv"


@pytest.fixture(scope="module")
def soak(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("soak")
    run("simulate", "-c", "configs/scenarios/thermal-soak.yaml", "-o", folder)
    return folder


@pytest.mark.parametrize("name", ["accelerometer-only", "joint", "nine-axis", "thermal-soak"])
def test_the_same_bytes_of_all_three(run, tmp_path, monkeypatch, soak, name):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    config, log = EXPERIMENTS / f"{name}.yaml", DEMO
    serial = "T0001" if name == "thermal-soak" else "U1"  # The recording states its own.
    overrides = {"device.serial": serial}
    if name == "thermal-soak":
        log = str(soak / "recording.yaml")
        overrides["poses"] = {"file": str(soak / "poses.yaml")}
    words = ["-c", config, f"--set=device.serial={serial}", "--report=false", "--quiet"]
    if name == "thermal-soak":
        words.append(f"--set=poses={{file: {soak / 'poses.yaml'}}}")
    run("calibrate", log, "-o", tmp_path / "cli", *words, codes=(0, 4))
    run("fleet", "run", log, "-o", tmp_path / "day", "--jobs=1", *words)
    (of_fleet,) = (tmp_path / "day" / "units").rglob("calibration.yaml")
    calibration = truetriad.calibrate(log, config, set=overrides)
    assert calibration.usable
    calibration.save(tmp_path / "python.yaml")
    expected = (tmp_path / "cli" / "calibration.yaml").read_bytes()
    assert of_fleet.read_bytes() == expected
    assert (tmp_path / "python.yaml").read_bytes() == expected
