# SPDX-License-Identifier: Apache-2.0
"""Builds the Python module with CMake, in build/ or the folder that TRUETRIAD_BUILD_FOLDER names: what is
compiled there already is not compiled again."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
VERSION = re.search(r"project\(truetriad VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def build_folder():
    return ROOT / os.environ.get("TRUETRIAD_BUILD_FOLDER", "build")


def is_configured_for(folder, python):
    """Whether the module of this Python is built there: then nothing is said anew."""
    cache = folder / "CMakeCache.txt"
    stated = re.search(r"^Python_EXECUTABLE:\w+=(.+)$", cache.read_text(), re.M) if cache.exists() else None
    return stated is not None and os.path.realpath(stated.group(1)) == os.path.realpath(python)


class CMakeBuild(build_ext):
    def build_extension(self, ext):
        folder = build_folder()
        # That of a virtual environment goes with it.
        python = getattr(sys, "_base_executable", sys.executable)
        if not is_configured_for(folder, python):
            self.configure(folder, python)
        jobs = str(os.cpu_count() or 1)
        subprocess.run(["cmake", "--build", str(folder), "--target", "truetriad_python", "--parallel", jobs],
                       check=True)
        target = pathlib.Path(self.get_ext_fullpath(ext.name)).parent
        built = folder / "python" / "truetriad"
        target.mkdir(parents=True, exist_ok=True)
        shutil.copy2(built / self.get_ext_filename("_truetriad"), target)
        shutil.copytree(ROOT / "share" / "truetriad" / "magnetic", target / "share" / "truetriad" / "magnetic",
                        dirs_exist_ok=True)

    @staticmethod
    def configure(folder, python):
        configure = ["cmake", "-S", str(ROOT), "-B", str(folder), f"-DPython_EXECUTABLE={python}",
                     "-DTRUETRIAD_PYTHON=ON", "--log-level=WARNING"]
        if not (folder / "CMakeCache.txt").exists():
            configure += ["-DCMAKE_BUILD_TYPE=Release", "-DTRUETRIAD_BUILD_TESTS=OFF"]
            if shutil.which("ninja"):
                configure += ["-G", "Ninja"]
        subprocess.run(configure, check=True)
        if not (folder / "python" / "truetriad").is_dir():
            raise SystemExit(f"pybind11 or the headers of {python} are missing; on Debian install pybind11-dev "
                             "and python3-dev")


LEAVINGS = build_folder() / "pip"
LEAVINGS.mkdir(parents=True, exist_ok=True)
setup(
    version=VERSION,
    packages=["truetriad"],
    package_dir={"": "python"},
    package_data={"truetriad": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("truetriad._truetriad", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
    # Beside what CMake builds; nothing is left in the source.
    options={"build": {"build_base": str(LEAVINGS)}, "egg_info": {"egg_base": str(LEAVINGS)},
             "bdist_wheel": {"bdist_dir": str(LEAVINGS / "wheel")}},
)
