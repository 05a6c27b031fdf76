# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import subprocess
import sys

import pytest


def test_pip_installs_what_is_built(tmp_path, program):
    """A wheel of the build folder that is there, in an environment of its own."""
    pytest.importorskip("setuptools")
    pytest.importorskip("pip")
    venv = pytest.importorskip("venv")
    build = pathlib.Path(program).resolve().parent
    try:
        venv.create(tmp_path / "env", system_site_packages=True, with_pip=True)
    except subprocess.CalledProcessError:
        pytest.skip("python3-venv is not installed")
    python = tmp_path / "env" / "bin" / "python"
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "TRUETRIAD_SHARE")}
    environment["TRUETRIAD_BUILD_FOLDER"] = str(build)
    environment["PYTHONDONTWRITEBYTECODE"] = "1"

    def pip(*words):
        done = subprocess.run([python, "-m", "pip", *words, "--quiet"], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    source = copy_of_source(tmp_path)
    before, there = files_in(source), files_in(tmp_path / "env")
    pip("install", "--no-build-isolation", "--no-deps", str(source))
    assert files_in(source) == before
    demo = pathlib.Path("datasets/demo/recording.csv").resolve()
    script = ("import pathlib, truetriad; here = pathlib.Path(truetriad.__file__).parent;"
              "assert 'env' in here.parts and (here / 'py.typed').exists() and (here / '__init__.pyi').exists();"
              "assert (here / 'share/truetriad/magnetic/wmm2025.wmm').exists();"
              f"print(truetriad.calibrate({str(demo)!r}).verdict)")
    text = subprocess.run([python, "-c", script], env=environment, cwd=tmp_path, check=True,
                          capture_output=True, text=True).stdout
    assert text.startswith("NO_LIMITS")
    pip("uninstall", "--yes", "truetriad")
    assert files_in(tmp_path / "env") == there


def test_a_checkout_finds_its_module_or_says_what_builds_it(tmp_path, program):
    """`tools/build.sh python` builds the target of that name into the build folder."""
    build = pathlib.Path(program).resolve().parent
    package = tmp_path / "python" / "truetriad"
    package.mkdir(parents=True)
    for path in pathlib.Path("python/truetriad").iterdir():
        if path.is_file():
            (package / path.name).write_bytes(path.read_bytes())
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "python")}

    def imported():
        return subprocess.run([sys.executable, "-c", "import truetriad; print(truetriad.__version__)"],
                              env=environment, cwd=tmp_path, capture_output=True, text=True)
    alone = imported()
    assert alone.returncode == 1 and "`tools/build.sh python`" in alone.stderr, alone.stderr
    (tmp_path / "build").symlink_to(build)
    found = imported()
    assert found.returncode == 0, found.stderr
    targets = subprocess.run(["cmake", "--build", str(build), "--target", "help"], capture_output=True, text=True)
    assert "\npython:" in targets.stdout or "\n... python" in targets.stdout


def files_in(folder):
    """Of a folder, not of those that links in it lead to."""
    return sorted(os.path.join(where, name) for where, _, names in os.walk(folder) for name in names)


def copy_of_source(folder):
    """Links to what setup.py reads, and a package of its own, so that what it leaves there is seen."""
    copy = folder / "source"
    copy.mkdir()
    for name in os.listdir("."):
        if name not in ("python", "build") and not name.startswith(".") and not name.endswith(".egg-info"):
            (copy / name).symlink_to(pathlib.Path(name).resolve())
    package = copy / "python" / "truetriad"
    package.mkdir(parents=True)
    for path in pathlib.Path("python/truetriad").iterdir():
        if path.is_file():
            (package / path.name).write_bytes(path.read_bytes())
    return copy
