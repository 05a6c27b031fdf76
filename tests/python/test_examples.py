# SPDX-License-Identifier: Apache-2.0
import importlib.util
import subprocess
import sys


def run(*words):
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_calibrate_and_plot(tmp_path):
    picture = tmp_path / "norms.png"
    text = run("examples/python/calibrate_and_plot.py", "datasets/demo/recording.csv", picture)
    assert "NO LIMITS SET" in text and "corrected:" in text
    if importlib.util.find_spec("matplotlib"):
        assert picture.read_bytes().startswith(b"\x89PNG")
    else:
        assert "no picture" in text


def test_monte_carlo():
    text = run("examples/python/monte_carlo.py", "configs/scenarios/consumer-9dof.yaml", 3)
    # Errors of some 30 parameters in three runs: far from 1 only where sigmas are wrong.
    assert 0.5 < float(text.splitlines()[-1].split()[-1]) < 2.0
